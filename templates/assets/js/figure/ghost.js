// A ghost of the source over its panel: the reader drags it to where they think the source will stop.
/** @import { Point } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, make, on, SVG } from "../base/dom.js";
import { ARROWS, percent, world } from "./coordinates.js";
import { hold } from "./hold.js";
import { drawing, panelOf } from "./panels.js";
import { away, mean, placed, points } from "./rigid.js";

const PANEL = "main";
const GROUP = "source";
const ARM = 92; // nominal px from the ghost's centre to the handle that turns it

/** @type {(figure: Figure) => Element | null} */
const groupOf = (figure) =>
  drawing(figure.root, PANEL)?.querySelector(`[id="${figure.id}-${PANEL}-${GROUP}"]`) ?? null;

/**
 * @param {Figure} figure
 * @param {Overlay} overlay
 */
export function createGhost(figure, overlay) {
  const panel = /** @type {HTMLElement} */ (panelOf(figure.root, PANEL));
  const view = figure.viewOf(PANEL);
  const [x0, x1, , , width, , left, , right] = view;
  const unit = (width - left - right) / (x1 - x0); // nominal px per world unit
  const svg = document.createElementNS(SVG, "svg");
  const box = drawing(figure.root, PANEL)?.getAttribute("viewBox") ?? "0 0 1 1";
  const fine = Number(box.split(" ")[2]) / width; // units of the drawing per nominal px
  svg.setAttribute("viewBox", box);
  svg.setAttribute("class", "panel predict-ghost");
  svg.setAttribute("aria-hidden", "true");
  const source = groupOf(figure);
  const body = document.createElementNS(SVG, "g");
  for (const child of source?.children ?? []) body.append(child.cloneNode(true));
  svg.append(body);
  panel.append(svg);

  const start = points(source);
  /** @type {Point} the centre, in units of the drawing */
  const middle = mean(start);
  let turn = 0; // degrees, as the drawing turns
  /** @type {Point} */
  let shift = [0, 0];
  let compared = false;

  const handles = { move: handle("move", "Ghost, place"), turn: handle("turn", "Ghost, turn") };

  /** @param {"move" | "turn"} kind @param {string} label */
  function handle(kind, label) {
    const attributes = { type: "button", class: `ghost-handle ${kind}`, role: "slider", "aria-label": label };
    const button = make("button", { ...attributes, "aria-describedby": "handle-hint", "data-ghost": kind });
    return overlay.layer.appendChild(button);
  }

  /** A place in the drawing in world coordinates. @param {Point} place @returns {Point} */
  function toWorld([x, y]) {
    const rect = { left: 0, top: 0, width: width * fine, height: Number(box.split(" ")[3]) };
    return world(rect, view, x, y);
  }

  /** @type {() => Point} */
  const centre = () => [middle[0] + shift[0], middle[1] + shift[1]];

  function show() {
    body.setAttribute("transform", `translate(${shift.join(" ")}) rotate(${turn} ${middle.join(" ")})`);
    const at = centre();
    const angle = (turn - 60) * (Math.PI / 180);
    /** @type {Point} */
    const knob = [at[0] + ARM * fine * Math.cos(angle), at[1] + ARM * fine * Math.sin(angle)];
    const [x, y] = toWorld(at);
    overlay.put(handles.move, PANEL, ...percent(view, [x, y]));
    overlay.put(handles.turn, PANEL, ...percent(view, toWorld(knob)));
    const degrees = Math.round(-turn);
    slide(handles.move, `x ${x.toFixed(2)} u, y ${y.toFixed(2)} u`, x0, x1, x);
    slide(handles.turn, `${degrees}° from the source as it is`, -180, 180, degrees);
  }

  /** @param {HTMLElement} button @param {string} words @param {number} least @param {number} most @param {number} is */
  function slide(button, words, least, most, is) {
    const attributes = { "aria-valuetext": words, "aria-valuemin": least, "aria-valuemax": most, "aria-valuenow": is.toFixed(2) };
    for (const [name, value] of Object.entries(attributes)) button.setAttribute(name, String(value));
  }

  /** @param {number} degrees */
  const normalize = (degrees) => ((((degrees + 180) % 360) + 360) % 360) - 180;

  /** Moves the centre, which stays in the panel. @param {Point} to */
  function move(to) {
    const [, , wide, high] = box.split(" ").map(Number);
    const clamped = [Math.min(Math.max(to[0], 0), wide), Math.min(Math.max(to[1], 0), high)];
    shift = [clamped[0] - middle[0], clamped[1] - middle[1]];
  }

  /** The pointer's place in the drawing. @param {PointerEvent} event @returns {Point} */
  function pointOf(event) {
    const rect = overlay.rect(PANEL);
    return [
      ((event.clientX - rect.left) / rect.width) * width * fine,
      ((event.clientY - rect.top) / rect.width) * width * fine,
    ];
  }

  /**
   * The handle that is held, and the ghost's pose before. grip: from its centre to the pointer.
   * @typedef {{ kind: string, grip: Point, before: { turn: number, shift: Point } }} Held
   */

  /** @param {PointerEvent} event @returns {Held | null} */
  function begin(event) {
    const button = around(event, ".ghost-handle");
    if (!button) return null;
    overlay.measure();
    const [x, y] = pointOf(event);
    const [a, b] = centre();
    button.focus({ preventScroll: true });
    return { kind: button.dataset.ghost ?? "", grip: [x - a, y - b], before: { turn, shift } };
  }

  /** @param {Held} held @param {PointerEvent} event */
  function follow({ kind, grip }, event) {
    if (compared) return; // the run was started by key while the pointer holds the ghost
    const [x, y] = pointOf(event);
    const [a, b] = centre();
    if (kind === "move") move([x - grip[0], y - grip[1]]);
    else turn = normalize((Math.atan2(y - b, x - a) * 180) / Math.PI + 60);
    show();
  }

  /** @param {Held} held */
  function cancel({ before: start }) {
    if (compared) return;
    ({ turn, shift } = start);
    show();
  }

  /** @param {KeyboardEvent} event */
  function key(event) {
    const kind = around(event, ".ghost-handle")?.dataset.ghost;
    const arrow = ARROWS[event.key];
    if (!kind || !arrow || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const step = event.shiftKey ? 5 : 1;
    if (kind === "turn") turn = normalize(turn - 3 * step * (arrow[0] + arrow[1]));
    else {
      const [a, b] = centre();
      move([a + 0.1 * step * arrow[0] * unit * fine, b - 0.1 * step * arrow[1] * unit * fine]);
    }
    show();
  }

  const pointer = hold(overlay.layer, overlay.layer, { begin, follow, end: () => {}, cancel });
  const keys = on(overlay.layer, "keydown", key);

  function letGo() {
    for (const handle of Object.values(handles)) overlay.remove(handle);
  }

  show();
  return {
    dispose() {
      pointer.dispose();
      keys();
      letGo();
      svg.remove();
    },
    focus: () => handles.move.focus({ preventScroll: true }),
    /** Fixes the ghost where it is. */
    fix() {
      compared = true;
      letGo();
    },
    get compared() {
      return compared;
    },
    /** The mean distance of its points from the source's points shown now, in u. */
    compare: () => away(placed(start, turn, middle, shift), points(groupOf(figure))) / fine / unit,
  };
}
