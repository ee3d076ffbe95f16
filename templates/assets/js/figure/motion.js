// Motions from the old place to the new: Python gives the end poses and how they came about, the page moves the groups.

/** @import { Dispose, Motion } from "../base/types.js" */

import { calm } from "../base/dom.js";
import { limits } from "../base/limits.js";

/** @param {number} part */
const ease = (part) => 1 - (1 - part) ** 3;

/**
 * Starts each group at the inverse of its motion and lets it go to where it is drawn; `over` is called when they are
 * there. Returns what ends it before; null where nothing moves.
 * @param {Motion[]} motions
 * @param {number} length  in ms
 * @param {() => void} over
 * @returns {Dispose | null}
 */
export function startMotions(motions, length, over) {
  const groups = motions.flatMap((motion) => {
    const moved = /** @type {SVGElement | null} */ (/** @type {unknown} */ (document.getElementById(motion.group)));
    return moved ? { ...motion, moved } : [];
  });
  if (calm() || !groups.length) return null;
  const began = performance.now();
  let request = 0;

  function end() {
    cancelAnimationFrame(request);
    for (const { moved } of groups) {
      moved.removeAttribute("transform");
      moved.ownerSVGElement?.classList.remove("moving");
    }
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
    for (const { moved, turn, about, shift } of groups) {
      const [x, y] = shift.map((value) => -value * left);
      moved.setAttribute("transform", `rotate(${-turn * left} ${about.join(" ")}) translate(${x} ${y})`);
    }
    request = requestAnimationFrame(draw);
  }

  for (const { moved } of groups) moved.ownerSVGElement?.classList.add("moving");
  draw(began);
  return end;
}

/**
 * How long a motion takes, in ms; in a run no longer than from press to press.
 * @param {boolean} running
 */
export const motionLength = (running) => (running ? Math.min(limits.run, limits.motion) : limits.motion);
