// Pure functions that move a drawing's points rigidly and compare them.
/** @import { Point } from "../base/types.js" */

const DOTS = "path.dot";

/**
 * The positions of a path's dots: "M x y h1 m dx dy h1 …", each dot a line one unit long.
 * @param {string} path
 * @returns {Point[]}
 */
export function dots(path) {
  /** @type {Point[]} */
  const centres = [];
  let [x, y] = [0, 0];
  for (const [, letter, numbers] of path.matchAll(/([Mmh])([^Mmh]*)/g)) {
    const [a, b] = (numbers.match(/-?[\d.]+/g) ?? []).map(Number);
    if (letter === "h") {
      centres.push([x, y]);
      x += a;
    } else [x, y] = letter === "M" ? [a, b] : [x + a, y + b];
  }
  return centres;
}

/**
 * The dots of a group in their order.
 * @param {Element | null} group
 */
export function points(group) {
  return [...(group?.querySelectorAll(DOTS) ?? [])].flatMap((path) => dots(path.getAttribute("d") ?? ""));
}

/**
 * Points turned by `turn` degrees about a place, then shifted.
 * @type {(points: Point[], turn: number, about: Point, shift: Point) => Point[]}
 */
export function placed(points, turn, [a, b], [right, down]) {
  const angle = (turn * Math.PI) / 180;
  const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  return points.map(([x, y]) => [
    a + cos * (x - a) - sin * (y - b) + right,
    b + sin * (x - a) + cos * (y - b) + down,
  ]);
}

/**
 * The mean distance between corresponding points of two lists.
 * @type {(points: Point[], others: Point[]) => number}
 */
export function away(points, others) {
  const far = points.map(([x, y], i) => Math.hypot(x - others[i][0], y - others[i][1]));
  return far.reduce((sum, distance) => sum + distance, 0) / far.length;
}

/**
 * The points' centroid.
 * @type {(points: Point[]) => Point}
 */
export function mean(points) {
  const [x, y] = points.reduce(([a, b], [x, y]) => [a + x, b + y], [0, 0]);
  return [x / points.length, y / points.length];
}
