// Motions from the old pose to the new: Python gives the end poses and the motion that led there, the page moves the
// groups. And traces, whose lines the page draws progressively from their starts.

/** @import { Dispose, Motion, Move } from "../base/types.js" */

import { calm, on } from "../base/dom.js";
import { limits } from "../base/limits.js";

/** @param {number} part */
const ease = (part) => 1 - (1 - part) ** 3;

/**
 * A function that draws a part of a group's lines; its other marks are hidden until the lines are whole.
 * @param {SVGElement} group
 * @returns {(remaining: number) => void}
 */
function tracer(group) {
  const marks = /** @type {SVGPathElement[]} */ ([...group.querySelectorAll("path, text")]);
  const scale = Math.abs(marks[0]?.getScreenCTM()?.a ?? 1); // dashes are in px, like the lines' widths
  const lengths = marks.map((mark) => mark.classList.contains("line") && scale * mark.getTotalLength());
  return (remaining) => {
    for (const [index, length] of lengths.entries()) {
      const { style } = marks[index];
      if (length === false) style.visibility = "hidden";
      else style.strokeDasharray = `${(1 - remaining) * length} ${length + 1}`;
    }
  };
}

/**
 * A function that places a group on its way.
 * @param {SVGElement} group
 * @param {Move} motion
 * @returns {(remaining: number) => void}  from 1 at the start to 0 at the end
 */
const mover = (group, { turn, about, shift }) => (remaining) => {
  const [x, y] = shift.map((value) => -value * remaining);
  group.setAttribute("transform", `rotate(${-turn * remaining} ${about.join(" ")}) translate(${x} ${y})`);
};

/** @param {SVGElement} group  restored to the way it was drawn */
function leave(group) {
  group.removeAttribute("transform");
  group.ownerSVGElement?.classList.remove("moving");
  for (const mark of group.querySelectorAll("[style]")) mark.removeAttribute("style");
}

/**
 * Starts each group at the inverse of its motion, or its lines at their starts, and moves it to where it is drawn;
 * calls `over` at the end. Returns a function that ends the motions early; null if nothing moves.
 * @param {Motion[]} motions
 * @param {number} began  when, by performance.now(): a finer drawing continues a coarser one's motion
 * @param {number} length  in ms; lines take three times as long
 * @param {() => void} over
 * @returns {Dispose | null}
 */
export function startMotions(motions, began, length, over) {
  const groups = motions.flatMap((motion) => {
    const group = /** @type {SVGElement | null} */ (/** @type {unknown} */ (document.getElementById(motion.group)));
    if (!group) return [];
    const slow = "trace" in motion;
    return { group, whole: slow ? 3 * length : length, place: slow ? tracer(group) : mover(group, motion) };
  });
  const begins = performance.now();
  const longest = Math.max(...groups.map(({ whole }) => whole));
  if (calm() || !(begins < began + longest)) return null;
  let request = 0;
  const paper = on(globalThis, "beforeprint", finish); // its numbers are those of the end

  function end() {
    paper();
    cancelAnimationFrame(request);
    for (const { group } of groups) leave(group);
  }

  function finish() {
    end();
    over();
  }

  /** @param {number} now */
  function draw(now) {
    if (now >= began + longest) return finish();
    for (const { whole, place } of groups) place(1 - ease(Math.min(1, Math.max(0, (now - began) / whole))));
    request = requestAnimationFrame(() => draw(performance.now())); // the callback's timestamp may precede the start
  }

  for (const { group } of groups) group.ownerSVGElement?.classList.add("moving");
  draw(begins);
  return end;
}

/**
 * The length of a motion in ms; in a run no longer than the time between presses.
 * @param {boolean} running
 */
export const motionLength = (running) => (running ? Math.min(limits.run, limits.motion) : limits.motion);
