// Points of a drawing, moved as a whole and compared.

import assert from "node:assert/strict";
import { test } from "node:test";

import { away, dots, mean, placed } from "../../templates/assets/js/figure/rigid.js";

const near = (found, wanted) =>
  found.forEach((each, i) => each.forEach((value, k) => assert.ok(Math.abs(value - wanted[i][k]) < 1e-9, `${found}`)));

test("dots are read where they begin, however they are written", () => {
  assert.deepEqual(dots("M10 20h1m97 -22h1m-3 4h1"), [[10, 20], [108, -2], [106, 2]]);
  assert.deepEqual(dots("M1.5-2h1M7 8h1"), [[1.5, -2], [7, 8]]);
  assert.deepEqual(dots(""), []);
});

test("a quarter turn about a place, then a move", () => {
  near(placed([[2, 1], [1, 1]], 90, [1, 1], [10, -5]), [[11, -3], [11, -4]]);
  near(placed([[3, 4]], 0, [9, 9], [0, 0]), [[3, 4]]);
});

test("a turn there and back changes nothing", () => {
  const points = [[3, 4], [-1, 2], [0, 7]];
  near(placed(placed(points, 37, [1, 2], [3, -4]), -37, [4, -2], [-3, 4]), points);
});

test("how far points are from their own, on average", () => {
  assert.equal(away([[0, 0], [1, 1]], [[3, 4], [1, 1]]), 2.5);
  assert.deepEqual(mean([[0, 0], [2, 6]]), [1, 3]);
});
