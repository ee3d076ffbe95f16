// A figure's state: which requests wait, and which states follow one another.

import assert from "node:assert/strict";
import { test } from "node:test";

import { FigureState, merged } from "../../templates/assets/js/figure/state.js";

/** Where each state may lead. Only giving up leads back to the picture that the page was built with. */
const NEXT = {
  static: ["tape", "live", "waiting", "failed"],
  tape: ["live", "waiting", "failed"],
  live: ["tape", "waiting", "failed"],
  waiting: ["static", "tape", "live", "failed"],
  failed: ["static", "tape", "live", "waiting"],
};

const record = (seed) => ({ widget: "toy", preset: "default", controls: {}, seed, log: [] });
const question = (seed, merge = null) => ({ record: record(seed), merge });
const seeds = (questions) => questions.map((each) => each.record.seed);

test("questions of one kind that wait become the latest", () => {
  const waiting = merged([question(1), question(2, "drag:a")], question(3, "drag:a"), true);
  assert.deepEqual(seeds(waiting), [1, 3]);
});

test("questions of other kinds, and of none, wait one after another", () => {
  assert.deepEqual(seeds(merged([question(1, "drag:a")], question(2, "drag:b"), true)), [1, 2]);
  assert.deepEqual(seeds(merged([question(1)], question(2), true)), [1, 2]);
  assert.deepEqual(seeds(merged([question(1, "drag:a"), question(2)], question(3, "drag:a"), true)), [1, 2, 3]);
});

test("while Python is not up only the latest question waits", () => {
  assert.deepEqual(seeds(merged([question(1), question(2)], question(3), false)), [3]);
});

test("a list of questions is not changed in place", () => {
  const waiting = Object.freeze([question(1, "run")]);
  merged(waiting, question(2, "run"), true);
  assert.deepEqual(seeds(waiting), [1]);
});

test("one question is drawn at a time, the oldest first", () => {
  const state = new FigureState(record(0), {});
  state.wait(record(1), null, true);
  state.wait(record(2), null, true);
  assert.equal(state.take().record.seed, 1);
  assert.equal(state.take(), null);
  state.settle();
  assert.equal(state.take().record.seed, 2);
  assert.ok(state.pending);
  state.settle();
  assert.ok(!state.pending);
});

test("what is refused leads back to what is seen", () => {
  const state = new FigureState(record(0), {});
  state.show(record(1), {}, "live");
  state.record = record(2);
  state.wait(record(2), null, true);
  state.refuse("no");
  assert.deepEqual([state.record.seed, state.error, state.pending], [1, "no", false]);
  assert.equal(state.name("live"), "failed");
  state.begin();
  assert.equal(state.name("live"), "live");
});

test("a question that Python's end took with it is asked again", () => {
  const state = new FigureState(record(0), {});
  state.record = record(1);
  state.wait(record(1), null, true);
  state.take();
  state.settle(true);
  state.again();
  assert.equal(state.name("loading"), "waiting");
  assert.equal(state.take().record.seed, 1);
});

test("every state is reached, and none but by the table", () => {
  let number = 7; // a small generator, so that each run walks the same way
  const random = (count) => (number = (number * 48271) % 2147483647) % count;
  const state = new FigureState(record(0), {});
  const does = [
    () => state.wait(record(random(9)), null, false),
    () => state.wait(record(random(9)), "drag", true),
    () => state.take(),
    () => state.settle(),
    () => state.refuse("no"),
    () => state.begin(),
    () => state.leave(),
    () => state.clear(),
    () => state.again(),
    () => state.show(record(1), {}, "live"),
    () => state.show(record(1), {}, "tape"),
  ];
  const seen = new Set();
  let runtime = "idle";
  let before = state.name(runtime);
  for (let step = 0; step < 20_000; step++) {
    if (random(5) === 0) runtime = ["idle", "loading", "live", "failed", "file"][random(5)];
    else does[random(does.length)]();
    const now = state.name(runtime);
    assert.ok(now === before || NEXT[before].includes(now), `${before} → ${now}`);
    seen.add((before = now));
  }
  assert.deepEqual([...seen].sort(), Object.keys(NEXT).sort());
});

test("a file of Python's that did not load leaves the question waiting until it is asked again, or another is", () => {
  const state = new FigureState(record(0), {});
  const ask = (seed) => {
    state.record = record(seed);
    state.wait(state.record, null, true);
    assert.equal(state.take().record.seed, seed);
  };
  ask(1);
  state.settle(true);
  state.miss("no such pack");
  assert.equal(state.name("live"), "failed");
  assert.equal(state.lack, "no such pack");

  assert.equal(state.take().record.seed, 1, "asked again");
  assert.equal(state.lack, "");
  state.settle(true);
  state.miss("still none");

  state.begin();
  assert.equal(state.lack, "", "another question");
  assert.ok(!state.waiting);
  ask(2);
  state.settle(true);
  state.miss("none again");

  state.leave();
  assert.equal(state.record.seed, 0, "given up");
  assert.equal(state.name("live"), "static");
});
