// One figure's controller: asks for frames and swaps them in. The parts (handles, controls, buttons …) listen to its
// events and call its methods; none of them writes into it.

/** @import { Asker, Dispose, FigureEvents, FigureRecord, Frame, Panel, Progress, Spec } from "../base/types.js" */

import { fragmentOf } from "../base/address.js";
import { find, messageOf } from "../base/dom.js";
import { emitter } from "../base/emitter.js";
import { limits, mark } from "../base/limits.js";
import * as records from "../base/record.js";
import { runtime } from "../runtime/runtime.js";
import { arrived, onTape, taped } from "../runtime/tape.js";
import { MORE, moreOf } from "./more.js";
import { motionLength, startMotions } from "./motion.js";
import { swapPanels } from "./panels.js";
import { FigureState } from "./state.js";

export class Figure {
  /** @type {FigureState} */
  #state;
  /** @type {ReturnType<typeof emitter<FigureEvents>>} */
  #events = emitter();
  #visible = false;
  #running = false;
  #speaks = false;
  #pressed = false; // one more press or click led to the shown record
  #began = 0; // when the current motion began, by performance.now()
  /** @type {Dispose | null} ends the current motion */
  #moving = null;
  /** @type {object | null} the finer drawing of the shown record that is requested next */
  #finer = null;
  /** @type {ReturnType<typeof setTimeout> | undefined} the timer that will ask for it */
  #rest;
  /** @type {() => boolean} */
  #reading = () => false;

  /** @param {HTMLElement} root */
  constructor(root) {
    const { record, frame, spec } = JSON.parse(find(root, "script.figure-record").textContent ?? "");
    this.root = root;
    this.id = root.id;
    /** @type {Spec} */
    this.spec = spec;
    this.stage = find(root, ".figure-stage");
    this.#state = new FigureState(record, frame);
    runtime.on("change", () => this.#runtimeChanged());
    onTape(this.id, () => this.#tapeArrived());
    this.on = this.#events.on;
    this.tell();
  }

  /** @param {() => boolean} test  whether a file of the reader's is still being read */
  whileReading(test) {
    this.#reading = test;
  }

  /** The record that the reader wants to see. */
  get record() {
    return this.#state.record;
  }

  /** The record that the page was built with. */
  get initial() {
    return this.#state.initial;
  }

  /** The record that is shown. */
  get shown() {
    return this.#state.shown;
  }

  get frame() {
    return this.#state.frame;
  }

  get state() {
    return this.#state.name(runtime.state);
  }

  /** Why the last question could not be answered, in words; "" if it was. */
  get error() {
    return this.#state.error;
  }

  /** Why the wanted record waits although Python is up, in words; "" if none does. */
  get lack() {
    return this.#state.lack;
  }

  /** The question that is being drawn. */
  get asked() {
    return this.#state.asked;
  }

  /** The progress of the question that is being drawn, if it takes long. */
  get replay() {
    return this.#state.replay;
  }

  /** Whether a question waits to be asked. */
  get waiting() {
    return this.#state.waiting;
  }

  /** Whether a question is being drawn or waits to be asked. */
  get pending() {
    return this.#state.pending;
  }

  /** Whether anything is being read, asked, moved or refined; questions that wait for a missing file do not count. */
  get busy() {
    return Boolean(this.#reading() || (this.pending && !this.lack) || this.#moving || this.#finer);
  }

  /** Whether the figure is on screen. */
  get visible() {
    return this.#visible;
  }

  /** Whether a run is pressing its button again and again. */
  get running() {
    return this.#running;
  }

  /** Whether the next change is to be announced to screen readers. */
  get speaks() {
    return this.#speaks;
  }

  /**
   * Asks for `record` to be shown. It replaces the last waiting question if that has the same `merge`; without `merge`,
   * questions are answered one by one, in order. `by` names who asks, for parts that stop when another one does.
   * @param {FigureRecord} record
   * @param {{ merge?: string | null, by?: Asker, at?: number }} [options]
   */
  ask(record, { merge = null, by = "", at } = {}) {
    mark("ladder:input", this.id, at);
    this.#coarse();
    this.#state.begin();
    this.#speaks ||= !["hover", "run", "play"].includes(by);
    const frame = runtime.state === "live" ? undefined : taped(this.id, record);
    if (!frame && this.#untaped()) return;
    this.#state.record = record;
    this.#events.emit("asked", by);
    if (frame) {
      this.#state.clear();
      this.#show(record, frame, "tape");
      return;
    }
    this.#state.wait(record, merge, runtime.state === "live");
    runtime.start();
    this.#pump();
    this.tell();
  }

  #untaped() {
    const unavailable = runtime.state === "file" && arrived(this.id); // a page opened from disk has no Python
    if (unavailable) this.refuse("This state is not on the figure’s tape, and a page opened from disk has no Python.");
    return unavailable;
  }

  /** Sends the oldest waiting question to Python, unless one is being drawn. */
  #pump() {
    const question = runtime.state === "live" ? this.#state.take() : null;
    if (!question) return;
    const isStale = () => this.#state.asked !== question;
    const detail = this.spec.details > 1 ? 0 : undefined;
    const began = performance.now();
    /**
     * A long replay gives way to a newer question: the newer record includes everything done meanwhile.
     * @param {Progress} replay
     */
    const going = (replay) => {
      if (isStale()) return false;
      this.#state.progress(replay);
      this.tell();
      return !this.#state.waiting || performance.now() < began + limits.slow;
    };
    runtime.frame({ figure: this.id, record: question.record, detail, going }).then(
      (frame) => {
        if (isStale()) return;
        this.#state.settle();
        this.#pump(); // Python draws the next while the page swaps this one in
        this.#show(question.record, frame, "live");
        this.#refine(limits.rest);
      },
      (error) => {
        if (isStale()) return;
        this.#state.settle(true);
        const recorded = error.lacks && taped(this.id, question.record);
        const reason = error.message.replace(/^ValueError: /, "");
        if (error.stopped) this.#state.again();
        else if (recorded) this.#show(question.record, recorded, "tape");
        else if (!error.lacks) this.refuse(`This state cannot be drawn: ${reason}.`);
        else if (!this.#state.waiting) this.#state.miss(reason);
        if (!this.lack) this.#pump();
        if (!this.#state.asked) this.#state.settle();
        if (!error.stopped && !error.lacks) this.#refine(limits.rest); // what the question interrupted
        this.tell();
      },
    );
  }

  /** Cancels the next refinement of the picture. */
  #coarse() {
    clearTimeout(this.#rest);
    this.#finer = null;
  }

  /**
   * Requests ever finer drawings of the shown record, the next one after `wait` ms, until something else is asked.
   * @param {number} wait
   */
  #refine(wait) {
    this.#coarse();
    const { shown: record, frame } = this;
    if (this.pending || !(frame.detail + 1 < this.spec.details)) return;
    const finer = (this.#finer = { record });
    this.#rest = setTimeout(() => {
      const stale = () => this.#finer !== finer;
      runtime.frame({ figure: this.id, record, detail: frame.detail + 1, finer: true }).then(
        (better) => {
          if (stale()) return;
          this.#show(record, better, "live");
          this.#refine(0);
          this.tell();
        },
        (error) => {
          if (stale()) return;
          this.#coarse();
          if (!error.stopped) this.refuse(`This cannot be drawn in more detail: ${messageOf(error)}.`);
          this.tell();
        },
      );
    }, wait);
  }

  /**
   * Keeps the last picture, returns to its record and reports the message as an error.
   * @param {string} message
   */
  refuse(message) {
    this.#state.refuse(message);
    this.#left();
  }

  /** Asks again for the question that waits because one of Python's files did not load. */
  retry() {
    this.#pump();
    this.tell();
  }

  /** Gives up all questions and returns to the shown record. */
  leave() {
    this.#state.leave();
    this.#left();
    if (runtime.state === "live") this.#refine(limits.rest); // what the question interrupted
  }

  #left() {
    this.#events.emit("asked", "left");
    this.#events.emit("frame", this.frame);
    this.tell();
  }

  /**
   * @param {FigureRecord} record
   * @param {Frame} frame
   * @param {"tape" | "live"} source
   */
  #show(record, frame, source) {
    const same = records.key(record) === records.key(this.shown); // a finer drawing: it may be the first with motions
    if (!same) this.#pressed = records.pressed(this.shown, record);
    const goesOn = same && Boolean(this.#moving);
    const moves = goesOn || (this.#pressed && !(same && this.frame.motions.length));
    if (!goesOn) this.#began = performance.now();
    this.#endMotion();
    this.#state.show(record, frame, source);
    swapPanels(this.root, frame.panels);
    this.root.dataset.frame = String(Number(this.root.dataset.frame ?? 0) + 1);
    mark(this.#finer ? "ladder:finer" : "ladder:swap", this.id);
    if (moves) {
      this.#moving = startMotions(frame.motions, this.#began, motionLength(this.#running), () => {
        this.#moving = null;
        this.tell();
      });
    }
    this.#events.emit("frame", frame);
    this.tell();
  }

  #endMotion() {
    this.#moving?.();
    this.#moving = null;
  }

  /** Ends a motion early: the picture is then that of the numbers beside it. */
  endMotion = () => {
    this.#endMotion();
    this.tell();
  };

  /** Notifies everything that depends on the figure's state. */
  tell() {
    this.root.dataset.state = this.state;
    this.#events.emit("state");
  }

  /** @param {string} message  shown in the status line until the next question */
  say(message) {
    this.#events.emit("say", message);
  }

  /** @type {(label: string, value: string) => void} text for the reader to copy, after the clipboard refused it */
  offer = (label, value) => this.#events.emit("offer", label, value);

  /** @type {(message: string) => void} words for screen readers */
  announce = (message) => this.#events.emit("announce", message);

  /** Has the frame announced to screen readers, which a hover, a run or a play does not do by itself. */
  speak() {
    this.#speaks = true;
    this.tell();
  }

  /** The frame has been announced, or there was nothing to say. */
  spoken() {
    this.#speaks = false;
  }

  /**
   * Notes that a run has begun or ended: during a run, motions last no longer than the time between presses.
   * @param {boolean} running
   */
  run(running) {
    this.#running = running;
  }

  /**
   * Notes that the figure has entered or left the viewport.
   * @param {boolean} visible
   */
  see(visible) {
    this.#visible = visible;
    this.#events.emit("seen");
  }

  /** Notes that the figure is drawn at another size. */
  rescaled() {
    this.#events.emit("scaled");
  }

  /**
   * A panel's view.
   * @param {string} panel
   */
  viewOf(panel) {
    return /** @type {Panel} */ (this.frame.panels.find(({ name }) => name === panel)).view;
  }

  /** Moves the focus to the stage, when the reader is sent to the figure or the focused element is removed. */
  focus() {
    this.stage.tabIndex = -1;
    this.stage.focus({ preventScroll: true });
  }

  #runtimeChanged() {
    this.#pump();
    if (runtime.state === "live" && !this.#finer) this.#refine(0);
    this.tell();
  }

  #tapeArrived() {
    if ((runtime.state === "live" && !this.lack) || !this.waiting) return;
    const frame = taped(this.id, this.record);
    if (!frame) return void this.#untaped();
    this.#state.clear();
    this.#show(this.record, frame, "tape");
  }

  /** The page's initial record, but with the reader's own files. */
  get fresh() {
    return { ...this.initial, given: this.record.given };
  }

  /** Empties the log; if it is empty already, restores the page's settings. Replaces a dead worker. */
  reset() {
    const isDead = runtime.stopped && runtime.state === "failed";
    if (isDead) this.#state.clear();
    this.ask(records.reset(this.record.log.length ? this.record : this.fresh));
    if (isDead) runtime.restart();
  }

  /** A link to the figure in the state that is shown. */
  link() {
    const suffix = moreOf(this.root)?.open ? MORE : "";
    return location.href.split("#")[0] + fragmentOf(this.id, records.encode(this.shown)) + suffix;
  }
}
