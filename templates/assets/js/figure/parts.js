// The parts of a job in two workers at once: the page's own takes them from the first on, and a second one from the last
// on. Once none is left, the page's worker begins what the second is still at, and whichever ends first counts: the
// outcome is the same. A second worker that fails or hangs is thus never waited for.
/** @import { FigureRecord, JobResult, Slice } from "../base/types.js" */

import { runtime } from "../runtime/runtime.js";
import { secondWorker } from "../runtime/second.js";

/**
 * Runs a job to its end, unless `going` returns false. `show` is called with each new result, the last one of all parts,
 * and `hear` with the fraction done from 0 to 1 and the progress in words. Rejects as `runtime.job` does.
 * @param {{ figure: string, record: FigureRecord, name: string }} job
 * @param {{ going: () => boolean, hear: (fraction: number, words: string) => void,
 *   show: (result: JobResult) => void }} reader
 */
export async function runParts({ figure, record, name }, { going, hear, show }) {
  /** @type {string[]} */
  const parts = await runtime.job({ figure, record, name, does: "parts" });
  if (!going()) return;
  const left = [...parts];
  /** @type {Record<string, unknown>} */
  const outcomes = {};
  /** @type {Record<string, number>} */
  const fractions = {};
  let words = ""; // of the page's worker: two workers' would change the height of a phone's page
  let drawn = 0; // how many outcomes the last result has

  /** @param {string} part */
  const isDone = (part) => part in outcomes;

  /** @param {0 | 1} lane @param {string} part @param {Slice} slice */
  function note(lane, part, slice) {
    if (!going() || isDone(part)) return;
    fractions[part] = Math.max(fractions[part] ?? 0, slice.fraction);
    if (lane === 0) words = slice.words;
    if (slice.done) outcomes[part] = slice.outcome;
    const sum = Object.values(fractions).reduce((total, fraction) => total + fraction, 0);
    hear(sum / parts.length, words);
  }

  async function help() {
    const second = secondWorker();
    await second?.up;
    for (let part = second && left.pop(); part && going(); part = left.pop()) {
      for (let does = "begin"; going() && !isDone(part); does = "go on") {
        note(1, part, /** @type {Slice} */ (await second?.job({ figure, record, job: name, do: does, part })));
      }
    }
  }

  async function work() {
    let part = "";
    let does = /** @type {"begin" | "go on"} */ ("go on");
    while (going() && drawn < parts.length) {
      const known = Object.keys(outcomes).length;
      if (known > drawn) {
        const result = await runtime.job({ figure, record, name, does: "result", outcomes });
        drawn = known;
        if (going()) show(result);
        continue;
      }
      if (!part || isDone(part)) {
        part = left.shift() ?? parts.find((name) => !isDone(name)) ?? "";
        does = "begin";
      }
      note(0, part, await runtime.job({ figure, record, name, does, part }));
      does = "go on";
    }
  }

  help().catch(() => {});
  await work();
  runtime.job({ figure, record, name, does: "stop" }).catch(() => {}); // it may be at a part that the second one ended
}
