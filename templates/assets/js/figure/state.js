// What a figure shows and what is asked of it: plain data in one class.

/** @import { FigureRecord, Frame, Progress, Question, RuntimeState } from "../base/types.js" */

/**
 * What is seen: "static", the picture that the page was built with; "tape", a frame recorded when the page was built;
 * "live", a frame that Python drew; "waiting", as before, Python is asked and not up; "failed", as before, what is asked
 * has no answer.
 * @typedef {"static" | "tape" | "live" | "waiting" | "failed"} StateName
 */

/**
 * The questions that wait once another is asked. While Python is not up only the latest counts; then one that may be
 * merged takes the place of the last, if that is of its kind.
 * @type {(waiting: readonly Question[], question: Question, live: boolean) => Question[]}
 */
export function merged(waiting, question, live) {
  if (!live) return [question];
  const again = question.merge && waiting.at(-1)?.merge === question.merge;
  return [...(again ? waiting.slice(0, -1) : waiting), question];
}

export class FigureState {
  /** @type {Question[]} not yet asked, the oldest first */
  #waiting = [];
  /** @type {Question | null} being drawn */
  #asked = null;
  /** @type {Progress | null} what the question that is being drawn is at, where that takes long */
  #replay = null;
  /** @type {"static" | "tape" | "live"} */
  #source = "static";
  #error = "";
  #lack = "";

  /**
   * @param {FigureRecord} record
   * @param {Frame} frame
   */
  constructor(record, frame) {
    /** what the page was built with, what the reader wants to see, and what is seen */
    this.initial = record;
    this.record = record;
    this.shown = record;
    this.frame = frame;
  }

  /** Not yet asked; while Python is not up, the latest only. */
  get waiting() {
    return this.#waiting.length > 0;
  }

  get asked() {
    return this.#asked;
  }

  get replay() {
    return this.#replay;
  }

  /** Why the last question has no answer, in words; cleared by the next answer. */
  get error() {
    return this.#error;
  }

  /** Why what waits is not asked while Python is up, in words: a file of Python's did not load. */
  get lack() {
    return this.#lack;
  }

  /** Something is asked, or waits to be. */
  get pending() {
    return this.#asked !== null || this.waiting;
  }

  /**
   * @param {RuntimeState} runtime
   * @returns {StateName}
   */
  name(runtime) {
    if (this.#error || this.#lack || (this.waiting && runtime === "failed")) return "failed";
    return this.waiting && runtime !== "live" ? "waiting" : this.#source;
  }

  /** Another question: what was wrong with the last one is past. */
  begin() {
    this.#error = "";
    if (this.#lack) this.clear();
  }

  /**
   * Wants a record that is not there yet.
   * @param {FigureRecord} record
   * @param {string | null} merge
   * @param {boolean} live  Python is up
   */
  wait(record, merge, live) {
    this.#waiting = merged(this.#waiting, { record, merge }, live);
  }

  /** The oldest question, which is now being drawn; null where there is none, or one is being drawn already. */
  take() {
    if (this.#asked || !this.waiting) return null;
    this.#lack = "";
    return (this.#asked = this.#waiting.shift() ?? null);
  }

  /**
   * What the question that is being drawn is at.
   * @param {Progress} replay
   */
  progress(replay) {
    this.#replay = replay;
  }

  /** The question is answered, or has failed. A replay that a newer question takes on is told of until that is asked. */
  settle(replayed = false) {
    this.#asked = null;
    if (!replayed) this.#replay = null;
  }

  /** Python went, and the record is still wanted: it is asked again of the next one. */
  again() {
    this.#waiting = [{ record: this.record, merge: null }];
  }

  /**
   * A file that Python needs for the record did not load: it waits for the reader to ask again, or for another.
   * @param {string} why
   */
  miss(why) {
    this.again();
    this.#lack = why;
  }

  /** Nothing waits any more. */
  clear() {
    this.#waiting = [];
    this.#lack = "";
  }

  /** Gives up what is being drawn and what waits: the figure is what is seen of it. */
  leave() {
    this.#asked = this.#replay = null;
    this.clear();
    this.record = this.shown;
  }

  /**
   * Keeps the last picture and takes back what led away from it.
   * @param {string} message
   */
  refuse(message) {
    this.#error = message;
    this.leave();
  }

  /**
   * @param {FigureRecord} record
   * @param {Frame} frame
   * @param {"tape" | "live"} source
   */
  show(record, frame, source) {
    this.shown = record;
    this.frame = frame;
    this.#source = source;
    this.#error = "";
  }
}
