// The status line: what a figure waits for, why it failed, its note. The announcer speaks what screen readers must
// hear.
/** @import { Progress, Question } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { around, find, make, on, text } from "../base/dom.js";
import { megabytes } from "../base/format.js";
import { limits } from "../base/limits.js";
import { figures } from "./registry.js";
import { runtime } from "../runtime/runtime.js";
import { frugal } from "../runtime/start.js";
import { update } from "./update.js";

const LONGEST = 280; // characters: text from an address or a file may have any length
/** @type {Record<string, string>} */
const STAGES = { python: "unpacking", numpy: "starting numpy", widgets: "starting the solvers" };
const FROM_DISK =
  "Opened from disk: for live figures, run “python3 -m http.server” in this folder and open localhost:8000.";

/** @param {string} words */
const short = (words) => (words.length > LONGEST ? `${words.slice(0, LONGEST - 2).trimEnd()} …` : words);

function progress() {
  const { loaded, total, stage } = runtime;
  return STAGES[stage] ?? `${megabytes(loaded)} of ${megabytes(total)} MB`;
}

/** @param {Progress} replay */
function replaying({ replayed, of, reads: file }) {
  if (of === undefined) return { words: `Python is reading ${file || "the drawing"} again.` };
  if (of === 1) return { words: "Python is working on this." }; // a single slow action
  return { words: "Restoring your actions.", progress: `${replayed} of ${of} actions` };
}

/**
 * What the line says: words, progress, the ways on, and whether to announce the words, because the reader asked for
 * something. `late`: the current answer takes long.
 * @param {Figure} figure
 * @param {boolean} late
 * @returns {{ words: string, progress?: string, ways: string[], heard?: boolean }}
 */
function statusOf(figure, late) {
  if (figure.error) {
    if (runtime.state === "file") return { words: `${figure.error} ${FROM_DISK}`, ways: [], heard: true };
    if (!update.available) return { words: figure.error, ways: ["Reset"], heard: true };
    return { words: `${figure.error} This site has been updated.`, ways: ["Reset", "Reload"], heard: true };
  }
  const waits = figure.waiting;
  const failed = runtime.state === "failed";
  if ((failed && (waits || figure.visible)) || figure.lack) {
    if (update.available) {
      const kept = waits ? " Only this figure’s state is kept." : ""; // the address holds one state
      return { words: `This site has been updated.${kept}`, ways: ["Reload"], heard: waits };
    }
    const assurance = waits ? " Your work is kept." : "";
    const choices = !failed ? ["Retry", "Cancel"] : runtime.stopped ? ["Retry", "Reset"] : ["Retry"];
    return { words: `${failed ? runtime.message : figure.lack}.${assurance}`, ways: choices, heard: waits };
  }
  if (waits && runtime.state !== "live") {
    const words = "Python is starting; then this will be shown.";
    return { words, progress: progress(), ways: [], heard: true };
  }
  const first = figures.values().next().value === figure;
  if (runtime.state === "file" && first) return { words: FROM_DISK, ways: [] };
  if (runtime.state === "idle" && frugal && !figure.frame.note) {
    return { words: `Python (${megabytes(runtime.total)} MB) loads when you first need it.`, ways: [] };
  }
  if (late && figure.replay) return { ...replaying(figure.replay), ways: ["Cancel"], heard: true };
  if (late) return { words: "Python is working on this.", ways: [], heard: true };
  return { words: figure.frame.note, ways: [] };
}

/** @type {Record<string, (figure: Figure) => void>} */
const ways = {
  Retry: (figure) => (runtime.state === "failed" ? runtime.restart() : figure.retry()),
  Reset: (figure) => figure.reset(),
  Cancel(figure) {
    figure.leave();
    figure.say("Cancelled. The figure is as it was.");
  },
  Reload: (figure) => update.reload(figure),
};

/** @param {Figure} figure */
export function addStatus(figure) {
  const line = find(figure.root, ".figure-status");
  const words = make("span", { class: "status-words" });
  const bytes = make("span", { class: "status-progress", "aria-hidden": "true" });
  const choices = make("span", { class: "status-ways" });
  const offer = make("span", { class: "status-offer" });
  let offered = "";
  let passing = ""; // a message that lasts until the next question
  let heard = ""; // the announced part of the current line
  /** @type {Question | null} */
  let watched = null; // the question that is being drawn
  let late = false; // whether its answer takes long
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let patience;
  line.replaceChildren(words, " ", bytes, choices, offer);

  function watch() {
    const newer = watched && figure.replay; // a newer question continues the replay
    if (watched === figure.asked || (figure.asked && newer)) return;
    watched = figure.asked;
    late = false;
    clearTimeout(patience);
    if (!watched) return;
    patience = setTimeout(() => {
      late = true;
      show();
    }, limits.slow);
  }

  function show() {
    watch();
    const status = statusOf(figure, late);
    text(words, short((status.ways.length ? "" : passing) || status.words)); // words with ways on come first
    text(bytes, status.progress ?? "");
    if (offered !== status.ways.join()) {
      offered = status.ways.join();
      if (choices.contains(document.activeElement)) figure.focus();
      choices.replaceChildren(...status.ways.map((way) => make("button", { type: "button", "data-way": way }, way)));
    }
    const aloud = status.heard ? short(status.words) : "";
    if (heard !== aloud) figure.announce((heard = aloud));
  }

  /** @param {string} message */
  function say(message) {
    passing = message;
    show();
    figure.announce(short(message));
  }

  figure.on("say", say);
  figure.on("offer", (label, value) => {
    const field = make("input", { type: "text", readonly: true, value, "aria-label": label });
    say(label);
    offer.replaceChildren(field);
    field.focus();
    field.select();
  });
  figure.on("state", show);
  figure.on("seen", show);
  figure.on("asked", (by) => {
    if (offer.hasChildNodes() && ["run", "play", "hover"].includes(by)) return; // the reader is copying a link
    passing = "";
    offer.replaceChildren();
  });
  on(choices, "click", (event) => ways[around(event, "[data-way]")?.dataset.way ?? ""]?.(figure));
  show();
}
