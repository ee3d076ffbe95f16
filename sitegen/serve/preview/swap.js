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
  const rest = /** @type {Document} */ (page.cloneNode(true));
  rest.querySelector(TEXT)?.replaceChildren();
  rest.querySelectorAll(`${STYLE}, link[as=font], script[data-build], .site-footer li:has(> [download])`).forEach((node) => node.remove());
  rest.body.removeAttribute("data-search-data");
  return rest.documentElement.outerHTML.replace(/\s+/g, " ");
}

/** @param {Document} page */
const blocksOf = (page) => [...(page.querySelector(TEXT)?.children ?? [])];

/**
 * The run of blocks that differs: its start, how many blocks it had, and the blocks there now.
 * @param {Element[]} was
 * @param {Element[]} now
 */
function difference(was, now) {
  const [a, b] = [was, now].map((nodes) => nodes.map((node) => node.outerHTML));
  let first = 0;
  while (first < Math.min(a.length, b.length) && a[first] === b[first]) first += 1;
  let left = 0;
  while (left < Math.min(a.length, b.length) - first && a.at(-1 - left) === b.at(-1 - left)) left += 1;
  return { first, gone: a.length - left - first, come: now.slice(first, b.length - left) };
}

/**
 * Replaces the text that has changed. Returns whether it could: changed figures need a reload.
 * @param {Document} was
 * @param {Document} now
 */
function swapText(was, now) {
  const { first, gone, come } = difference(blocksOf(was), blocksOf(now));
  const shown = blocksOf(document);
  const old = shown.slice(first, first + gone);
  /** @param {Element} node */
  const live = (node) => node.matches("figure") || node.querySelector("figure");
  if (shown.length !== blocksOf(was).length || [...old, ...come].some(live)) return false;
  if (!old.length && !come.length) return true;
  const nodes = come.map((node) => document.importNode(node, true));
  if (shown[first]) shown[first].before(...nodes);
  else document.querySelector(TEXT)?.append(...nodes);
  old.forEach((node) => node.remove());
  return true;
}

/**
 * Replaces the style sheet once the new one has loaded.
 * @param {Document} now
 */
function swapStyle(now) {
  const link = document.querySelector(STYLE);
  const next = now.querySelector(STYLE);
  if (!link || !next || link.getAttribute("href") === next.getAttribute("href")) return;
  const fresh = document.importNode(next);
  const kept = keep();
  fresh.addEventListener("load", () => {
    link.remove();
    place(kept);
  });
  link.after(fresh);
}

/**
 * Updates the page to its new source, if that can be done in place. Returns whether it was.
 * @param {Document} was
 * @param {Document} now
 */
export function swap(was, now) {
  if (frame(was) !== frame(now)) return false;
  const kept = keep();
  if (!swapText(was, now)) return false;
  ladder()?.describeCards();
  restore(kept);
  swapStyle(now);
  const { searchData } = now.body.dataset;
  if (searchData) document.body.dataset.searchData = searchData;
  return true;
}

/**
 * Whether two sources are the same page, apart from the name of the build.
 * @param {Document} was
 * @param {Document} now
 */
export function same(was, now) {
  const [a, b] = [was, now].map((page) => page.documentElement.outerHTML.replace(/ data-build="[^"]*"/, ""));
  return a === b;
}
