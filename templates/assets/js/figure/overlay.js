// The overlay over a figure's panels: buttons at world positions (handles, crosshairs) that outlive every swap.
/** @import { Figure } from "./figure.js" */
/** @import { Rect } from "./coordinates.js" */

/** @typedef {ReturnType<typeof createOverlay>} Overlay */

import { make, on } from "../base/dom.js";
import { drawing } from "./panels.js";

/**
 * Keeps buttons at positions in percent of a panel. Boxes are measured when sizes change and not on every frame, which
 * would make each swap wait for layout. Measurements are in px of the screen; a slide beside its notes is drawn smaller
 * than it is laid out.
 * @param {Figure} figure
 */
export function createOverlay(figure) {
  const { root, stage } = figure;
  const existing = /** @type {HTMLElement | null} */ (stage.querySelector(".figure-handles"));
  const layer = existing ?? stage.appendChild(make("div", { class: "figure-handles" }));
  /** @type {Map<string, [x: number, y: number, width: number, height: number]>} */
  const boxes = new Map();
  /** @type {Map<HTMLElement, [panel: string, left: number, top: number]>} */
  const positions = new Map(); // in percent of the panel
  /** @type {DOMRect | null} */
  let origin = null; // the layer's box on the screen; null once something may have moved it
  let scale = 1; // px of the screen per px of the layout

  function measure() {
    const from = (origin = layer.getBoundingClientRect());
    scale = from.width / layer.offsetWidth || 1;
    for (const { dataset } of /** @type {NodeListOf<HTMLElement>} */ (root.querySelectorAll(".figure-panel[data-panel]"))) {
      const name = dataset.panel ?? "";
      const box = drawing(root, name)?.getBoundingClientRect();
      if (box) boxes.set(name, [box.left - from.left, box.top - from.top, box.width, box.height]);
    }
    for (const button of positions.keys()) settle(button);
    return from;
  }

  /** @param {HTMLElement} button */
  function settle(button) {
    const [panel, left, top] = positions.get(button) ?? ["", 0, 0];
    const [x, y, width, height] = boxes.get(panel) ?? [0, 0, 0, 0];
    const [across, down] = [x + (left / 100) * width, y + (top / 100) * height];
    button.style.translate = `${across / scale}px ${down / scale}px`; // unlike left and top, needs no layout
  }

  const watch = new ResizeObserver(measure);
  [stage, ...root.querySelectorAll(".figure-panel[data-panel]")].forEach((element) => watch.observe(element));
  measure();
  figure.on("scaled", measure); // no observer reports a slide's scale
  // While the stage sticks, panels outside it scroll past, and a control over one of them has to follow.
  const onMove = () => {
    origin = null;
    const position = positions.get(/** @type {HTMLElement} */ (document.activeElement));
    if (position && !stage.contains(drawing(root, position[0]))) measure();
  };
  on(document, "scroll", onMove, { capture: true, passive: true });
  on(document, "toggle", onMove, { capture: true }); // something above may have unfolded
  on(globalThis, "resize", onMove);
  on(root, "pointerenter", onMove);
  return {
    layer,
    measure,
    /**
     * The box of a panel's drawing on the screen.
     * @param {string} panel
     * @returns {Rect}
     */
    rect(panel) {
      const from = origin ?? measure();
      const [x, y, width, height] = boxes.get(panel) ?? [0, 0, 0, 0];
      return { left: from.left + x, top: from.top + y, width, height };
    },
    /**
     * Centres a button at a position in percent of a panel.
     * @param {HTMLElement} button
     * @param {string} panel
     * @param {number} left
     * @param {number} top
     */
    put(button, panel, left, top) {
      positions.set(button, [panel, left, top]);
      if (boxes.has(panel)) settle(button);
      else measure();
    },
    /** @param {HTMLElement} button */
    remove(button) {
      positions.delete(button);
      button.remove();
    },
  };
}
