// Warm-up: an engine runs code slowly until it has run it often, so a reader's first drag would be the slowest. Once
// Python is up, what is seen is drawn unseen; when all is at rest, so are the moves that a reader may make of it next.
/** @import { FigureRecord, Frame, Point } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { together } from "../base/dom.js";
import { limits } from "../base/limits.js";
import * as records from "../base/record.js";
import { runtime } from "../runtime/runtime.js";
import { figures } from "./registry.js";

const TIMES = 25; // of each kind of move: from about there on, answers are as fast as they will be
const MOST = 500; // ms that a kind may take
const SWAY = 1 / 50; // of a panel's width: how far off its place a handle is put

/** @typedef {Generator<FigureRecord, void, Frame>} Moves  records to draw, each told the frame of the one before */

/**
 * The place at a part of a turn on a circle.
 * @type {(middle: Point, radius: number, turn: number) => Point}
 */
const around = ([x, y], radius, turn) => [
  x + radius * Math.cos(2 * Math.PI * turn),
  y + radius * Math.sin(2 * Math.PI * turn),
];

/** @type {(figure: Figure) => Moves} its handles in turn, each about its own place */
function* drags({ shown, frame: { handles, panels } }) {
  for (let i = 0; handles.length && i < TIMES; i++) {
    const { name, panel, world } = handles[i % handles.length];
    const [x0, x1] = panels.find((each) => each.name === panel)?.view ?? [0, 1];
    yield records.drag(shown, name, around(world, SWAY * (x1 - x0), i / TIMES));
  }
}

/** @type {(figure: Figure) => Moves} places pointed at in its first panel that answers to that */
function* hovers({ shown, spec, frame: { panels } }) {
  const panel = panels.find(({ name }) => spec.hovers.includes(name));
  if (!panel) return;
  const [x0, x1, y0, y1] = panel.view;
  for (let i = 0; i < TIMES; i++) {
    yield records.hover(shown, panel.name, around([(x0 + x1) / 2, (y0 + y1) / 2], (x1 - x0) / 4, i / TIMES));
  }
}

/** @type {(figure: Figure) => Moves} the steps that its run would take */
function* steps({ shown, spec, frame }) {
  const step = spec.buttons.find(({ does }) => does === "run")?.repeats;
  if (!step) return;
  let [record, at] = [shown, frame];
  for (let i = 0; i < TIMES && !at.disabled.includes(step); i++) {
    record = records.press(record, step);
    at = yield record;
  }
}

/** @type {(figure: Figure) => Moves} its first slider about its value, where a coarse picture answers it */
function* slides({ shown, spec }) {
  const [name, slider] = Object.entries(spec.controls).find(([, { kind }]) => kind === "slider") ?? [];
  if (!name || slider?.kind !== "slider" || spec.details === 1) return;
  const now = Number(shown.controls[name]);
  const way = now + TIMES * slider.step > slider.high ? -slider.step : slider.step;
  for (let i = 1; i <= TIMES; i++) {
    const value = now + way * i;
    if (value >= slider.low && value <= slider.high) yield records.control(shown, name, value, slider);
  }
}

/** What is warmed up, in order. */
const KINDS = [drags, hovers, steps, slides];

/**
 * Warms Python up for a figure: never while anybody waits for an answer, and only for one that is on screen.
 * @param {Figure} figure
 */
export function addWarmUp(figure) {
  const { id, root, spec } = figure;
  let drawn = false; // by Python, what is seen
  let done = 0; // of the kinds
  let going = false;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let rest;

  /** @type {(record: FigureRecord, detail: number) => Promise<Frame>} */
  const unseen = (record, detail) =>
    runtime.frame({ figure: id, record, detail: spec.details > 1 ? detail : undefined, finer: true });
  const busy = () => [...figures.values()].some((each) => each.busy || each.running || each.root.matches(".dragging"));
  /** @param {FigureRecord} record */
  const left = (record) => record !== figure.shown || !figure.visible || busy();

  /** A kind of moves, until it has taken its time. Whether it came to its end. */
  async function move() {
    const { shown } = figure;
    const moves = KINDS[done](figure);
    const began = performance.now();
    for (let next = moves.next(); !next.done && performance.now() < began + MOST; ) {
      if (left(shown)) return false;
      next = moves.next(await unseen(next.value, 0));
    }
    return true;
  }

  /** What is seen, level by level: Python has it at hand, and a first touch coarsens nothing. */
  async function finish() {
    const { shown } = figure;
    for (let detail = 0; detail < spec.details; ) {
      if (left(shown)) return;
      detail = (await unseen(shown, detail)).detail + 1;
    }
    root.toggleAttribute("data-warm", true);
  }

  async function go() {
    while (done < KINDS.length) {
      if (!(await move())) return;
      done++;
    }
    await finish();
  }

  /** @param {() => Promise<unknown>} does */
  async function alone(does) {
    going = true;
    await does().catch(({ stopped }) => {
      if (stopped) return;
      done++; // a move that cannot be drawn: no more of that kind
      if (done > KINDS.length) root.toggleAttribute("data-warm", true); // nor can what is seen
    });
    going = false;
    later();
  }

  function later() {
    clearTimeout(rest);
    if (going || runtime.state !== "live" || !figure.visible || root.matches("[data-warm]")) return;
    if (drawn || figure.pending) {
      rest = setTimeout(() => (busy() ? later() : void alone(go)), limits.pause);
    } else {
      drawn = true;
      void alone(() => unseen(figure.shown, 0)); // a first touch waits for no import
    }
  }

  function changed() {
    if (runtime.state !== "live") {
      drawn = false; // another worker is as cold as the first was
      done = 0;
      root.toggleAttribute("data-warm", false);
    }
    later();
  }

  return together([
    figure.on("seen", later),
    figure.on("frame", later),
    runtime.on("change", changed),
    () => clearTimeout(rest),
  ]);
}
