// Picks: panels that take a click at a place, or respond to the pointer's place. A crosshair does both by keyboard:
// arrows move it, and if the panel takes clicks, Enter or Space picks.
/** @import { Asker, Point } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { make, on } from "../base/dom.js";
import * as records from "../base/record.js";
import { ARROWS, percent, world } from "./coordinates.js";
import { drawing, onStage, panelOf } from "./panels.js";
import { runtime } from "../runtime/runtime.js";

/** @type {(value: number, low: number, high: number) => number} */
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

/**
 * A crosshair over a panel. `moved` is called after a key has moved it.
 * @param {Figure} figure
 * @param {Overlay} overlay
 * @param {string} name
 * @param {{ does: string, hint: string }} words
 * @param {(at: number) => void} moved
 */
export function crosshair(figure, overlay, name, { does, hint }, moved) {
  const panelLabel = drawing(figure.root, name)?.getAttribute("aria-label");
  const labels = { role: "slider", "aria-label": `${does}: ${panelLabel}`, "aria-description": hint };
  const attributes = { type: "button", class: "crosshair", "data-pick": name, ...labels };
  const button = overlay.layer.appendChild(make("button", attributes));
  const panel = /** @type {HTMLElement} */ (panelOf(figure.root, name));
  const view = () => figure.viewOf(name);
  const [x0, x1, y0, y1] = view();
  /** @type {Point} */
  let at = [(x0 + x1) / 2, (y0 + y1) / 2];
  button.setAttribute("aria-valuemin", String(x0));
  button.setAttribute("aria-valuemax", String(x1));

  /** @param {Point} point */
  function put(point) {
    at = point;
    overlay.put(button, name, ...percent(view(), point));
    const [x, y] = point.map((value) => value.toFixed(2));
    button.setAttribute("aria-valuenow", x);
    button.setAttribute("aria-valuetext", `x ${x}, y ${y}`.replaceAll("-", "−"));
  }

  /**
   * An event's place in world coordinates; null outside the window.
   * @param {MouseEvent} event
   * @returns {Point | null}
   */
  function where(event) {
    const [x, y] = world(overlay.rect(name), view(), event.clientX, event.clientY);
    const [a, b, c, d] = view();
    return x >= a && x <= b && y >= c && y <= d ? [x, y] : null;
  }

  /** @param {KeyboardEvent} event */
  function key(event) {
    const way = ARROWS[event.key];
    if (!way || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const [a, b, c, d] = view();
    const part = event.shiftKey ? 1 / 8 : 1 / 40;
    const [x, y] = at;
    put([clamp(x + way[0] * part * (b - a), a, b), clamp(y + way[1] * part * (d - c), c, d)]);
    moved(event.timeStamp);
  }

  const updateVisibility = () => button.toggleAttribute("data-away", !onStage(figure.root, name));
  put(at);
  updateVisibility();
  on(button, "keydown", key);
  // The button belongs to the stage, which sticks on a phone: after the browser's own scrolling, bring its panel into view.
  on(button, "focus", () => {
    if (panel.closest(".figure-rest")) requestAnimationFrame(() => panel.scrollIntoView({ block: "nearest" }));
  });
  figure.on("scaled", updateVisibility);
  return {
    get at() {
      return at;
    },
    put,
    where,
    button,
    panel,
  };
}

/** @type {(figure: Figure, overlay: Overlay, name: string) => void} */
function picked(figure, overlay, name) {
  const words = { does: "Pick a place", hint: "Arrow keys move, Shift for larger steps; Enter picks." };
  const cross = crosshair(figure, overlay, name, words, () => {});
  /** @param {Point} point */
  const pick = (point) => {
    cross.put(point);
    figure.ask(records.click(figure.record, name, point));
  };
  on(cross.button, "click", (event) => {
    if (event.detail === 0) pick(cross.at);
  });
  on(cross.panel, "click", (event) => {
    overlay.measure();
    const point = cross.where(event);
    if (point) pick(point);
  });
}

/**
 * Follows the pointer, but asks only while Python is up: moving over a picture must not make it wait. A tap or key may.
 * @param {ReturnType<typeof crosshair>} cross
 * @param {(at: number) => void} ask
 */
function following(cross, ask) {
  let frameRequest = 0; // the animation frame that will ask

  /** @param {PointerEvent} event */
  function follow(event) {
    if (event.pointerType === "touch" || event.buttons || runtime.state !== "live") return;
    const point = cross.where(event);
    if (!point) return;
    cross.put(point);
    const { timeStamp } = event;
    frameRequest ||= requestAnimationFrame(() => {
      frameRequest = 0;
      ask(timeStamp);
    });
  }

  on(cross.panel, "pointermove", follow);
  on(cross.panel, "pointerleave", () => {
    cancelAnimationFrame(frameRequest);
    frameRequest = 0;
  });
}

/** @type {(figure: Figure, overlay: Overlay, name: string) => void} */
function pointed(figure, overlay, name) {
  const words = { does: "Look at a place", hint: "Arrow keys move, Shift for larger steps." };
  /** @param {number} at */
  const ask = (at) =>
    figure.ask(records.hover(figure.record, name, cross.at), { merge: `hover:${name}`, by: "hover", at });
  const cross = crosshair(figure, overlay, name, words, (at) => {
    ask(at);
    figure.speak();
  });

  following(cross, ask);
  on(cross.panel, "click", (event) => {
    overlay.measure();
    const point = cross.where(event);
    if (!point) return;
    cross.put(point);
    ask(event.timeStamp);
    figure.speak();
  });
}

/**
 * A panel that does both: it shows the pointer's place while the pointer or the focus is there, and a click, a tap or
 * Enter picks that place for good.
 * @type {(figure: Figure, overlay: Overlay, name: string) => void}
 */
function explored(figure, overlay, name) {
  const hint = "Arrow keys move and show what is there, Shift for larger steps; Enter picks it.";
  /** @type {(at: number) => { merge: string, by: Asker, at: number }} */
  const asking = (at) => ({ merge: `hover:${name}`, by: "hover", at });
  /** @param {number} at */
  const look = (at) => figure.ask(records.hover(figure.record, name, cross.at), asking(at));
  const cross = crosshair(figure, overlay, name, { does: "Look at a place or pick it", hint }, (at) => {
    look(at);
    figure.speak();
  });
  const pick = () => figure.ask(records.click(records.left(figure.record, name), name, cross.at));

  /** @param {Event} event */
  function leave(event) {
    const record = records.left(figure.record, name);
    if (record !== figure.record) figure.ask(record, asking(event.timeStamp));
  }

  following(cross, look);
  on(cross.panel, "pointerleave", leave);
  on(cross.button, "blur", leave);
  on(cross.button, "click", (event) => {
    if (event.detail === 0) pick();
  });
  on(cross.panel, "click", (event) => {
    overlay.measure();
    const point = cross.where(event);
    if (!point) return;
    cross.put(point);
    pick();
  });
}

/**
 * @param {Figure} figure
 * @param {Overlay} overlay
 */
export function addPicks(figure, overlay) {
  const { clicks = [], hovers = [] } = figure.spec;
  const shared = clicks.filter((name) => hovers.includes(name));
  /** @param {string} name */
  const single = (name) => !shared.includes(name);
  for (const name of clicks.filter(single)) picked(figure, overlay, name);
  for (const name of hovers.filter(single)) pointed(figure, overlay, name);
  for (const name of shared) explored(figure, overlay, name);
}
