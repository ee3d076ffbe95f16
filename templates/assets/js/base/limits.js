// How long things may take, and marks for whoever measures how long they take.

/** Milliseconds; a test may shorten them. `window.LADDER_PATIENCE` stands in for `start` where it is set. */
const patience = { start: 25000, frame: 10000, replay: 30000, reading: 60000, slow: 1000 };
export const limits = { ...patience, run: 125, motion: 420, rest: 60, pause: 300, gap: 1000 };

const MARKS = ["ladder:input", "ladder:swap", "ladder:finer"];
let marks = 0;

/**
 * A performance mark for whoever measures; swept now and then, so that a long visit does not gather them.
 * @param {string} name
 * @param {string} detail
 */
export function mark(name, detail, startTime = performance.now()) {
  if (++marks % 1000 === 0) MARKS.forEach((each) => performance.clearMarks(each));
  performance.mark(name, { detail, startTime });
}
