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
  /** @type {{ pointer: number, thing: T } | null} */
  let grip = null;

  /** @param {PointerEvent} event */
  function press(event) {
    const thing = grip || event.button !== 0 ? null : begin(event);
    if (thing === null) return;
    grip = { pointer: event.pointerId, thing };
    try {
      captor.setPointerCapture(event.pointerId);
    } catch {
      // the pointer is gone already, or never was (a synthetic event)
    }
  }

  /** @param {PointerEvent} event */
  function move(event) {
    if (grip?.pointer !== event.pointerId) return;
    const isReleased = event.pointerType !== "touch" && !event.buttons; // released while another page was in front
    if (isReleased) release(event);
    else follow(grip.thing, event);
  }

  /** @param {PointerEvent} event */
  function release(event) {
    if (grip?.pointer !== event.pointerId) return;
    const { thing } = grip;
    grip = null;
    end(thing, event);
  }

  /** @param {KeyboardEvent} event */
  function key(event) {
    if (!grip || event.key !== "Escape") return;
    event.preventDefault();
    const { pointer, thing } = grip;
    grip = null;
    if (captor.hasPointerCapture(pointer)) captor.releasePointerCapture(pointer);
    cancel(thing);
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
      return grip?.thing ?? null;
    },
    dispose() {
      for (const end of ends) end();
    },
  };
}
