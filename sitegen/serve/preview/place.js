/* The author's place in a page: saved as plain data, and restored after the page has been replaced. */

/** @import { Kept, Mark, PageLadder, State, Way } from "./types.js" */

const TOLD = 200; // characters by which a block is recognised
const AROUND = 5; // blocks above and below the window to fall back on if none inside it remains
const BLOCKS = "main :is(h1, h2, h3, h4, p, li, dt, dd, pre, tr, .equation, figure)";

/**
 * What the page's script exposes, if it has loaded.
 * @returns {PageLadder | undefined}
 */
export const ladder = () => /** @type {any} */ (globalThis.Ladder);

/**
 * An element's name: its id, else its tag and text. Names are not unique.
 * @param {Element} node
 */
const named = (node) => (node.id ? `#${node.id}` : `${node.localName}: ${(node.textContent ?? "").trim().slice(0, TOLD)}`);

/**
 * The path to an element: the nearest id, and from there the index among each parent's children.
 * @param {Element} node
 * @returns {Way}
 */
function wayTo(node) {
  /** @type {number[]} */
  const steps = [];
  while (!node.id && node.parentElement) {
    steps.unshift([...node.parentElement.children].indexOf(node));
    node = node.parentElement;
  }
  return { id: node.id, steps };
}

/**
 * The element at the end of a path, if it still exists.
 * @param {Way} way
 */
function at({ id, steps }) {
  /** @type {Element | null | undefined} */
  let node = id ? document.getElementById(id) : document.documentElement;
  for (const i of steps) node = node?.children[i];
  return node ?? null;
}

/**
 * The blocks of the text in order, each with its name and the number of blocks of that name before it. The text in a
 * figure changes as it is used, so a figure is one block.
 */
function blocks() {
  /** @type {Map<string, number>} */
  const count = new Map();
  return [...document.querySelectorAll(BLOCKS)]
    .filter((node) => !node.parentElement?.closest("figure"))
    .map((node) => {
      const name = named(node);
      const nth = count.get(name) ?? 0;
      count.set(name, nth + 1);
      return { node, name, nth };
    });
}

/**
 * Blocks to find the place by, the best first: the focused one, then those that begin in the window, then others in it,
 * then others near it.
 * @returns {Mark[]}
 */
function marks() {
  const all = blocks().map((block) => ({ ...block, box: block.node.getBoundingClientRect() }));
  const seen = all.filter(({ box }) => box.height > 0);
  const first = seen.findIndex(({ box }) => box.bottom > 0);
  if (first < 0) return [];
  const last = seen.findLastIndex(({ box }) => box.top < innerHeight);
  const near = seen.slice(Math.max(0, first - AROUND), last + 1 + AROUND);
  /** @type {(block: { node: Element, box: DOMRect }) => number} */
  const rank = ({ node, box }) => {
    const inside = box.top >= 0 && box.top < innerHeight;
    if (inside && node.contains(document.activeElement) && document.activeElement !== document.body) return 0;
    return inside ? 1 : box.bottom > 0 && box.top < innerHeight ? 2 : 3;
  };
  return near.sort((a, b) => rank(a) - rank(b)).map(({ name, nth, box }) => ({ name, nth, top: box.top }));
}

/**
 * Figures that the author has changed.
 * @returns {State[]}
 */
function states() {
  const page = ladder();
  if (!page) return [];
  const { figures, record } = page;
  return [...figures.values()]
    .filter(({ initial, record: wanted }) => record.key(wanted) !== record.key(initial))
    .map(({ id, initial, record: wanted }) => ({ id, initial, record: wanted }));
}

/**
 * Saves the author's place, for `restore`.
 * @returns {Kept}
 */
export function keep() {
  const focused = document.activeElement;
  const details = [...document.querySelectorAll("details")];
  return {
    page: location.pathname,
    marks: marks(),
    focus: focused && focused !== document.body ? { ...wayTo(focused), name: named(focused) } : null,
    details: details.map((node) => ({ ...wayTo(node), open: node.open })),
    states: states(),
  };
}

/**
 * Scrolls so that the first mark that still exists is back at its position in the window.
 * @param {Kept} kept
 */
export function place(kept) {
  const there = new Map(blocks().map(({ node, name, nth }) => [`${nth} ${name}`, node]));
  const mark = kept.marks.find(({ name, nth }) => there.has(`${nth} ${name}`));
  const node = mark && there.get(`${mark.nth} ${mark.name}`);
  if (!node) return;
  const off = node.getBoundingClientRect().top - mark.top;
  if (Math.abs(off) >= 1) scrollBy({ top: off, behavior: "instant" });
}

/**
 * Opens the details that were open, and closes those that were closed.
 * @param {Kept} kept
 */
export function unfold(kept) {
  for (const each of kept.details) {
    const node = at(each);
    if (node instanceof HTMLDetailsElement && node.open !== each.open) node.open = each.open;
  }
}

/**
 * Focuses the same element again; if it has moved, one with the same text.
 * @param {Kept} kept
 */
function focus({ focus: kept }) {
  if (!kept) return;
  const node = at(kept);
  /** @param {Element | null} each */
  const same = (each) => each !== null && named(each) === kept.name;
  const tag = /^[a-z][\w-]*(?=: )/.exec(kept.name)?.[0];
  const found = same(node) ? node : tag ? [...document.querySelectorAll(tag)].find(same) : null;
  if (found !== document.activeElement) /** @type {HTMLElement | null} */ (found)?.focus({ preventScroll: true });
}

/**
 * Returns figures to the author's state, as long as their initial state is the same as before.
 * @param {Kept} kept
 */
function play({ states: kept }) {
  for (const { id, initial, record: wanted } of kept) {
    const { figures, record, sound } = /** @type {PageLadder} */ (ladder());
    const figure = figures.get(id);
    if (!figure || record.key(figure.initial) !== record.key(initial)) continue;
    if (record.key(figure.record) === record.key(wanted)) continue;
    const checked = sound(wanted, figure.initial, figure.spec);
    if (!checked.ignored.length) figure.ask(checked.record);
  }
}

/**
 * Restores everything that was kept.
 * @param {Kept} kept
 */
export function restore(kept) {
  unfold(kept);
  play(kept);
  place(kept);
  focus(kept);
}
