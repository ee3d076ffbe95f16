// How long things may take, and performance marks for measuring how long they do.

/** Milliseconds; a test may shorten them. `window.LADDER_PATIENCE` overrides `start` if it is set. */
const patience = { start: 25000, frame: 20000, replay: 30000, reading: 60000, slow: 1000 };
export const limits = { ...patience, run: 125, motion: 420, rest: 60, pause: 300, gap: 1000 };

const MARKS = ["ladder:input", "ladder:swap", "ladder:finer"];
let marks = 0;

/**
 * Sets a performance mark; old ones are cleared now and then, so that they do not pile up during a long visit.
 * @param {string} name
 * @param {string} detail
 */
export function mark(name, detail, startTime = performance.now()) {
  if (++marks % 1000 === 0) MARKS.forEach((markName) => performance.clearMarks(markName));
  performance.mark(name, { detail, startTime });
}
