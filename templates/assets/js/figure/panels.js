// Swaps a frame's panels in, on the stage and behind More. The handles' overlay stays, so that focus and pointer capture
// survive.

/** @import { Panel } from "../base/types.js" */

import { find, make, text } from "../base/dom.js";
import { redraw, tagsOf } from "./marks.js";

/** @type {(root: HTMLElement, name: string) => HTMLElement | null} */
export const panelOf = (root, name) => root.querySelector(`.figure-panel[data-panel="${CSS.escape(name)}"]`);

/**
 * The drawing of a panel.
 * @type {(root: HTMLElement, name: string) => SVGSVGElement | null}
 */
export const drawing = (root, name) => panelOf(root, name)?.querySelector("svg.plot") ?? null;

/**
 * Whether a panel is there for the hand: a slide may show some of a figure's panels only, some wait behind More, and on a
 * phone a small one is a button.
 * @type {(root: HTMLElement, name: string) => boolean}
 */
export function onStage(root, name) {
  const panel = panelOf(root, name);
  return Boolean(panel && !panel.hidden && !("thumb" in panel.dataset) && !panel.closest("details:not([open])"));
}

/**
 * The drawing that each panel element holds, as text and by its tags: what has not changed is left alone.
 * @type {WeakMap<HTMLElement, { svg: string, tags: string[] }>}
 */
const held = new WeakMap();

/**
 * Shows a drawing in a panel, set in place where it can be.
 * @param {HTMLElement} panel
 * @param {string} svg
 */
function show(panel, svg) {
  const known = held.get(panel);
  if (known?.svg === svg) return;
  const tags = tagsOf(svg);
  const drawing = /** @type {SVGSVGElement} */ (panel.querySelector("svg.plot"));
  if (!known || !redraw(drawing, known.tags, tags)) drawing.outerHTML = svg;
  held.set(panel, { svg, tags });
}

/**
 * A panel's caption: a line each, the first its name.
 * @param {HTMLElement} panel
 * @param {string} words
 */
function caption(panel, words) {
  const lines = words.split("\n");
  const told = panel.querySelector(".panel-caption");
  if (!told) return;
  while (told.children.length < lines.length) told.append(make("span"));
  while (told.children.length > lines.length) told.lastChild?.remove();
  lines.forEach((line, i) => text(told.children[i], line));
}

/**
 * @param {HTMLElement} root
 * @param {Panel[]} panels
 */
export function swapPanels(root, panels) {
  const names = new Set(panels.map(({ name }) => name));
  for (const gone of /** @type {NodeListOf<HTMLElement>} */ (root.querySelectorAll(".figure-panel[data-panel]"))) {
    if (!names.has(gone.dataset.panel ?? "")) gone.remove();
  }
  for (const { name, svg, caption: words } of panels) {
    const there = panelOf(root, name);
    if (there) {
      show(there, svg);
      caption(there, words);
      continue;
    }
    const panel = make("div", { class: "figure-panel", "data-panel": name });
    panel.innerHTML = svg;
    const stage = find(root, ".figure-stage");
    stage.insertBefore(panel, stage.querySelector(".figure-handles"));
  }
}
