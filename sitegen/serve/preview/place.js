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
const nameOf = (node) => (node.id ? `#${node.id}` : `${node.localName}: ${(node.textContent ?? "").trim().slice(0, TOLD)}`);

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
      const name = nameOf(node);
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
  const boxed = blocks().map((block) => ({ ...block, box: block.node.getBoundingClientRect() }));
  const visible = boxed.filter(({ box }) => box.height > 0);
  const first = visible.findIndex(({ box }) => box.bottom > 0);
  if (first < 0) return [];
  const last = visible.findLastIndex(({ box }) => box.top < innerHeight);
  const nearby = visible.slice(Math.max(0, first - AROUND), last + 1 + AROUND);
  /** @type {(block: { node: Element, box: DOMRect }) => number} */
  const rank = ({ node, box }) => {
    const isInside = box.top >= 0 && box.top < innerHeight;
    if (isInside && node.contains(document.activeElement) && document.activeElement !== document.body) return 0;
    return isInside ? 1 : box.bottom > 0 && box.top < innerHeight ? 2 : 3;
  };
  return nearby.sort((a, b) => rank(a) - rank(b)).map(({ name, nth, box }) => ({ name, nth, top: box.top }));
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
    .filter(({ initial, record: current }) => record.key(current) !== record.key(initial))
    .map(({ id, initial, record: current }) => ({ id, initial, record: current }));
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
    focus: focused && focused !== document.body ? { ...wayTo(focused), name: nameOf(focused) } : null,
    details: details.map((node) => ({ ...wayTo(node), open: node.open })),
    states: states(),
  };
}

/**
 * Scrolls so that the first mark that still exists is back at its position in the window.
 * @param {Kept} state
 */
export function place(state) {
  const existing = new Map(blocks().map(({ node, name, nth }) => [`${nth} ${name}`, node]));
  const mark = state.marks.find(({ name, nth }) => existing.has(`${nth} ${name}`));
  const node = mark && existing.get(`${mark.nth} ${mark.name}`);
  if (!node) return;
  const off = node.getBoundingClientRect().top - mark.top;
  if (Math.abs(off) >= 1) scrollBy({ top: off, behavior: "instant" });
}

/**
 * Opens the details that were open, and closes those that were closed.
 * @param {Kept} state
 */
export function unfold(state) {
  for (const details of state.details) {
    const node = at(details);
    if (node instanceof HTMLDetailsElement && node.open !== details.open) node.open = details.open;
  }
}

/**
 * Focuses the same element again; if it has moved, one with the same text.
 * @param {Kept} state
 */
function focus({ focus: mark }) {
  if (!mark) return;
  const node = at(mark);
  /** @param {Element | null} candidate */
  const same = (candidate) => candidate !== null && nameOf(candidate) === mark.name;
  const tag = /^[a-z][\w-]*(?=: )/.exec(mark.name)?.[0];
  const target = same(node) ? node : tag ? [...document.querySelectorAll(tag)].find(same) : null;
  if (target !== document.activeElement) /** @type {HTMLElement | null} */ (target)?.focus({ preventScroll: true });
}

/**
 * Returns figures to the author's state, as long as their initial state is the same as before.
 * @param {Kept} state
 */
function play({ states: entries }) {
  for (const { id, initial, record: target } of entries) {
    const { figures, record, sound } = /** @type {PageLadder} */ (ladder());
    const figure = figures.get(id);
    if (!figure || record.key(figure.initial) !== record.key(initial)) continue;
    if (record.key(figure.record) === record.key(target)) continue;
    const checked = sound(target, figure.initial, figure.spec);
    if (!checked.ignored.length) figure.ask(checked.record);
  }
}

/**
 * Restores everything that was kept.
 * @param {Kept} state
 */
export function restore(state) {
  unfold(state);
  play(state);
  place(state);
  focus(state);
}
