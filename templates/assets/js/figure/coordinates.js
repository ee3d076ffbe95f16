// From a pointer's position to a panel's world coordinates, and back to the panel.

/** @import { Point, View } from "../base/types.js" */

/** @typedef {{ left: number, top: number, width: number, height: number }} Rect  of a panel, on the screen */

/**
 * The direction of each arrow key in world coordinates.
 * @type {Record<string, Point>}
 */
export const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/**
 * A pointer's position in a panel's world coordinates.
 * @type {(rect: Rect, view: View, clientX: number, clientY: number) => Point}
 */
export function world(rect, view, clientX, clientY) {
  const [x0, x1, y0, y1, width, height, left, top, right, bottom] = view;
  const across = (((clientX - rect.left) / rect.width) * width - left) / (width - left - right);
  const down = (((clientY - rect.top) / rect.height) * height - top) / (height - top - bottom);
  return [x0 + across * (x1 - x0), y1 - down * (y1 - y0)];
}

/**
 * A world position in percent of the panel.
 * @type {(view: View, place: Point) => Point}
 */
export function percent(view, [x, y]) {
  const [x0, x1, y0, y1, width, height, left, top, right, bottom] = view;
  const across = left + ((x - x0) / (x1 - x0)) * (width - left - right);
  const down = top + ((y1 - y) / (y1 - y0)) * (height - top - bottom);
  return [(100 * across) / width, (100 * down) / height];
}
