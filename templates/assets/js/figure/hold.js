// One pointer holds something from press to release. Other pointers are ignored meanwhile; Escape cancels.
import { on } from "../base/dom.js";

/**
 * Handlers of a press, a move and a release. begin: returns the held thing, or null to ignore the press. end: after a
 * release, or when the browser takes the pointer away (`pointercancel`). cancel: restores everything.
 * @template T
 * @typedef {{
 *   begin: (event: PointerEvent) => T | null,
 *   follow: (held: T, event: PointerEvent) => void,
 *   end: (held: T, event: PointerEvent) => void,
 *   cancel: (held: T) => void,
 * }} Does
 */

/**
 * @template T
 * @param {HTMLElement} area  where a press counts
 * @param {HTMLElement} captor  captures the pointer: `area` or an element around it
 * @param {Does<T>} does
 * @param {string} [moves]  the event type for moves
 */
export function hold(area, captor, { begin, follow, end, cancel }, moves = "pointermove") {
  /** @type {{ pointer: number, what: T } | null} */
  let held = null;

  /** @param {PointerEvent} event */
  function press(event) {
    const what = held || event.button !== 0 ? null : begin(event);
    if (what === null) return;
    held = { pointer: event.pointerId, what };
    try {
      captor.setPointerCapture(event.pointerId);
    } catch {
      // the pointer is gone already, or never was (a synthetic event)
    }
  }

  /** @param {PointerEvent} event */
  function move(event) {
    if (held?.pointer !== event.pointerId) return;
    const gone = event.pointerType !== "touch" && !event.buttons; // released while another page was in front
    if (gone) release(event);
    else follow(held.what, event);
  }

  /** @param {PointerEvent} event */
  function release(event) {
    if (held?.pointer !== event.pointerId) return;
    const { what } = held;
    held = null;
    end(what, event);
  }

  /** @param {KeyboardEvent} event */
  function key(event) {
    if (!held || event.key !== "Escape") return;
    event.preventDefault();
    const { pointer, what } = held;
    held = null;
    if (captor.hasPointerCapture(pointer)) captor.releasePointerCapture(pointer);
    cancel(what);
  }

  const ends = [
    on(area, "pointerdown", press),
    on(captor, moves, move),
    on(captor, "pointerup", release),
    on(captor, "pointercancel", release),
    on(captor, "lostpointercapture", release),
    on(document, "keydown", key, { capture: true }), // the focus may be anywhere; comes before cards and decks
  ];
  return {
    get held() {
      return held?.what ?? null;
    },
    dispose() {
      for (const end of ends) end();
    },
  };
}
