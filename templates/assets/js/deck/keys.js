// Moves a deck by key, unless the focused element uses the key itself, and by swipe, unless it begins on something that
// can be dragged.

import { around, on } from "../base/dom.js";

const ARROWS = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"];
const PAGES = ["PageUp", "PageDown", "Home", "End"];
const SWIPE = 48; // px across

/**
 * Elements that use keys themselves: [selector, keys], or null for all keys.
 * @type {[selector: string, keys: string[] | null][]}
 */
const USES = [
  ["dialog, select, textarea, [contenteditable], input:not([type=range], [type=radio], [type=checkbox])", null],
  ["input[type=range]", [...ARROWS, ...PAGES]],
  ["input[type=radio]", [...ARROWS, " "]],
  [".handle, .crosshair", [...ARROWS, " "]],
  ["button, summary, input[type=checkbox], a", [" "]],
];

/** @type {(target: Element, key: string) => boolean} */
function usesKey(target, key) {
  if (USES.some(([selector, keys]) => target.closest(selector) && (!keys || keys.includes(key)))) return true;
  const box = target.closest("[tabindex='0']"); // a table or a formula that scrolls
  return Boolean(box && [...ARROWS, ...PAGES, " "].includes(key) && scrolls(box));
}

/** @param {Element} box */
const scrolls = (box) => box.scrollWidth > box.clientWidth || box.scrollHeight > box.clientHeight;

/** @typedef {{ focus?: boolean, jump?: boolean, told?: boolean }} Options  of a step (see deck.js) */
/** @typedef {Record<string, (options: Options) => void>} Steps */

/** @type {Record<string, string>} */
const KEYS = {
  ArrowRight: "after",
  ArrowDown: "after",
  PageDown: "after",
  " ": "after",
  ArrowLeft: "before",
  ArrowUp: "before",
  PageUp: "before",
  "Shift+ ": "before",
  Home: "first",
  End: "last",
  Escape: "grid",
  f: "full",
  n: "notes",
};

/** Keys that scroll first, if the slide has more to show that way. @type {Record<string, number>} */
const SCROLLS = { ArrowDown: 1, PageDown: 1, " ": 1, ArrowUp: -1, PageUp: -1, "Shift+ ": -1 };
const TOGGLES = ["grid", "notes", "full"];

/**
 * steps: actions by name. goesOn: whether the slide has more to scroll to, downwards (1) or upwards (-1).
 * @param {Steps} steps
 * @param {(by: number) => boolean} goesOn
 */
export function addKeys(steps, goesOn) {
  on(document, "keydown", (/** @type {KeyboardEvent} */ event) => {
    const { key } = event;
    const target = /** @type {Element} */ (event.target);
    if (event.defaultPrevented || event.altKey || event.ctrlKey || event.metaKey || event.isComposing) return;
    const name = event.shiftKey && key === " " ? "Shift+ " : key.length === 1 ? key.toLowerCase() : key;
    const step = KEYS[name];
    if (!step || usesKey(target, key)) return;
    if (key === "Escape" && document.querySelector(".card:not([hidden])")) return; // Escape closes the card first
    if (SCROLLS[name] && goesOn(SCROLLS[name])) return;
    event.preventDefault();
    if (event.repeat && TOGGLES.includes(step)) return;
    steps[step]({ focus: true, jump: step === "first" || step === "last" });
  });
}

/**
 * Handles horizontal swipes with one finger. Vertical ones scroll the page as usual.
 * @param {HTMLElement} root
 * @param {Steps} steps
 */
export function addSwipes(root, steps) {
  const DRAGGED = ".figure-stage, input, pre, .table, .formula[tabindex], .runs-scroll";
  /** @type {[pointer: number, x: number, y: number] | null} */
  let from = null;

  on(root, "pointerdown", (/** @type {PointerEvent} */ event) => {
    const alone = event.isPrimary && (visualViewport?.scale ?? 1) === 1;
    const begins = event.pointerType === "touch" && alone && !around(event, DRAGGED);
    from = begins ? [event.pointerId, event.clientX, event.clientY] : null;
  });
  on(root, "pointerup", (/** @type {PointerEvent} */ event) => {
    if (!from || from[0] !== event.pointerId) return;
    const [, x, y] = from;
    const [across, down] = [event.clientX - x, event.clientY - y];
    from = null;
    if (Math.abs(across) < SWIPE || Math.abs(across) < 2 * Math.abs(down)) return;
    steps[across < 0 ? "after" : "before"]({ focus: true });
  });
}
