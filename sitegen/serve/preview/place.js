/* Where the author is in a page: kept as plain data, and brought back once the page is another one. */

const TOLD = 200; // characters by which a block is known again
const AROUND = 5; // blocks above and below the window that count where none in it is left
const BLOCKS = "main :is(h1, h2, h3, h4, p, li, dt, dd, pre, tr, .equation, figure)";

/** A thing's own name: its id, else what it is and says. Names are not unique. */
const named = (node) => (node.id ? `#${node.id}` : `${node.localName}: ${node.textContent.trim().slice(0, TOLD)}`);

/** The way to an element: the nearest id, and from there the place among each parent's children. */
function wayTo(node) {
  const steps = [];
  while (!node.id && node.parentElement) {
    steps.unshift([...node.parentElement.children].indexOf(node));
    node = node.parentElement;
  }
  return { id: node.id, steps };
}

function at({ id, steps }) {
  const from = id ? document.getElementById(id) : document.documentElement;
  return steps.reduce((node, i) => node?.children[i], from) ?? null;
}

/** The blocks of the text in order, each with its name and how many of that name stand before it. What figures say
 * changes as they are used, so a figure is one block. */
function blocks() {
  const count = new Map();
  return [...document.querySelectorAll(BLOCKS)]
    .filter((node) => !node.parentElement.closest("figure"))
    .map((node) => {
      const name = named(node);
      const nth = count.get(name) ?? 0;
      count.set(name, nth + 1);
      return { node, name, nth };
    });
}

/** Blocks to find the place by, the best first: what is focused, what begins in the window, what else is in or near it. */
function marks() {
  const all = blocks().map((block) => ({ ...block, box: block.node.getBoundingClientRect() }));
  const seen = all.filter(({ box }) => box.height > 0);
  const first = seen.findIndex(({ box }) => box.bottom > 0);
  if (first < 0) return [];
  const last = seen.findLastIndex(({ box }) => box.top < innerHeight);
  const near = seen.slice(Math.max(0, first - AROUND), last + 1 + AROUND);
  const rank = ({ node, box }) => {
    const inside = box.top >= 0 && box.top < innerHeight;
    if (inside && node.contains(document.activeElement) && document.activeElement !== document.body) return 0;
    return inside ? 1 : box.bottom > 0 && box.top < innerHeight ? 2 : 3;
  };
  return near.sort((a, b) => rank(a) - rank(b)).map(({ name, nth, box }) => ({ name, nth, top: box.top }));
}

/** Figures that the author has changed: what they show, and what they showed first. */
function states() {
  const { figures, record } = globalThis.Ladder ?? { figures: new Map() };
  return [...figures.values()]
    .filter(({ initial, record: wanted }) => record.key(wanted) !== record.key(initial))
    .map(({ id, initial, record: wanted }) => ({ id, initial, record: wanted }));
}

/** Where the author is, for `restore`. */
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

/** Scrolls so that the first mark that is still there stands where it stood in the window. */
export function place(kept) {
  const there = new Map(blocks().map(({ node, name, nth }) => [`${nth} ${name}`, node]));
  const mark = kept.marks.find(({ name, nth }) => there.has(`${nth} ${name}`));
  if (!mark) return;
  const off = there.get(`${mark.nth} ${mark.name}`).getBoundingClientRect().top - mark.top;
  if (Math.abs(off) >= 1) scrollBy({ top: off, behavior: "instant" });
}

function unfold(kept) {
  for (const each of kept.details) {
    const node = at(each);
    if (node?.localName === "details" && node.open !== each.open) node.open = each.open;
  }
}

/** Focus goes to the very element; where it has moved, to the one that says the same. */
function focus({ focus: kept }) {
  if (!kept) return;
  const node = at(kept);
  const same = (each) => each && named(each) === kept.name;
  const tag = /^[a-z][\w-]*(?=: )/.exec(kept.name)?.[0];
  const found = same(node) ? node : tag ? [...document.querySelectorAll(tag)].find(same) : null;
  if (found !== document.activeElement) found?.focus({ preventScroll: true });
}

/** Figures go back to what the author made of them, as long as they begin where they began. */
function play({ states: kept }) {
  for (const { id, initial, record: wanted } of kept) {
    const { figures, record, sound } = globalThis.Ladder;
    const figure = figures.get(id);
    if (!figure || record.key(figure.initial) !== record.key(initial)) continue;
    if (record.key(figure.record) === record.key(wanted)) continue;
    const checked = sound(wanted, figure.initial, figure.spec);
    if (!checked.ignored.length) figure.ask(checked.record);
  }
}

/** Brings back all that was kept. */
export function restore(kept) {
  unfold(kept);
  play(kept);
  place(kept);
  focus(kept);
}
