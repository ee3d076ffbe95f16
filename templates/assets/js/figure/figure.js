// One figure's controller: asks for frames and swaps them in. The parts (handles, controls, buttons …) listen to its
// events and call its methods; none of them writes into it.

/** @import { Dispose, FigureEvents, FigureRecord, Frame, Panel, Progress, Spec } from "../base/types.js" */

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
  #pressed = false; // what is seen came about by one press more
  #began = 0; // the motion that is under way, as performance.now() tells it
  /** @type {Dispose | null} what ends the motion that is under way */
  #moving = null;
  /** @type {object | null} the next finer drawing of what is seen, on its way */
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

  /** @param {() => boolean} test  whether something that it was given is still being read */
  whileReading(test) {
    this.#reading = test;
  }

  /** What the reader wants to see. */
  get record() {
    return this.#state.record;
  }

  /** What the page was built with. */
  get initial() {
    return this.#state.initial;
  }

  /** What is seen. */
  get shown() {
    return this.#state.shown;
  }

  get frame() {
    return this.#state.frame;
  }

  get state() {
    return this.#state.name(runtime.state);
  }

  /** Why the last question has no answer, in words; "" where it has one. */
  get error() {
    return this.#state.error;
  }

  /** Why the record that is wanted waits while Python is up, in words; "" where none does. */
  get lack() {
    return this.#state.lack;
  }

  /** The question that is being drawn. */
  get asked() {
    return this.#state.asked;
  }

  /** What the question that is being drawn is at, where that takes long. */
  get replay() {
    return this.#state.replay;
  }

  /** Something waits to be asked. */
  get waiting() {
    return this.#state.waiting;
  }

  /** Something is asked, or waits to be. */
  get pending() {
    return this.#state.pending;
  }

  /** Whether something is read, asked, waiting, moving or being made finer. */
  get busy() {
    return Boolean(this.#reading() || (this.pending && !this.lack) || this.#moving || this.#finer);
  }

  /** It is on screen. */
  get visible() {
    return this.#visible;
  }

  /** A run presses its button again and again. */
  get running() {
    return this.#running;
  }

  /** What is seen is to be said to those who hear it. */
  get speaks() {
    return this.#speaks;
  }

  /**
   * Wants the figure to show `record`. Questions with the same `merge` that still wait become the latest one; without
   * it they are answered one by one, in order. `by` names who asks, for those who step aside when others do.
   * @param {FigureRecord} record
   * @param {{ merge?: string | null, by?: string, at?: number }} [options]
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
    const none = runtime.state === "file" && arrived(this.id); // a page opened from disk has no Python
    if (none) this.refuse("This state is not on the figure’s tape, and a page opened from disk has no Python.");
    return none;
  }

  /** Hands the oldest waiting question on, unless one is being drawn. */
  #pump() {
    const question = runtime.state === "live" ? this.#state.take() : null;
    if (!question) return;
    const left = () => this.#state.asked !== question;
    const detail = this.spec.details > 1 ? 0 : undefined;
    const began = performance.now();
    /**
     * A long replay that something newer waits for makes way: the newer record holds what was done meanwhile, too.
     * @param {Progress} replay
     */
    const going = (replay) => {
      if (left()) return false;
      this.#state.progress(replay);
      this.tell();
      return !this.#state.waiting || performance.now() < began + limits.slow;
    };
    runtime.frame({ figure: this.id, record: question.record, detail, going }).then(
      (frame) => {
        if (left()) return;
        this.#state.settle();
        this.#pump(); // Python draws the next while the page swaps this one in
        this.#show(question.record, frame, "live");
        this.#refine(limits.rest);
      },
      (error) => {
        if (left()) return;
        this.#state.settle(true);
        const recorded = error.lacks && taped(this.id, question.record);
        const why = error.message.replace(/^ValueError: /, "");
        if (error.stopped) this.#state.again();
        else if (recorded) this.#show(question.record, recorded, "tape");
        else if (!error.lacks) this.refuse(`This state cannot be drawn: ${why}.`);
        else if (!this.#state.waiting) this.#state.miss(why);
        if (!this.lack) this.#pump();
        if (!this.#state.asked) this.#state.settle();
        this.tell();
      },
    );
  }

  /** Leaves the picture as coarse as it is. */
  #coarse() {
    clearTimeout(this.#rest);
    this.#finer = null;
  }

  /**
   * The next finer drawing of what is seen, `rest` ms from now; then the next, unless something else is asked.
   * @param {number} rest
   */
  #refine(rest) {
    this.#coarse();
    const { shown, frame } = this;
    if (this.pending || !(frame.detail + 1 < this.spec.details)) return;
    const finer = (this.#finer = { record: shown });
    this.#rest = setTimeout(() => {
      const stale = () => this.#finer !== finer;
      runtime.frame({ figure: this.id, record: shown, detail: frame.detail + 1, finer: true }).then(
        (better) => {
          if (stale()) return;
          this.#show(shown, better, "live");
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
    }, rest);
  }

  /**
   * Keeps the last picture and takes back what led away from it.
   * @param {string} message
   */
  refuse(message) {
    this.#state.refuse(message);
    this.#left();
  }

  /** Asks once more for what waits, as a file of Python's did not load. */
  retry() {
    this.#pump();
    this.tell();
  }

  /** Gives up what is being drawn and what waits: the figure is what is seen of it. */
  leave() {
    this.#state.leave();
    this.#left();
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
    const same = records.key(record) === records.key(this.shown); // drawn finer: its motions may be known only now
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

  /** Has everything that depends on the figure's state look at it again. */
  tell() {
    this.root.dataset.state = this.state;
    this.#events.emit("state");
  }

  /** @param {string} message  in passing: it stands until the next question */
  say(message) {
    this.#events.emit("say", message);
  }

  /** @type {(label: string, value: string) => void} text that the clipboard would not take, for the reader to copy */
  offer = (label, value) => this.#events.emit("offer", label, value);

  /** @type {(message: string) => void} words to be heard by those who do not see */
  announce = (message) => this.#events.emit("announce", message);

  /** Has what is seen said to those who hear it: what is asked in passing or by a run is not, without this. */
  speak() {
    this.#speaks = true;
    this.tell();
  }

  /** It has been said, or there was nothing to say. */
  spoken() {
    this.#speaks = false;
  }

  /**
   * A run has begun or ended: while it goes on, motions are no longer than from press to press.
   * @param {boolean} running
   */
  run(running) {
    this.#running = running;
  }

  /**
   * The figure has come on screen, or has left it.
   * @param {boolean} visible
   */
  see(visible) {
    this.#visible = visible;
    this.#events.emit("seen");
  }

  /** The figure is drawn in another size. */
  rescaled() {
    this.#events.emit("scaled");
  }

  /**
   * The window that a panel shows.
   * @param {string} panel
   */
  viewOf(panel) {
    return /** @type {Panel} */ (this.frame.panels.find(({ name }) => name === panel)).view;
  }

  /** Takes the focus: where the reader is sent, and where what had it has gone. */
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

  /** The page's settings; what the reader brought along stays at hand. */
  get fresh() {
    return { ...this.initial, given: this.record.given };
  }

  /** Empties the log; where it is empty already, the settings go back to the page's. A dead worker is replaced. */
  reset() {
    const again = runtime.stopped && runtime.state === "failed";
    if (again) this.#state.clear();
    this.ask(records.reset(this.record.log.length ? this.record : this.fresh));
    if (again) runtime.restart();
  }

  /** The address of the figure in the state that is seen. */
  link() {
    const more = moreOf(this.root)?.open ? MORE : "";
    return location.href.split("#")[0] + fragmentOf(this.id, records.encode(this.shown)) + more;
  }
}
