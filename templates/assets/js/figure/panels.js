// Swaps in a frame's panels, on the stage and behind More. The handles' overlay stays, so that focus and pointer
// capture survive.

/** @import { Panel } from "../base/types.js" */

import { find, make, text } from "../base/dom.js";
import { redraw, tagsOf } from "./marks.js";

/** @type {(root: HTMLElement, name: string) => HTMLElement | null} */
export const panelOf = (root, name) => root.querySelector(`.figure-panel[data-panel="${CSS.escape(name)}"]`);

/**
 * The drawing of a panel.
 * @type {(root: HTMLElement, name: string) => SVGSVGElement | null}
 */
export const drawing = (root, name) => panelOf(root, name)?.querySelector("svg.panel") ?? null;

/**
 * Whether a panel is interactive: a slide may show only some of a figure's panels, some are behind More, and on a phone
 * the small ones are buttons.
 * @type {(root: HTMLElement, name: string) => boolean}
 */
export function onStage(root, name) {
  const panel = panelOf(root, name);
  return Boolean(panel && !panel.hidden && !("thumb" in panel.dataset) && !panel.closest("details:not([open])"));
}

/**
 * Each panel's current drawing, as text and as tags, so that unchanged parts are left alone.
 * @type {WeakMap<HTMLElement, { svg: string, tags: string[] }>}
 */
const drawings = new WeakMap();

/**
 * Shows a drawing in a panel, updated in place if possible.
 * @param {HTMLElement} panel
 * @param {string} svg
 */
function show(panel, svg) {
  const current = drawings.get(panel);
  if (current?.svg === svg) return;
  const tags = tagsOf(svg);
  const drawing = /** @type {SVGSVGElement} */ (panel.querySelector("svg.panel"));
  if (!current || !redraw(drawing, current.tags, tags)) drawing.outerHTML = svg;
  drawings.set(panel, { svg, tags });
}

/**
 * Writes a panel's caption: one element per line, the first is its name.
 * @param {HTMLElement} panel
 * @param {string} words
 */
function caption(panel, words) {
  const lines = words.split("\n");
  const box = panel.querySelector(".panel-caption");
  if (!box) return;
  while (box.children.length < lines.length) box.append(make("span"));
  while (box.children.length > lines.length) box.lastChild?.remove();
  lines.forEach((line, i) => text(box.children[i], line));
}

/**
 * @param {HTMLElement} root
 * @param {Panel[]} panels
 */
export function swapPanels(root, panels) {
  const names = new Set(panels.map(({ name }) => name));
  for (const node of /** @type {NodeListOf<HTMLElement>} */ (root.querySelectorAll(".figure-panel[data-panel]"))) {
    if (!names.has(node.dataset.panel ?? "")) node.remove();
  }
  for (const { name, svg, caption: words } of panels) {
    const existing = panelOf(root, name);
    if (existing) {
      show(existing, svg);
      caption(existing, words);
      continue;
    }
    const panel = make("div", { class: "figure-panel", "data-panel": name });
    panel.innerHTML = svg;
    const stage = find(root, ".figure-stage");
    stage.insertBefore(panel, stage.querySelector(".figure-handles"));
  }
}
