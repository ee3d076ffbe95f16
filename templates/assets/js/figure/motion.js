// Motions from the old place to the new: Python gives the end poses and how they came about, the page moves the groups;
// and traces, whose lines it draws from their beginnings.

/** @import { Dispose, Motion, Move } from "../base/types.js" */

import { calm } from "../base/dom.js";
import { limits } from "../base/limits.js";

/** @param {number} part */
const ease = (part) => 1 - (1 - part) ** 3;

/**
 * What draws a group's lines so far, its other marks unseen until the lines are whole.
 * @param {SVGElement} group
 * @returns {(left: number) => void}
 */
function tracer(group) {
  const all = /** @type {SVGPathElement[]} */ ([...group.querySelectorAll("path, text")]);
  const scale = Math.abs(all[0]?.getScreenCTM()?.a ?? 1); // dashes are in px, as the lines' widths are
  const lengths = all.map((mark) => mark.classList.contains("line") && scale * mark.getTotalLength());
  return (left) => {
    for (const [index, length] of lengths.entries()) {
      const { style } = all[index];
      if (length === false) style.visibility = "hidden";
      else style.strokeDasharray = `${(1 - left) * length} ${length + 1}`;
    }
  };
}

/**
 * What puts a group where it is on its way.
 * @param {SVGElement} group
 * @param {Move} motion
 * @returns {(left: number) => void}  from 1, before it has begun, to 0
 */
const mover = (group, { turn, about, shift }) => (left) => {
  const [x, y] = shift.map((value) => -value * left);
  group.setAttribute("transform", `rotate(${-turn * left} ${about.join(" ")}) translate(${x} ${y})`);
};

/** @param {SVGElement} group  it is where it is drawn, and as it is drawn */
function leave(group) {
  group.removeAttribute("transform");
  group.ownerSVGElement?.classList.remove("moving");
  for (const mark of group.querySelectorAll("[style]")) mark.removeAttribute("style");
}

/**
 * Starts each group at the inverse of its motion, or its lines at their beginnings, and lets it go to where it is
 * drawn; `over` is called when they are there. Returns what ends it before; null where nothing moves.
 * @param {Motion[]} motions
 * @param {number} began  when, as performance.now() tells it: a finer drawing goes on where a coarser one was
 * @param {number} length  in ms; lines take three times as long
 * @param {() => void} over
 * @returns {Dispose | null}
 */
export function startMotions(motions, began, length, over) {
  const groups = motions.flatMap((motion) => {
    const moved = /** @type {SVGElement | null} */ (/** @type {unknown} */ (document.getElementById(motion.group)));
    if (!moved) return [];
    const slow = "trace" in motion;
    return { moved, whole: slow ? 3 * length : length, place: slow ? tracer(moved) : mover(moved, motion) };
  });
  const begins = performance.now();
  const longest = Math.max(...groups.map(({ whole }) => whole));
  if (calm() || !(begins < began + longest)) return null;
  let request = 0;

  function end() {
    cancelAnimationFrame(request);
    for (const { moved } of groups) leave(moved);
  }

  /** @param {number} now */
  function draw(now) {
    if (now >= began + longest) {
      end();
      over();
      return;
    }
    for (const { whole, place } of groups) place(1 - ease(Math.min(1, Math.max(0, (now - began) / whole))));
    request = requestAnimationFrame(() => draw(performance.now())); // a frame's own time may lie before the start
  }

  for (const { moved } of groups) moved.ownerSVGElement?.classList.add("moving");
  draw(begins);
  return end;
}

/**
 * How long a motion takes, in ms; in a run no longer than from press to press.
 * @param {boolean} running
 */
export const motionLength = (running) => (running ? Math.min(limits.run, limits.motion) : limits.motion);
