// What a figure shows and which questions it has asked: plain data in one class.

/** @import { FigureRecord, Frame, Progress, Question, RuntimeState } from "../base/types.js" */

/**
 * What is shown: "static", the picture that the page was built with; "tape", a frame recorded at build time; "live", a
 * frame that Python drew; "waiting", the last picture, while a question waits for Python to start; "failed", the last
 * picture, because the question has no answer.
 * @typedef {"static" | "tape" | "live" | "waiting" | "failed"} StateName
 */

/**
 * The waiting questions after a new one. Until Python is up only the latest counts; then a question replaces the last
 * one if both have the same `merge`.
 * @type {(waiting: readonly Question[], question: Question, live: boolean) => Question[]}
 */
export function merged(waiting, question, live) {
  if (!live) return [question];
  const replaces = question.merge && waiting.at(-1)?.merge === question.merge;
  return [...(replaces ? waiting.slice(0, -1) : waiting), question];
}

export class FigureState {
  /** @type {Question[]} not yet asked, oldest first */
  #waiting = [];
  /** @type {Question | null} being drawn */
  #asked = null;
  /** @type {Progress | null} the progress of the question being drawn, if it takes long */
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
    /** the records that the page was built with, that the reader wants to see, and that is shown */
    this.initial = record;
    this.record = record;
    this.shown = record;
    this.frame = frame;
  }

  /** Whether questions wait to be asked; until Python is up, only the latest does. */
  get waiting() {
    return this.#waiting.length > 0;
  }

  get asked() {
    return this.#asked;
  }

  get replay() {
    return this.#replay;
  }

  /** Why the last question could not be answered, in words; cleared by the next question. */
  get error() {
    return this.#error;
  }

  /** Why a question waits although Python is up, in words: one of Python's files did not load. */
  get lack() {
    return this.#lack;
  }

  /** Whether a question is being drawn or waits to be asked. */
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

  /** Prepares for another question: drops the last one's error. */
  begin() {
    this.#error = "";
    if (this.#lack) this.clear();
  }

  /**
   * Adds a question for a record that is not there yet.
   * @param {FigureRecord} record
   * @param {string | null} merge
   * @param {boolean} live  Python is up
   */
  wait(record, merge, live) {
    this.#waiting = merged(this.#waiting, { record, merge }, live);
  }

  /** Takes the oldest question to be drawn now; null if there is none or one is being drawn already. */
  take() {
    if (this.#asked || !this.waiting) return null;
    this.#lack = "";
    return (this.#asked = this.#waiting.shift() ?? null);
  }

  /**
   * Notes the progress of the question being drawn.
   * @param {Progress} replay
   */
  progress(replay) {
    this.#replay = replay;
  }

  /** The question was answered or failed. `replayed` keeps a replay's progress for the question that continues it. */
  settle(replayed = false) {
    this.#asked = null;
    if (!replayed) this.#replay = null;
  }

  /** Queues the wanted record again, for the next worker after Python has stopped. */
  again() {
    this.#waiting = [{ record: this.record, merge: null }];
  }

  /**
   * A file that Python needs for the record did not load: the record waits for a retry or another question.
   * @param {string} reason
   */
  miss(reason) {
    this.again();
    this.#lack = reason;
  }

  /** Drops all waiting questions. */
  clear() {
    this.#waiting = [];
    this.#lack = "";
  }

  /** Gives up all questions and returns to the shown record. */
  leave() {
    this.#asked = this.#replay = null;
    this.clear();
    this.record = this.shown;
  }

  /**
   * Keeps the last picture, returns to its record and notes the error.
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
  }
}
