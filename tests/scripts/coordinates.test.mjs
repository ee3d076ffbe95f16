// From a pointer's place to the world, and from the world to a place in the panel.

import assert from "node:assert/strict";
import { test } from "node:test";

import { percent, world } from "../../templates/assets/js/figure/coordinates.js";

// A window of 4 by 2 in a panel of 200 by 100 nominal px, 20 px free at the left and 10 below.
const VIEW = [-2, 2, -1, 1, 200, 100, 20, 0, 0, 10];
const RECT = { left: 300, top: 50, width: 400, height: 200 }; // drawn twice as large

const near = (found, wanted) => found.forEach((value, i) => assert.ok(Math.abs(value - wanted[i]) < 1e-9, `${found}`));

test("the window's corners lie where the panel has them", () => {
  near(world(RECT, VIEW, 340, 230), [-2, -1]);
  near(world(RECT, VIEW, 700, 50), [2, 1]);
  near(percent(VIEW, [-2, -1]), [10, 90]);
  near(percent(VIEW, [2, 1]), [100, 0]);
});

test("up in the world is up on the screen", () => {
  assert.ok(percent(VIEW, [0, 0.5])[1] < percent(VIEW, [0, -0.5])[1]);
});

test("a place comes back from the screen as it was", () => {
  for (const place of [[0, 0], [1.25, -0.75], [-3, 4]]) {
    const [left, top] = percent(VIEW, place);
    const x = RECT.left + (left / 100) * RECT.width;
    near(world(RECT, VIEW, x, RECT.top + (top / 100) * RECT.height), place);
  }
});
