// Records: how links carry them, which states count as the same, and what is accepted from a stranger's.

import assert from "node:assert/strict";
import { test } from "node:test";

import { sound } from "../../templates/assets/js/base/checked_record.js";
import * as records from "../../templates/assets/js/base/record.js";

const INITIAL = { widget: "toy", preset: "default", controls: { noise: 0.1, scene: "clean", loud: false }, seed: 0, log: [] };
const SPEC = {
  buttons: [{ name: "go", label: "Go", does: "press", repeats: "" }],
  controls: {
    noise: { kind: "slider", label: "Noise", keeps: "log", low: 0, high: 1, step: 0.05, unit: "", decimals: 2 },
    scene: { kind: "choice", label: "Scene", keeps: "nothing", options: { clean: "Clean", noisy: "Noisy" }, sets: { noisy: { noise: 0.9 } } },
    loud: { kind: "toggle", label: "Loud", keeps: "pose" },
  },
  handles: ["start"],
  clicks: [],
  hovers: ["main"],
  takes: ["source"],
  details: 1,
};

test("a link brings back the record that was put into it", () => {
  const record = records.drag(records.press(INITIAL, "go"), "start", [1.23456, -0.00001]);
  const given = { ...record, given: { source: "0123456789abcdef0123456789abcdef" }, preset: "Größe – 漢字 🦉" };
  const data = records.encode(given);
  assert.match(data, /^[A-Za-z0-9_-]+$/);
  assert.deepEqual(records.decode(data, INITIAL), given);
});

test("a link that is damaged or another figure's is told so", () => {
  const other = records.encode({ ...INITIAL, widget: "other" });
  assert.throws(() => records.decode(other, INITIAL), { message: "it belongs to another figure" });
  assert.throws(() => records.decode("%%%", INITIAL), { message: "it is damaged" });
  assert.throws(() => records.decode(records.encode({ ...INITIAL, log: 7 }), INITIAL), { message: "it is damaged" });
  assert.throws(() => records.decode("A".repeat(200_001), INITIAL), { message: "it is too long" });
});

test("places are written with four decimals and no minus zero", () => {
  assert.deepEqual(records.drag(INITIAL, "start", [0.123449, -0.00001]).log, [["drag", "start", 0.1234, 0]]);
});

test("a drag and what is pointed at replace the last of their kind, and a click does not", () => {
  const dragged = records.drag(records.drag(INITIAL, "start", [1, 1]), "start", [2, 2]);
  assert.deepEqual(dragged.log, [["drag", "start", 2, 2]]);
  assert.equal(records.drag(dragged, "end", [3, 3]).log.length, 2);
  assert.equal(records.hover(records.hover(INITIAL, "main", [1, 1]), "main", [2, 2]).log.length, 1);
  assert.equal(records.click(records.click(INITIAL, "main", [1, 1]), "main", [2, 2]).log.length, 2);
});

test("a handle that sets a slider is that slider, by its steps and within its ends", () => {
  const handle = { name: "grip", sets: "noise", world: [0.1, 2] };
  const at = (/** @type {number} */ x) => records.put(INITIAL, handle, [x, 7], SPEC.controls);
  assert.deepEqual(records.reached(handle, [0.33, 7], SPEC.controls), [0.35, 2]);
  assert.deepEqual(at(0.33), records.control(INITIAL, "noise", 0.35, SPEC.controls.noise));
  assert.equal(at(-3).controls.noise, 0);
  assert.equal(at(3).controls.noise, 1);
  assert.equal(at(0.11), INITIAL);
  const free = { name: "start", world: [0, 0] };
  assert.deepEqual(records.put(INITIAL, free, [1, 2], SPEC.controls), records.drag(INITIAL, "start", [1, 2]));
});

test("what is pointed at no longer leaves the log, and nothing else does", () => {
  const picked = records.click(INITIAL, "main", [1, 1]);
  assert.deepEqual(records.left(records.hover(picked, "main", [2, 2]), "main"), picked);
  assert.equal(records.left(picked, "main"), picked);
  const elsewhere = records.hover(picked, "map", [2, 2]);
  assert.equal(records.left(elsewhere, "main"), elsewhere);
});

test("no action changes the record that it begins from", () => {
  const frozen = Object.freeze({ ...INITIAL, controls: Object.freeze({ ...INITIAL.controls }), log: Object.freeze([]) });
  records.reseed(records.back(records.press(frozen, "go")));
  records.control(frozen, "noise", 0.5, SPEC.controls.noise);
  assert.deepEqual(frozen, INITIAL);
});

test("the key is the same for the same state, in whatever order its controls stand", () => {
  const turned = { ...INITIAL, controls: { loud: false, scene: "clean", noise: 0.1 } };
  assert.equal(records.key(turned), records.key(INITIAL));
  assert.notEqual(records.key(records.press(INITIAL, "go")), records.key(INITIAL));
});

test("a control brings along what its option sets, and keeps of the log what its spec says", () => {
  const record = records.press(records.drag(INITIAL, "start", [1, 1]), "go");
  assert.deepEqual(records.control(record, "scene", "noisy", SPEC.controls.scene), {
    ...INITIAL, controls: { noise: 0.9, scene: "noisy", loud: false },
  });
  assert.equal(records.control(record, "noise", 0.5, SPEC.controls.noise).log.length, 2);
  assert.deepEqual(records.control(record, "loud", true, SPEC.controls.loud).log, [["drag", "start", 1, 1]]);
});

test("a choice is adjusted once what its option has set was moved", () => {
  const record = records.control(INITIAL, "scene", "noisy", SPEC.controls.scene);
  const adjusted = (name, moved) =>
    records.adjusted({ ...record, controls: { ...record.controls, ...moved } }, name, SPEC.controls[name]);
  assert.equal(adjusted("scene", {}), false);
  assert.equal(adjusted("scene", { loud: true }), false);
  assert.equal(adjusted("scene", { noise: 0.85 }), true);
  assert.equal(adjusted("scene", { scene: "clean", noise: 0.5 }), false); // "clean" has set nothing
  assert.equal(adjusted("noise", { noise: 0.5 }), false);
});

test("a choice that places the start is adjusted once a handle was dragged, and no more once it was chosen again", () => {
  const places = { ...SPEC.controls.scene, places: true };
  const dragged = records.drag(INITIAL, "start", [1, 1]);
  assert.equal(records.adjusted(INITIAL, "scene", places), false);
  assert.equal(records.adjusted(records.press(INITIAL, "go"), "scene", places), false);
  assert.equal(records.adjusted(records.press(dragged, "go"), "scene", places), true);
  assert.equal(records.adjusted(dragged, "scene", SPEC.controls.scene), false);
  assert.equal(records.adjusted(records.control(dragged, "scene", "clean", places), "scene", places), false);
});

test("only one press or click more is a motion", () => {
  const once = records.press(INITIAL, "go");
  assert.ok(records.pressed(INITIAL, once));
  assert.ok(records.pressed(INITIAL, { ...INITIAL, log: [["click", "main", 1, 1]] }));
  assert.ok(!records.pressed(INITIAL, records.drag(INITIAL, "start", [1, 1])));
  assert.ok(!records.pressed(INITIAL, records.press(once, "go")));
  assert.ok(!records.pressed(once, INITIAL));
});

test("of a stranger's record what is sound is taken, and the rest is named", () => {
  const given = {
    controls: { noise: 7, scene: "noisy", constructor: 1 },
    seed: -1,
    log: [["press", "go"], ["press", "explode"], ["press", "go"]],
    given: { source: "0123456789abcdef0123456789abcdef", target: "x" },
  };
  const { record, ignored } = sound(given, INITIAL, SPEC);
  assert.deepEqual(record, {
    ...INITIAL,
    controls: { ...INITIAL.controls, scene: "noisy" },
    log: [["press", "go"]],
    given: { source: "0123456789abcdef0123456789abcdef" },
  });
  assert.deepEqual(ignored, ["noise", "“constructor”", "the seed", "everything from action 2 on", "“target”"]);
});

test("another draw forgets what was pressed and keeps where things were put", () => {
  const record = records.drag(records.press(INITIAL, "go"), "start", [1, 1]);
  assert.deepEqual(records.reseed(record).log, [["drag", "start", 1, 1]]);
  assert.notEqual(records.reseed(record).seed, record.seed);
});

test("of a stranger's record nothing is taken that the figure does not know", () => {
  const spec = { ...SPEC, buttons: [...SPEC.buttons, { name: "run", label: "Run", does: "run", repeats: "go" }] };
  const plain = { controls: {}, seed: 0, log: [] };
  const ignored = (/** @type {object} */ given) => sound({ ...plain, ...given }, INITIAL, spec).ignored;
  assert.deepEqual(ignored({ controls: { scene: "toString" } }), ["scene"]);
  assert.deepEqual(ignored({ log: [["press", "go", 1, 2]] }), ["everything from action 1 on"]);
  assert.deepEqual(ignored({ log: [["press", "run"]] }), ["everything from action 1 on"]);
  assert.deepEqual(ignored({ given: { source: "x" } }), ["the source"]);
  assert.deepEqual(ignored({ log: Array(2001).fill(["press", "go"]) }), ["everything from action 2001 on"]);
  assert.deepEqual(ignored({ log: Array(2000).fill(["press", "go"]) }), []);
});
