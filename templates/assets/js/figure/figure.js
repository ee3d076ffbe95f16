// One figure's controller: holds its record, asks for frames, swaps them in. The parts (handles, controls, buttons …)
// listen to its events: "asked" (a new record is wanted), "frame" (one is shown), "state" (anything the status tells).
import { emitter } from "../base/emitter.js";
import { limits, mark } from "../base/limits.js";
import * as records from "../base/record.js";
import { startMotion } from "./motion.js";
import { swapPanels } from "./panels.js";
import { runtime } from "../runtime/runtime.js";
import { onTape, taped } from "../runtime/tape.js";

/**
 * @typedef {{name: string, svg: string, view: number[]}} PanelFrame
 * @typedef {{panels: PanelFrame[], readouts: Object[], handles: Object[], description: string, note: string,
 *   disabled: string[], motion: ?Object, controls: Object, python: string, detail: number}} Frame
 * @typedef {{record: Object, merge: ?string}} Question
 */

export class Figure {
  constructor(root) {
    const { record, frame, spec } = JSON.parse(root.querySelector("script.figure-record").textContent);
    this.root = root;
    this.id = root.id;
    this.spec = spec;
    this.stage = root.querySelector(".figure-stage");
    /** what the reader wants to see, what the page was built with, and what is seen */
    this.record = this.initial = this.shown = record;
    this.frame = frame;
    this.visible = false;
    this.warmed = false;
    /** Python has drawn it: the next touch pays for no import */
    this.ready = false;
    /** why the last question has no answer, in words; cleared by the next answer */
    this.error = "";
    this.kept = "static";
    /** @type {Question[]} not yet asked; while Python is not up, the latest only */
    this.waiting = [];
    /** @type {?Question} being drawn */
    this.asked = null;
    /** what the question that is being drawn is at, where that takes long: { replayed, of } or { reads } */
    this.replay = null;
    this.moving = null;
    /** the record whose next finer drawing is on its way, and the timer that will ask for it */
    this.finer = null;
    this.rest = 0;
    this.speaks = false;
    this.disposers = [];
    Object.assign(this, emitter());
    this.disposers.push(runtime.on("change", () => this.runtimeChanged()), onTape(this.id, () => this.tapeArrived()));
    this.tell();
  }

  /** Whether something is asked, waiting, moving or being made finer. */
  get busy() {
    return Boolean(this.asked || this.waiting.length || this.moving || this.finer);
  }

  get state() {
    if (this.error || (this.waiting.length && runtime.state === "failed")) return "failed";
    return this.waiting.length && runtime.state !== "live" ? "waiting" : this.kept;
  }

  /**
   * Wants the figure to show `record`. Questions with the same `merge` that still wait become the latest one; without
   * it they are answered one by one, in order. `by` names who asks, for those who step aside when others do.
   */
  ask(record, { merge = null, by = "", at } = {}) {
    mark("ladder:input", this.id, at);
    this.coarse();
    this.error = "";
    this.speaks ||= by !== "hover" && by !== "run";
    const frame = runtime.state === "live" ? undefined : taped(this.id, record);
    if (!frame && runtime.state === "file") {
      this.refuse("This state is not on the figure's tape, and a page opened from disk has no Python.");
      return;
    }
    this.record = record;
    this.emit("asked", by);
    if (frame) {
      this.waiting = [];
      this.show(record, frame, "tape");
      return;
    }
    const question = { record, merge };
    if (runtime.state !== "live") this.waiting = [question];
    else if (merge && this.waiting.at(-1)?.merge === merge) this.waiting[this.waiting.length - 1] = question;
    else this.waiting.push(question);
    runtime.start();
    this.pump();
    this.tell();
  }

  /** Hands the oldest waiting question on, unless one is being drawn. */
  pump() {
    if (this.asked || !this.waiting.length || runtime.state !== "live") return;
    const question = (this.asked = this.waiting.shift());
    const left = () => this.asked !== question;
    const detail = this.spec.details > 1 ? 0 : undefined;
    const began = performance.now();
    /** A long replay that something newer waits for makes way: the newer record holds what was done meanwhile, too. */
    const going = (replay) => {
      if (left()) return false;
      this.replay = replay;
      this.tell();
      return !this.waiting.length || performance.now() < began + limits.slow;
    };
    runtime.frame({ figure: this.id, record: question.record, detail, going }).then(
      (frame) => {
        if (left()) return;
        this.asked = this.replay = null;
        this.pump(); // Python draws the next while the page swaps this one in
        this.show(question.record, frame, "live");
        this.refine(limits.rest);
      },
      (error) => {
        if (left()) return;
        this.asked = null;
        if (error.stopped) this.waiting = [{ record: this.record, merge: null }];
        else this.refuse(`This state cannot be drawn: ${error.message.replace(/^ValueError: /, "")}.`);
        this.pump();
        if (!this.asked) this.replay = null;
        this.tell();
      },
    );
  }

  /** Leaves the picture as coarse as it is. */
  coarse() {
    clearTimeout(this.rest);
    this.finer = null;
  }

  /** The next finer drawing of what is seen, `rest` ms from now; then the next, unless something else is asked. */
  refine(rest) {
    this.coarse();
    const { shown, frame } = this;
    if (this.asked || this.waiting.length || !(frame.detail + 1 < this.spec.details)) return;
    const finer = (this.finer = { record: shown });
    this.rest = setTimeout(() => {
      if (this.moving) return this.refine(rest);
      const stale = () => this.finer !== finer;
      runtime.frame({ figure: this.id, record: shown, detail: frame.detail + 1, finer: true }).then(
        (better) => {
          if (stale()) return;
          this.show(shown, better, "live");
          this.refine(0);
          this.tell();
        },
        (error) => {
          if (stale()) return;
          this.coarse();
          if (!error.stopped) this.refuse(`This cannot be drawn finer: ${error.message}.`);
          this.tell();
        },
      );
    }, rest);
  }

  /** Keeps the last picture and takes back what led away from it. */
  refuse(message) {
    this.error = message;
    this.leave();
  }

  /** Gives up what is being drawn and what waits: the figure is what is seen of it. */
  leave() {
    this.asked = this.replay = null;
    this.waiting = [];
    this.record = this.shown;
    this.emit("asked", "");
    this.emit("frame", this.frame);
    this.tell();
  }

  show(record, frame, kept) {
    const motion = records.pressed(this.shown, record) ? frame.motion : null;
    this.moving?.end();
    this.shown = record;
    this.frame = frame;
    this.kept = kept;
    this.error = "";
    if (kept === "live") this.warmed = this.ready = true;
    swapPanels(this.stage, frame.panels);
    this.root.dataset.frame = Number(this.root.dataset.frame ?? 0) + 1;
    mark(this.finer ? "ladder:finer" : "ladder:swap", this.id);
    if (motion) startMotion(this, motion);
    this.emit("frame", frame);
    this.tell();
  }

  tell() {
    this.root.dataset.state = this.state;
    this.emit("state");
  }

  /** Has what is seen said to those who hear it: what is asked in passing or by a run is not, without this. */
  speak() {
    this.speaks = true;
    this.tell();
  }

  /** Takes the focus: where the reader is sent, and where what had it has gone. */
  focus() {
    this.stage.tabIndex = -1;
    this.stage.focus({ preventScroll: true });
  }

  /**
   * Has what is seen drawn once, unseen, when Python is up and has nothing better to do: modules are imported and the
   * state is known when the reader's first touch comes.
   */
  warm() {
    if (this.warmed || runtime.state !== "live" || !this.visible || this.asked || this.waiting.length) return;
    this.warmed = true;
    const detail = this.spec.details > 1 ? 0 : undefined;
    const drawn = runtime.frame({ figure: this.id, record: this.shown, detail, finer: true }).catch(() => {});
    drawn.finally(() => (this.ready = true));
  }

  runtimeChanged() {
    this.pump();
    this.warm();
    if (runtime.state === "live" && !this.finer) this.refine(0);
    this.tell();
  }

  tapeArrived() {
    if (runtime.state === "live" || !this.waiting.length) return;
    const frame = taped(this.id, this.record);
    if (!frame) return;
    this.waiting = [];
    this.show(this.record, frame, "tape");
  }

  /** The page's settings; what the reader brought along stays at hand. */
  get fresh() {
    return { ...this.initial, given: this.record.given };
  }

  /** Empties the log; where it is empty already, the settings go back to the page's. A dead worker is replaced. */
  reset() {
    const again = runtime.stopped && runtime.state === "failed";
    if (again) this.waiting = [];
    this.ask(records.reset(this.record.log.length ? this.record : this.fresh));
    if (again) runtime.restart();
  }

  /** The address of the figure in the state that is seen. */
  link() {
    return `${location.href.split("#")[0]}#${this.id}?s=${records.encode(this.shown)}`;
  }

  dispose() {
    this.coarse();
    this.moving?.end();
    for (const dispose of this.disposers.splice(0)) dispose();
  }
}
