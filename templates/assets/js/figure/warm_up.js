// Warm-up: Python's first answers of each kind are its slowest, and a reader's first drag would pay for them. Once
// Python is up, visible figures are drawn off screen; when the page is idle, so are the moves that a reader may make
// next.
/** @import { FigureRecord, Frame, Point } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { limits } from "../base/limits.js";
import * as records from "../base/record.js";
import { runtime } from "../runtime/runtime.js";
import { figures } from "./registry.js";

const DRAGS = 100; // after 25, a reader's first drag was still slower than the next
const MOVES = 25; // of each other kind
const LONGEST = 1500; // ms for a kind
const SWAY = 1 / 50; // how far a handle is moved, as a part of a panel's width

/** @typedef {Generator<FigureRecord, void, Frame>} Moves  records to draw; each yield returns its frame */

/**
 * The point on a circle after a part of a full turn.
 * @type {(middle: Point, radius: number, turn: number) => Point}
 */
const onCircle = ([x, y], radius, turn) => [
  x + radius * Math.cos(2 * Math.PI * turn),
  y + radius * Math.sin(2 * Math.PI * turn),
];

/** @type {(figure: Figure) => Moves} its handles in turn, each around its own place */
function* drags({ shown, spec, frame: { handles, panels } }) {
  for (let i = 0; handles.length && i < DRAGS; i++) {
    const handle = handles[i % handles.length];
    const [x0, x1] = panels.find((panel) => panel.name === handle.panel)?.view ?? [0, 1];
    yield records.put(shown, handle, onCircle(handle.world, SWAY * (x1 - x0), i / DRAGS), spec.controls);
  }
}

/** @type {(figure: Figure) => Moves} hovers over its first panel that responds to them */
function* hovers({ shown, spec, frame: { panels } }) {
  const panel = panels.find(({ name }) => spec.hovers.includes(name));
  if (!panel) return;
  const [x0, x1, y0, y1] = panel.view;
  for (let i = 0; i < MOVES; i++) {
    yield records.hover(shown, panel.name, onCircle([(x0 + x1) / 2, (y0 + y1) / 2], (x1 - x0) / 4, i / MOVES));
  }
}

/** @type {(figure: Figure) => Moves} the steps that its run would take */
function* steps({ shown, spec, frame }) {
  const step = spec.buttons.find(({ does }) => does === "run")?.repeats;
  if (!step) return;
  let [record, at] = [shown, frame];
  for (let i = 0; i < MOVES && !at.disabled.includes(step); i++) {
    record = records.press(record, step);
    at = yield record;
  }
}

/** @type {(figure: Figure) => Moves} its first slider near its value, if coarse pictures exist */
function* slides({ shown, spec }) {
  const [name, slider] = Object.entries(spec.controls).find(([, { kind }]) => kind === "slider") ?? [];
  if (!name || slider?.kind !== "slider" || spec.details === 1) return;
  const current = Number(shown.controls[name]);
  const way = current + MOVES * slider.step > slider.high ? -slider.step : slider.step;
  for (let i = 1; i <= MOVES; i++) {
    const value = current + way * i;
    if (value >= slider.low && value <= slider.high) yield records.control(shown, name, value, slider);
  }
}

const KINDS = [drags, hovers, steps, slides];

/**
 * Warms Python up for a figure, never while anybody waits for an answer, and only if the figure is on screen.
 * @param {Figure} figure
 */
export function addWarmUp(figure) {
  const { id, root, spec } = figure;
  let isDrawn = false; // whether Python has drawn what is shown
  let kind = 0; // the index of the next kind
  let underway = false;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;

  /** @type {(record: FigureRecord, detail: number) => Promise<Frame>} */
  const unseen = (record, detail) =>
    runtime.frame({ figure: id, record, detail: spec.details > 1 ? detail : undefined, finer: true });
  const busy = () => [...figures.values()].some((f) => f.busy || f.running || f.root.matches(".dragging"));
  /** @param {FigureRecord} shown */
  const interrupted = (shown) => shown !== figure.shown || !figure.visible || busy();

  /**
   * Draws moves until their time is up or one cannot be drawn. False if something interrupted.
   * @param {Moves} moves
   */
  async function make(moves) {
    const { shown } = figure;
    const began = performance.now();
    try {
      for (let next = moves.next(); !next.done && performance.now() < began + LONGEST; ) {
        if (interrupted(shown)) return false;
        next = moves.next(await unseen(next.value, 0));
      }
    } catch (error) {
      if (/** @type {{ stopped?: boolean }} */ (error).stopped) return false;
    }
    return true;
  }

  /** Draws what is shown at every level of detail, so that Python has it cached and a first touch coarsens nothing. */
  async function finish() {
    const { shown } = figure;
    for (let detail = 0; detail < spec.details; ) {
      if (interrupted(shown)) return;
      detail = (await unseen(shown, detail)).detail + 1;
    }
    root.toggleAttribute("data-warm", true);
  }

  async function go() {
    while (kind < KINDS.length) {
      if (!(await make(KINDS[kind](figure)))) return;
      kind++;
    }
    await finish();
  }

  /** @param {() => Promise<unknown>} work */
  async function alone(work) {
    underway = true;
    await work().catch(({ stopped }) => {
      if (!stopped) root.toggleAttribute("data-warm", true); // the shown record cannot be drawn: nothing to warm up
    });
    underway = false;
    later();
  }

  function later() {
    clearTimeout(timer);
    if (underway || runtime.state !== "live" || !figure.visible || root.matches("[data-warm]")) return;
    if (isDrawn || figure.pending || figure.state === "live") {
      timer = setTimeout(() => void alone(go), limits.pause);
    } else {
      isDrawn = true;
      void alone(() => unseen(figure.shown, 0)); // so that a first touch waits for no import
    }
  }

  function changed() {
    if (runtime.state !== "live") {
      isDrawn = false; // the next worker starts as cold as the first
      kind = 0;
      root.toggleAttribute("data-warm", false);
    }
    later();
  }

  figure.on("seen", later);
  figure.on("frame", later);
  runtime.on("change", changed);
}
