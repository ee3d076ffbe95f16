// Dragging a handle: the handle follows the pointer at once, and the picture as fast as Python answers.
/** @import { FigureRecord, Handle, Point } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, on } from "../base/dom.js";
import * as records from "../base/record.js";
import { percent, world } from "./coordinates.js";
import { hold } from "./hold.js";

/**
 * handles: { of(name) → the frame's handle, own(name) → its button, update() }.
 * Returns { held: the button being dragged or null }.
 * @param {Figure} figure
 * @param {Overlay} overlay
 * @param {{ of: (name: string) => Handle | undefined, own: (name: string) => HTMLElement | undefined, update: () => void }} handles
 */
export function addDrags(figure, overlay, handles) {
  const { root } = figure;
  /**
   * before: the record to restore on cancel. grip: px from the handle's centre to the pointer. to: a place not yet
   * asked for. at: the time of its event. ahead: the animation frame that will ask.
   * @typedef {{ button: HTMLElement, name: string, panel: string, before: FigureRecord,
   *   grip: [number, number], to: Point | null, at: number, ahead: number }} Drag
   */

  /** @param {PointerEvent} event @returns {Drag | null} */
  function begin(event) {
    const button = around(event, ".handle");
    if (!button) return null;
    overlay.measure();
    const box = button.getBoundingClientRect();
    /** @type {[number, number]} */
    const grip = [event.clientX - (box.left + box.right) / 2, event.clientY - (box.top + box.bottom) / 2];
    const { handle: name = "", panel = "" } = button.dataset;
    handles.own(name)?.focus({ preventScroll: true }); // a copy in another panel cannot take it
    root.classList.add("dragging");
    return { button, name, panel, before: figure.record, grip, to: null, at: 0, ahead: 0 };
  }

  /** @param {Drag} drag @param {PointerEvent} event */
  function follow(drag, event) {
    const { name, panel, grip } = drag;
    const handle = handles.of(name);
    if (!handle) return;
    const view = figure.viewOf(panel);
    const to = world(overlay.rect(panel), view, event.clientX - grip[0], event.clientY - grip[1]);
    drag.to = records.reached(handle, to, figure.spec.controls);
    overlay.put(drag.button, panel, ...percent(view, drag.to));
    drag.at = event.timeStamp;
    if (!drag.ahead) askAhead(drag);
  }

  /** @param {Drag} drag */
  function ask({ name, to, at }) {
    const handle = handles.of(name);
    if (!handle || !to) return;
    const record = records.put(figure.record, handle, to, figure.spec.controls);
    if (record !== figure.record) figure.ask(record, { merge: `drag:${name}`, at });
  }

  /**
   * Asks at most once per animation frame: for the first place at once, for the last one when the frame comes.
   * @param {Drag} drag
   */
  function askAhead(drag) {
    if (!drag.to) return;
    ask(drag);
    drag.to = null;
    drag.ahead = requestAnimationFrame(() => {
      drag.ahead = 0;
      askAhead(drag);
    });
  }

  /** @param {Drag} drag */
  function letGo(drag) {
    cancelAnimationFrame(drag.ahead);
    root.classList.remove("dragging");
  }

  /**
   * Ends a drag: the handle snaps to its place in the frame, unless a frame is still to come.
   * @param {Drag} drag
   */
  function end(drag) {
    letGo(drag);
    ask(drag);
    if (!figure.busy) handles.update();
  }

  /** @param {Drag} drag */
  function cancel(drag) {
    letGo(drag);
    figure.ask(drag.before);
  }

  on(overlay.layer, "mousedown", (event) => {
    if (around(event, ".copy")) event.preventDefault(); // the focus is where `begin` put it
  });
  // pointerrawupdate fires at once, so that Python's answer is there before the frame that pointermove waits for.
  const moves = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
  const pointer = hold(overlay.layer, root, { begin, follow, end, cancel }, moves);
  return {
    get held() {
      return pointer.held?.button ?? null;
    },
  };
}
