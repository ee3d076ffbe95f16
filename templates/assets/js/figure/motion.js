// A motion from the old place to the new: Python gives the end pose and how it came about, the page moves the group.

/** @import { Dispose, Motion } from "../base/types.js" */

import { calm } from "../base/dom.js";
import { limits } from "../base/limits.js";

/** @param {number} part */
const ease = (part) => 1 - (1 - part) ** 3;

/**
 * Starts the group at the inverse of the motion and lets it go to where it is drawn; `over` is called when it is there.
 * Returns what ends it before; null where nothing moves.
 * @param {Motion} motion
 * @param {number} length  in ms
 * @param {() => void} over
 * @returns {Dispose | null}
 */
export function startMotion({ group, turn, about, shift }, length, over) {
  const moved = document.getElementById(group);
  if (calm() || !moved) return null;
  const drawing = /** @type {SVGElement} */ (/** @type {unknown} */ (moved)).ownerSVGElement;
  const began = performance.now();
  let request = 0;

  function end() {
    cancelAnimationFrame(request);
    moved?.removeAttribute("transform");
    drawing?.classList.remove("moving");
  }

  /** @param {number} now */
  function draw(now) {
    const part = Math.min(1, Math.max(0, (now - began) / length));
    if (part === 1) {
      end();
      over();
      return;
    }
    const left = 1 - ease(part);
    const [x, y] = shift.map((value) => -value * left);
    moved?.setAttribute("transform", `rotate(${-turn * left} ${about.join(" ")}) translate(${x} ${y})`);
    request = requestAnimationFrame(draw);
  }

  drawing?.classList.add("moving");
  draw(began);
  return end;
}

/**
 * How long a motion takes, in ms; in a run no longer than from press to press.
 * @param {boolean} running
 */
export const motionLength = (running) => (running ? Math.min(limits.run, limits.motion) : limits.motion);
