// Dragging a handle: the handle follows the pointer at once, the picture as fast as Python answers.
/** @import { FigureRecord, Handle, Point } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, on } from "../base/dom.js";
import * as records from "../base/record.js";
import { percent, world } from "./coordinates.js";

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
   * before: the record to go back to. grip: px from the handle's place to the pointer. to: a place not yet asked for. at:
   * when it came. ahead: the animation frame that will ask.
   * @typedef {{ pointer: number, button: HTMLElement, name: string, panel: string, before: FigureRecord,
   *   grip: [number, number], to: Point | null, at: number, ahead: number }} Drag
   */
  /** @type {Drag | null} */
  let drag = null;

  /** @param {PointerEvent} event */
  function take(event) {
    const button = around(event, ".handle");
    if (!button || drag || event.button !== 0) return;
    overlay.measure();
    const box = button.getBoundingClientRect();
    /** @type {[number, number]} */
    const grip = [event.clientX - (box.left + box.right) / 2, event.clientY - (box.top + box.bottom) / 2];
    const { pointerId: pointer } = event;
    const { handle: name = "", panel = "" } = button.dataset;
    drag = { pointer, button, name, panel, before: figure.record, grip, to: null, at: 0, ahead: 0 };
    try {
      root.setPointerCapture(pointer);
    } catch {
      // the pointer is gone already, or never was (a synthetic event)
    }
    handles.own(name)?.focus({ preventScroll: true }); // which a copy in another panel is not
    root.classList.add("dragging");
  }

  /** @param {PointerEvent} event */
  function follow(event) {
    if (!drag || event.pointerId !== drag.pointer) return;
    const { name, panel, grip } = drag;
    if (!handles.of(name)) return;
    const view = figure.viewOf(panel);
    drag.to = world(overlay.rect(panel), view, event.clientX - grip[0], event.clientY - grip[1]);
    overlay.put(drag.button, panel, ...percent(view, drag.to));
    drag.at = event.timeStamp;
    if (!drag.ahead) ahead();
  }

  /** @param {Drag} drag */
  function ask({ name, to, at }) {
    if (to) figure.ask(records.drag(figure.record, name, to), { merge: `drag:${name}`, at });
  }

  /** At most one question an animation frame: the first place at once, the last one of the frame at its end. */
  function ahead() {
    if (!drag?.to) return;
    const held = drag;
    ask(held);
    held.to = null;
    held.ahead = requestAnimationFrame(() => {
      held.ahead = 0;
      if (drag === held) ahead();
    });
  }

  /** @param {Drag} held */
  function end(held) {
    cancelAnimationFrame(held.ahead);
    drag = null;
    root.classList.remove("dragging");
  }

  /**
   * Lets go: the handle goes to where the frame has it, unless the place it was put at still waits for its frame.
   * @param {PointerEvent} event
   */
  function release(event) {
    if (!drag || event.pointerId !== drag.pointer) return;
    const held = drag;
    end(held);
    if (held.to) ask(held);
    if (!figure.busy) handles.update();
  }

  /**
   * Escape: everything as it was before.
   * @param {KeyboardEvent} event
   */
  function cancel(event) {
    if (!drag || event.key !== "Escape") return;
    event.preventDefault();
    const { before, pointer } = drag;
    end(drag);
    if (root.hasPointerCapture(pointer)) root.releasePointerCapture(pointer);
    figure.ask(before);
    if (!figure.busy) handles.update();
  }

  on(overlay.layer, "pointerdown", take);
  on(overlay.layer, "mousedown", (event) => {
    if (around(event, ".copy")) event.preventDefault(); // the focus is where `take` put it
  });
  // Where the browser tells a move as it comes, Python's answer is there before the frame that pointermove waits for.
  on(root, "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove", follow);
  on(root, "pointerup", release);
  on(root, "pointercancel", release);
  on(root, "lostpointercapture", release);
  on(root, "keydown", cancel);
  return {
    get held() {
      return drag?.button ?? null;
    },
  };
}
