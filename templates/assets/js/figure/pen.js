// Drawing two clouds by hand: strokes with the pointer, or single points by key. They go to Python as text, like a
// file; only the line under the pen is drawn here, until the picture with the points arrives.
/** @import { Point } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */
/** @import { Things } from "./own_clouds.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, find, findButton, on, SVG } from "../base/dom.js";
import { four } from "../base/format.js";
import { crosshair } from "./crosshairs.js";
import { percent } from "./coordinates.js";
import { hold } from "./hold.js";

const PANEL = "main";
const APART = 0.12; // world units between points along a stroke
const MOST = 2000; // points of a cloud
const TURN = Math.PI / 7;
const SHIFT = [0.7, -0.45];

/** @typedef {{ place: string, points: Point[] }} Stroke */

/**
 * Evenly spaced points along a line through `corners`.
 * @param {Point[]} corners
 */
function spread(corners) {
  const points = [corners[0]];
  for (const [x, y] of corners) {
    for (;;) {
      const [a, b] = points[points.length - 1];
      const far = Math.hypot(x - a, y - b);
      if (far < APART) break;
      points.push([a + ((x - a) * APART) / far, b + ((y - b) * APART) / far]);
    }
  }
  return points;
}

/** @type {(point: Point) => Point} */
const toTarget = ([x, y]) => [
  x * Math.cos(TURN) - y * Math.sin(TURN) + SHIFT[0],
  x * Math.sin(TURN) + y * Math.cos(TURN) + SHIFT[1],
];

/**
 * @param {Figure} figure
 * @param {Overlay} overlay
 * @param {(things: Things) => void} bring  shows the things in place of all others
 */
export function addPen(figure, overlay, bring) {
  const box = find(figure.root, ".own");
  const panel = find(figure.stage, `.figure-panel[data-panel="${PANEL}"]`);
  const [source, target] = figure.spec.takes;
  const words = { does: "Place a point", hint: "Arrow keys move, Shift for larger steps; Enter places a point." };
  const cross = crosshair(figure, overlay, PANEL, words, () => {});
  /** @type {Stroke[]} in the order they were drawn */
  let strokes = [];
  let cloud = ""; // the cloud being drawn, if any
  /** @typedef {{ corners: Point[], ink: SVGPathElement }} Line */
  /** @type {SVGPathElement[]} finished lines, until the next frame */
  const dry = [];

  /** @param {string} name */
  const of = (name) => strokes.filter((stroke) => stroke.place === name).flatMap((stroke) => stroke.points);

  /** Hands over the strokes so far as two clouds. */
  function hand() {
    /** @type {Things} */
    const things = {};
    for (const name of [source, target]) {
      const rows = of(name).slice(0, MOST).map((point) => point.map(four).join(","));
      const data = new TextEncoder().encode(["x,y", ...rows].join("\n"));
      if (rows.length) things[name] = { name: "", data };
    }
    bring(things);
  }

  function show() {
    for (const button of /** @type {NodeListOf<HTMLElement>} */ (box.querySelectorAll("[data-pen]"))) {
      button.setAttribute("aria-pressed", String(button.dataset.pen === cloud));
    }
    for (const action of ["undo", "clear"]) {
      const button = findButton(box, `[data-own=${action}]`);
      if (!strokes.length && button === document.activeElement) findButton(box, `[data-pen=${cloud || source}]`).focus();
      button.disabled = !strokes.length;
    }
    findButton(box, "[data-own=copy]").disabled = !of(source).length;
    figure.stage.classList.toggle("drawing", Boolean(cloud));
    cross.button.hidden = !cloud;
  }

  /** Starts drawing a cloud, or stops drawing. */
  function put(name = "") {
    cloud = name;
    show();
  }

  /** @param {Point[]} points */
  function add(points) {
    strokes.push({ place: cloud, points });
    show();
    hand();
  }

  /** @param {PointerEvent} event @returns {Line | null} */
  function begin(event) {
    if (!cloud || around(event, "button")) return null;
    overlay.measure();
    const at = cross.where(event);
    if (!at) return null;
    event.preventDefault();
    const ink = document.createElementNS(SVG, "path");
    ink.setAttribute("class", `line thick ${cloud}`);
    find(panel, "svg.panel").append(ink);
    return { corners: [at], ink };
  }

  /** @param {Line} line @param {PointerEvent} event */
  function follow({ corners, ink }, event) {
    const at = cross.where(event);
    if (!at) return;
    corners.push(at);
    const view = figure.viewOf(PANEL);
    const px = corners.map((corner) => percent(view, corner).map((part, i) => Math.round((part / 10) * view[4 + i])));
    ink.setAttribute("d", `M${px.map((point) => point.join(" ")).join("L")}`);
  }

  /** @param {Line} line @param {PointerEvent} event */
  function end({ corners, ink }, event) {
    if (event.type === "pointercancel") {
      ink.remove();
      return;
    }
    dry.push(ink);
    add(spread(corners));
  }

  /** @param {Line} line */
  const cancel = ({ ink }) => ink.remove();

  /** @param {MouseEvent} event */
  function press(event) {
    const { pen, own: action } = around(event, "button")?.dataset ?? {};
    if (pen) {
      put(pen === cloud ? "" : pen);
      if (cloud) hand(); // what was drawn before, or an empty window
    } else if (action === "undo") strokes.pop();
    else if (action === "clear") strokes = [];
    else if (action === "copy") {
      const copies = strokes.filter((stroke) => stroke.place === source);
      strokes = [...copies, ...copies.map(({ points }) => ({ place: target, points: points.map(toTarget) }))];
    } else return;
    show();
    if (action) hand();
  }

  on(cross.button, "click", (event) => {
    if (event.detail === 0) add([cross.at]);
  });
  on(box, "click", press);
  const pointer = hold(panel, panel, { begin, follow, end, cancel });
  figure.on("frame", () => {
    dry.splice(0).forEach((ink) => ink.remove());
    if (pointer.held) find(panel, "svg.panel").append(pointer.held.ink); // the drawing may be new
  });
  show();
  return { put };
}
