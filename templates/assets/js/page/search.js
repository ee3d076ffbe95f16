// Search over all pages: a dialog with a field and a list. The library and the index load with the first query, as
// scripts, so that search works offline and from disk too.
/** @import { Found, Index } from "../base/types.js" */

import { around, loadScript, make, on, text } from "../base/dom.js";

const MOST = 20;
const CLOSEST = 8; // sections that have some of the words only
const BEFORE = 40; // characters of a snippet before the match
const LENGTH = 150;
const LONGEST = 200; // characters of a query,
const WORDS = 12; // and how many of its distinct words are searched, at most
const COMBINING = /\p{M}/gu;
const WORD = /[\p{L}\p{N}]+/gu;

/**
 * A letter without accents, in lower case; always one letter for one, so that offsets stay valid.
 * @param {string} letter
 */
const plainLetter = (letter) => letter.normalize("NFKD").replace(COMBINING, "").toLowerCase()[0] ?? letter;
/** @param {string} words */
const plain = (words) => Array.from(words, plainLetter).join("");

/** @param {string} words */
const tokens = (words) => plain(words.normalize("NFC")).match(WORD) ?? []; // pasted text may have combining accents

const OPTIONS = {
  fields: ["heading", "page", "text"],
  storeFields: ["at", "page", "heading", "text"],
  tokenize: tokens,
  processTerm: (/** @type {string} */ term) => term,
  searchOptions: {
    boost: { heading: 5, page: 2 },
    prefix: (/** @type {string} */ term, /** @type {number} */ i, /** @type {string[]} */ terms) => term.length > 2 || i === terms.length - 1, // few letters begin very many words
    fuzzy: (/** @type {string} */ term) => (term.length > 4 ? 1 : false),
    combineWith: "AND",
    tokenize: (/** @type {string} */ words) => [...new Set(tokens(words))].slice(0, WORDS),
  },
};

/** For a query whose words no section has together: any of its longer words. */
const ANY = {
  combineWith: "OR",
  boost: { heading: 2, page: 1 }, // one word in a heading weighs less than several in a text
  tokenize: (/** @type {string} */ words) => OPTIONS.searchOptions.tokenize(words).filter((word) => word.length > 2),
};

/** @type {Promise<Index> | null} */
let index = null; // set by the first query
/** @type {object[]} */
let sections = []; // the whole site's, until they are indexed

/**
 * Called by the file of the site's sections.
 * @param {[at: string, page: string, heading: string, words: string][]} entries
 */
export function receiveSections(entries) {
  sections = entries.map(([at, page, heading, words], id) => ({ id, at, page, heading, text: words }));
}

/** Loads the library and the sections once; a failed load is retried with the next query. */
function loaded() {
  index ??= (async () => {
    const { searchLibrary = "", searchData = "" } = document.body.dataset;
    sections = [];
    await Promise.all([loadScript(searchLibrary), loadScript(searchData)]);
    const made = new globalThis.MiniSearch(OPTIONS);
    made.addAll(sections);
    return made;
  })().catch((error) => {
    index = null;
    throw error;
  });
  return index;
}

/**
 * The text around the first matching word, as nodes, with all matching words marked.
 * @param {string} found
 * @param {string[]} terms
 */
function snippet(found, terms) {
  const folded = plain(found);
  const starts = terms.flatMap((term) => {
    const match = new RegExp(`(?<![\\p{L}\\p{N}])${term}`, "u").exec(folded);
    return match ? [match.index] : [];
  });
  const first = Math.max(0, Math.min(...starts, folded.length) === folded.length ? 0 : Math.min(...starts) - BEFORE);
  const from = first ? found.indexOf(" ", first) + 1 : 0;
  const end = from + LENGTH < found.length ? found.lastIndexOf(" ", from + LENGTH) : found.length;
  const piece = found.slice(from, end);
  /** @type {(string | Node)[]} */
  const nodes = [from ? "… " : ""];
  let at = 0;
  for (const { index: place, 0: word } of plain(piece).matchAll(WORD)) {
    if (!terms.includes(word)) continue;
    nodes.push(piece.slice(at, place), make("mark", {}, piece.slice(place, place + word.length)));
    at = place + word.length;
  }
  nodes.push(piece.slice(at), end < found.length ? " …" : "");
  return nodes.filter(Boolean);
}

/**
 * @param {Found} found
 * @param {number} i
 */
function option({ at, page, heading, text: words, terms }, i) {
  const title = make("span", { class: "found-title" }, heading || page);
  const where = make("span", { class: "found-page" }, heading && heading !== page ? page : "");
  const around = make("span", { class: "found-text" }, ...snippet(words, terms));
  return make("a", { role: "option", id: `found-${i}`, href: at, tabindex: "-1", "aria-selected": "false" }, title, " ", where, " ", around);
}

function dialog() {
  const field = make("input", {
    type: "text",
    maxlength: LONGEST,
    inputmode: "search",
    id: "search-field",
    role: "combobox",
    placeholder: "Search",
    autocomplete: "off",
    spellcheck: "false",
    enterkeyhint: "go",
    "aria-label": "Search all pages",
    "aria-expanded": "false",
    "aria-controls": "search-found",
    "aria-autocomplete": "list",
  });
  const list = make("div", { role: "listbox", id: "search-found", class: "found", "aria-label": "Results" });
  const told = make("p", { class: "search-told", role: "status" });
  const close = make("button", { type: "button", class: "search-close", "aria-label": "Close search" }, "Close");
  const box = make("dialog", { class: "search", "aria-label": "Search" }, make("div", { class: "search-head" }, field, close), told, list);
  let asked = 0;

  const options = () => /** @type {HTMLElement[]} */ ([...list.children]);
  const chosen = () => options().findIndex((each) => each.getAttribute("aria-selected") === "true");

  /** @param {number} i */
  function choose(i) {
    options().forEach((each, k) => each.setAttribute("aria-selected", String(k === i)));
    const node = options()[i];
    node?.scrollIntoView({ block: "nearest" });
    if (node) field.setAttribute("aria-activedescendant", node.id);
    else field.removeAttribute("aria-activedescendant");
  }

  /**
   * @param {Found[]} found
   * @param {string} words
   * @param {boolean} all whether the sections have all of the words
   */
  function show(found, words, all) {
    list.replaceChildren(...found.slice(0, MOST).map(option));
    list.hidden = !found.length;
    field.setAttribute("aria-expanded", String(found.length > 0));
    choose(found.length ? 0 : -1);
    const count = found.length === 1 ? "1 place" : `${found.length} places`;
    const which = all ? count + (found.length > MOST ? `; showing the first ${MOST}` : "") : "No section has all of these words; the closest";
    text(told, !words ? "" : found.length ? which : "Nothing found");
  }

  async function ask() {
    const words = field.value.trim();
    const mine = ++asked;
    try {
      const library = await loaded();
      if (mine !== asked) return;
      const found = words ? library.search(words) : [];
      if (found.length || !words) show(found, words, true);
      else show(library.search(words, ANY).slice(0, CLOSEST), words, false);
    } catch {
      if (mine === asked) text(told, "The search could not be loaded.");
    }
  }

  /** @param {KeyboardEvent} event */
  function key(event) {
    if (event.isComposing) return;
    const count = list.children.length;
    /** @type {Record<string, number>} */
    const moves = { ArrowDown: 1, ArrowUp: -1 };
    if (moves[event.key] && count) {
      event.preventDefault();
      choose((chosen() + moves[event.key] + count) % count);
    } else if (event.key === "Enter") {
      event.preventDefault();
      options()[chosen()]?.click();
    }
  }

  on(field, "input", ask);
  on(field, "keydown", key);
  on(close, "click", () => box.close());
  on(box, "click", (event) => {
    if (event.target === box || around(event, '[role="option"]')) box.close();
  });
  document.body.append(box);
  return () => {
    if (!box.open) box.showModal();
    field.focus();
    field.select();
    ask();
  };
}

/** @param {Event} event */
const writes = (event) => around(event, "input:not([type=range], [type=radio], [type=checkbox]), textarea, select, [contenteditable]");

/** @param {HTMLElement} button */
export function addSearch(button) {
  /** @type {(() => void) | null} */
  let open = null;
  const start = () => (open ??= dialog())();
  on(button, "click", start);
  on(document, "keydown", (/** @type {KeyboardEvent} */ event) => {
    const slash = event.key === "/" && !event.ctrlKey && !event.metaKey && !event.altKey && !writes(event);
    const k = event.key.toLowerCase() === "k" && (event.ctrlKey || event.metaKey);
    if (!slash && !k) return;
    event.preventDefault();
    start();
  });
}
