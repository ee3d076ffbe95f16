// Copied text: browsers put each symbol of a formula on a line of its own and drop what raises or lowers it. Here a
// formula is one line: its TeX if the page has that, otherwise with _ and ^ as in TeX.
import { make, on } from "../base/dom.js";

/** @type {Record<string, string>} */
const ACCENTS = { "~": "\u0303", "‾": "\u0304", ˆ: "\u0302" };

/** @param {string} words */
const group = (words) => (words.length > 1 ? `{${words}}` : words);

/**
 * @param {Element} node
 * @returns {string}
 */
function line(node) {
  const { localName: name, textContent: words } = node;
  const parts = [...node.children].map(line);
  const [base, first, second] = parts;
  if (name === "annotation") return words;
  if (name === "semantics") return parts[1];
  if (name === "mfrac") return `${group(base)}/${group(first)}`;
  if (name === "msqrt") return `√${group(parts.join(""))}`;
  if (name === "msup" || name === "mover") return base + (ACCENTS[first] ?? `^${group(first)}`);
  if (/^m(sub|under)/.test(name)) return `${base}_${group(first)}${second ? `^${group(second)}` : ""}`;
  if (name === "mspace") return node.hasAttribute("width") ? " " : ""; // without one, after an upright capital, it is empty
  return parts.join("") || words;
}

/**
 * A name applied to what follows, as in log n, is set off from that unless a bracket does so.
 * @param {Element} formula
 */
const written = (formula) => line(formula).replace(/\u2061(?=[(}]|$)/g, "").replaceAll("\u2061", " ");

/** For as long as the browser takes the text, each formula in it stands there as a line. */
function copied() {
  const selection = /** @type {Selection} */ (getSelection());
  const formulas = [...document.querySelectorAll("math")].filter((formula) => selection.containsNode(formula, true));
  if (!formulas.length) return;
  const range = selection.getRangeAt(0).cloneRange();
  if (range.commonAncestorContainer instanceof Text) return; // a part of one symbol
  /** Chromium's selection does not follow what is inserted and removed, as a range does. */
  const select = () => {
    selection.removeAllRanges();
    selection.addRange(range);
  };
  for (const formula of formulas) {
    const words = make("span", {}, written(formula));
    if (formula.contains(range.startContainer)) range.setStartBefore(formula);
    formula.before(words);
    formula.style.display = "none";
    setTimeout(() => {
      words.remove();
      formula.style.display = "";
    });
  }
  select();
  setTimeout(select);
}

export const addCopying = () => void on(document, "copy", copied);
