// Dragging a handle: the handle follows the pointer at once, the picture as fast as Python answers.
import { on } from "../base/dom.js";
import * as records from "../base/record.js";
import { percent, world } from "./coordinates.js";

/**
 * handles: { of(name) → the frame's handle, own(name) → its button, update() }.
 * Returns { held: the button being dragged or null, dispose }.
 */
export function addDrags(figure, overlay, handles) {
  const { root } = figure;
  // pointer, button, name and panel of the handle, before: the record to go back to, grip: px from the handle's place to the pointer,
  // to: a place not yet asked for, at: when it came, ahead: the animation frame that will ask
  let drag = null;

  function take(event) {
    const button = event.target.closest(".handle");
    if (!button || drag || event.button !== 0) return;
    overlay.measure();
    const box = button.getBoundingClientRect();
    const grip = [event.clientX - (box.left + box.right) / 2, event.clientY - (box.top + box.bottom) / 2];
    const { pointerId: pointer } = event;
    const { handle: name, panel } = button.dataset;
    drag = { pointer, button, name, panel, before: figure.record, grip, to: null, at: 0, ahead: 0 };
    try {
      root.setPointerCapture(pointer);
    } catch {
      // the pointer is gone already, or never was (a synthetic event)
    }
    handles.own(name)?.focus({ preventScroll: true }); // which a copy in another panel is not
    root.classList.add("dragging");
  }

  function follow(event) {
    if (event.pointerId !== drag?.pointer) return;
    const { name, panel, grip } = drag;
    if (!handles.of(name)) return;
    const { view } = figure.frame.panels.find((each) => each.name === panel);
    drag.to = world(overlay.rect(panel), view, event.clientX - grip[0], event.clientY - grip[1]);
    overlay.put(drag.button, panel, ...percent(view, drag.to));
    drag.at = event.timeStamp;
    if (!drag.ahead) ahead();
  }

  const ask = ({ name, to, at }) =>
    figure.ask(records.drag(figure.record, name, to), { merge: `drag:${name}`, at });

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

  function end() {
    const held = drag;
    cancelAnimationFrame(held.ahead);
    drag = null;
    root.classList.remove("dragging");
    return held;
  }

  /** Lets go: the handle goes to where the frame has it, unless the place it was put at still waits for its frame. */
  function release(event) {
    if (event.pointerId !== drag?.pointer) return;
    const held = end();
    if (held.to) ask(held);
    if (!figure.busy) handles.update();
  }

  /** Escape: everything as it was before. */
  function cancel(event) {
    if (!drag || event.key !== "Escape") return;
    event.preventDefault();
    const { before, pointer } = end();
    if (root.hasPointerCapture(pointer)) root.releasePointerCapture(pointer);
    figure.ask(before);
    if (!figure.busy) handles.update();
  }

  const disposers = [
    on(overlay.layer, "pointerdown", take),
    on(overlay.layer, "mousedown", (event) => {
      if (event.target.closest(".copy")) event.preventDefault(); // the focus is where `take` put it
    }),
    // Where the browser tells a move as it comes, Python's answer is there before the frame that pointermove waits for.
    on(root, "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove", follow),
    on(root, "pointerup", release),
    on(root, "pointercancel", release),
    on(root, "lostpointercapture", release),
    on(root, "keydown", cancel),
  ];
  return {
    get held() {
      return drag?.button ?? null;
    },
    dispose: () => disposers.forEach((dispose) => dispose()),
  };
}
