// One pointer that holds something, from its press to its release. Other pointers do nothing meanwhile; Escape takes it back.
import { on } from "../base/dom.js";

/**
 * What a press, a move and a release do. begin: what is held from now on; null where the press is not for it. end: let go,
 * or taken away by the browser (`pointercancel`). cancel: everything as it was before.
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
 * @param {HTMLElement} captor  what the pointer's events go to, wherever it is: around `area`, or that itself
 * @param {Does<T>} does
 * @param {string} [moves]  the event that tells of a move
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
    const gone = event.pointerType !== "touch" && !event.buttons; // let go while another page was seen
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
    on(document, "keydown", key, { capture: true }), // the focus may be anywhere; a card or a deck hears of it later
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
