// What turns one drawing into another: attributes and words if that is enough, otherwise null.

import assert from "node:assert/strict";
import { test } from "node:test";

import { changes, tagsOf } from "../../templates/assets/js/figure/marks.js";

const drawn = (d, words, inside = "") =>
  `<svg class="panel" aria-label="A scene"><path class="dot s" d="${d}"/>` +
  `<g id="f-main-body" class="group"><text class="label ink" x="3" y="4">${words}</text>${inside}</g></svg>`;
const between = (one, other) => changes(tagsOf(one), tagsOf(other));

test("equal drawings differ in nothing", () => {
  assert.deepEqual(between(drawn("M1 2h1", "a"), drawn("M1 2h1", "a")), []);
});

test("only what differs is written, by the number of its element", () => {
  const found = between(drawn("M1 2h1", "a"), drawn("M5 6h1", "b"));
  assert.deepEqual(found, [
    { index: 1, attributes: [["d", "M5 6h1"]], words: null },
    { index: 3, attributes: [], words: "b" },
  ]);
});

test("the drawing's own attributes are written too", () => {
  const one = drawn("M1 2h1", "a");
  const found = between(one, one.replace("A scene", "Another"));
  assert.deepEqual(found, [{ index: 0, attributes: [["aria-label", "Another"]], words: null }]);
});

test("other elements, other attributes and references take a whole drawing", () => {
  const one = drawn("M1 2h1", "a");
  assert.equal(between(one, drawn("M1 2h1", "a", '<path class="line" d="M0 0h9"/>')), null);
  assert.equal(between(one, one.replaceAll("text", "desc")), null);
  assert.equal(between(one, one.replace(' x="3"', "")), null);
  assert.equal(between(one, drawn("M1 2h1", "a &lt; b")), null);
  assert.equal(between(drawn("M1 2h1", "a &lt; b"), drawn("M1 2h1", "a")), null);
});

test("a reference in what stays is no hindrance", () => {
  assert.equal(between(drawn("M1 2h1", "a &lt; b"), drawn("M5 6h1", "a &lt; b"))?.length, 1);
});
