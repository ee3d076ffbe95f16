/* Compares a page's old and new source: nothing has changed, or its style, or some of its text, or more than can be
   swapped in place. */

import { keep, ladder, place, restore } from "./place.js";

const TEXT = "main .text";
const STYLE = "link[rel=stylesheet]";

/**
 * A page without its text, its style, and what changes on every page along with them: the part that must be equal.
 * @param {Document} page
 */
function frame(page) {
  const copy = /** @type {Document} */ (page.cloneNode(true));
  copy.querySelector(TEXT)?.replaceChildren();
  copy.querySelectorAll(`${STYLE}, link[as=font], script[data-build], .site-footer li:has(> [download])`).forEach((node) => node.remove());
  copy.body.removeAttribute("data-search-data");
  return copy.documentElement.outerHTML.replace(/\s+/g, " ");
}

/** @param {Document} page */
const sheets = (page) => page.querySelectorAll(STYLE).length;

/** @param {Document} page */
const blocksOf = (page) => [...(page.querySelector(TEXT)?.children ?? [])];

/**
 * The run of blocks that differs: its start, how many blocks it had, and the blocks there now.
 * @param {Element[]} old
 * @param {Element[]} current
 */
function difference(old, current) {
  const [a, b] = [old, current].map((nodes) => nodes.map((node) => node.outerHTML));
  let first = 0;
  while (first < Math.min(a.length, b.length) && a[first] === b[first]) first += 1;
  let tail = 0;
  while (tail < Math.min(a.length, b.length) - first && a.at(-1 - tail) === b.at(-1 - tail)) tail += 1;
  return { first, count: a.length - tail - first, come: current.slice(first, b.length - tail) };
}

/**
 * Replaces the text that has changed. Returns whether it could: changed figures need a reload.
 * @param {Document} old
 * @param {Document} current
 */
function swapText(old, current) {
  const { first, count, come } = difference(blocksOf(old), blocksOf(current));
  const blocks = blocksOf(document);
  const outdated = blocks.slice(first, first + count);
  /** @param {Element} node */
  const live = (node) => node.matches("figure") || node.querySelector("figure");
  if (blocks.length !== blocksOf(old).length || [...outdated, ...come].some(live)) return false;
  if (!outdated.length && !come.length) return true;
  const nodes = come.map((node) => document.importNode(node, true));
  if (blocks[first]) blocks[first].before(...nodes);
  else document.querySelector(TEXT)?.append(...nodes);
  outdated.forEach((node) => node.remove());
  return true;
}

/**
 * Replaces each style sheet that has changed once its new one has loaded.
 * @param {Document} current
 */
function swapStyles(current) {
  const links = document.querySelectorAll(`${STYLE}:not([data-outdated])`);
  current.querySelectorAll(STYLE).forEach((next, i) => {
    const link = /** @type {HTMLLinkElement} */ (links[i]);
    if (link.getAttribute("href") === next.getAttribute("href")) return;
    link.dataset.outdated = ""; // until the new one has loaded
    const fresh = document.importNode(next);
    const state = keep();
    fresh.addEventListener("load", () => {
      link.remove();
      place(state);
    });
    link.after(fresh);
  });
}

/**
 * Updates the page to its new source, if that can be done in place. Returns whether it was.
 * @param {Document} old
 * @param {Document} current
 */
export function swap(old, current) {
  if (frame(old) !== frame(current) || sheets(old) !== sheets(current)) return false;
  const state = keep();
  if (!swapText(old, current)) return false;
  ladder()?.describeCards();
  restore(state);
  swapStyles(current);
  const { searchData } = current.body.dataset;
  if (searchData) document.body.dataset.searchData = searchData;
  return true;
}

/**
 * Whether two sources are the same page, apart from the name of the build.
 * @param {Document} old
 * @param {Document} current
 */
export function same(old, current) {
  const [a, b] = [old, current].map((page) => page.documentElement.outerHTML.replace(/ data-build="[^"]*"/, ""));
  return a === b;
}
