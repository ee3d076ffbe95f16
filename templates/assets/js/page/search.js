// Search over all pages: a dialog with a field and a list. The library and the index load with the first query, as
// scripts, so that search works offline and from disk too.
/** @import { Found, Index } from "../base/types.js" */

import { around, loadScript, make, on, text } from "../base/dom.js";
import { hasNewVersion } from "../base/version.js";

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
function loadIndex() {
  index ??= (async () => {
    const { searchLibrary = "", searchData = "" } = document.body.dataset;
    sections = [];
    await Promise.all([loadScript(searchLibrary), loadScript(searchData)]);
    if (!sections.length) throw new Error(`${searchData} holds no sections`); // a network's sign-in page, perhaps
    const library = new globalThis.MiniSearch(OPTIONS);
    library.addAll(sections);
    return library;
  })().catch((error) => {
    index = null;
    throw error;
  });
  return index;
}

/**
 * The text around the first matching word, as nodes, with all matching words marked.
 * @param {string} content
 * @param {string[]} terms
 */
function snippet(content, terms) {
  const folded = plain(content);
  const starts = terms.flatMap((term) => {
    const match = new RegExp(`(?<![\\p{L}\\p{N}])${term}`, "u").exec(folded);
    return match ? [match.index] : [];
  });
  const first = Math.max(0, Math.min(...starts, folded.length) === folded.length ? 0 : Math.min(...starts) - BEFORE);
  const from = first ? content.indexOf(" ", first) + 1 : 0;
  const end = from + LENGTH < content.length ? content.lastIndexOf(" ", from + LENGTH) : content.length;
  const piece = content.slice(from, end);
  /** @type {(string | Node)[]} */
  const nodes = [from ? "… " : ""];
  let at = 0;
  for (const { index: offset, 0: word } of plain(piece).matchAll(WORD)) {
    if (!terms.includes(word)) continue;
    nodes.push(piece.slice(at, offset), make("mark", {}, piece.slice(offset, offset + word.length)));
    at = offset + word.length;
  }
  nodes.push(piece.slice(at), end < content.length ? " …" : "");
  return nodes.filter(Boolean);
}

/**
 * @param {Found} found
 * @param {number} i
 */
function option({ at, page, heading, text: words, terms }, i) {
  const title = make("span", { class: "found-title" }, heading || page);
  const subtitle = make("span", { class: "found-page" }, heading && heading !== page ? page : "");
  const around = make("span", { class: "found-text" }, ...snippet(words, terms));
  return make("a", { role: "option", id: `found-${i}`, href: at, tabindex: "-1", "aria-selected": "false" }, title, " ", subtitle, " ", around);
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
  const status = make("p", { class: "search-told", role: "status" });
  const close = make("button", { type: "button", class: "search-close", "aria-label": "Close search" }, "Close");
  const box = make("dialog", { class: "search", "aria-label": "Search" }, make("div", { class: "search-head" }, field, close), status, list);
  let request = 0;
  /** @type {EventTarget | null} */
  let pressTarget = null; // where the last press began: a selection may end outside

  const options = () => /** @type {HTMLElement[]} */ ([...list.children]);
  const chosen = () => options().findIndex((node) => node.getAttribute("aria-selected") === "true");

  /** @param {number} i */
  function choose(i) {
    options().forEach((node, k) => node.setAttribute("aria-selected", String(k === i)));
    const node = options()[i];
    node?.scrollIntoView({ block: "nearest" });
    if (node) field.setAttribute("aria-activedescendant", node.id);
    else field.removeAttribute("aria-activedescendant");
  }

  /**
   * @param {Found[]} results
   * @param {string} words
   * @param {boolean} complete whether the sections have all of the words
   */
  function show(results, words, complete) {
    list.replaceChildren(...results.slice(0, MOST).map(option));
    list.hidden = !results.length;
    field.setAttribute("aria-expanded", String(results.length > 0));
    choose(results.length ? 0 : -1);
    const count = results.length === 1 ? "1 place" : `${results.length} places`;
    const summary = complete ? count + (results.length > MOST ? `; showing the first ${MOST}` : "") : "No section has all of these words; the closest";
    text(status, !words ? "" : results.length ? summary : "Nothing found");
  }

  function offerReload() {
    const reload = make("button", { type: "button", class: "button" }, "Reload");
    on(reload, "click", () => location.reload());
    status.replaceChildren("This site has been updated. ", reload);
  }

  async function ask() {
    const words = field.value.trim();
    const mine = ++request;
    if (words && !sections.length) text(status, "Loading.");
    try {
      const library = await loadIndex();
      if (mine !== request) return;
      const results = words ? library.search(words) : [];
      if (results.length || !words) show(results, words, true);
      else show(library.search(words, ANY).slice(0, CLOSEST), words, false);
    } catch {
      if (mine !== request) return;
      text(status, "The search could not be loaded.");
      if ((await hasNewVersion().catch(() => false)) && mine === request) offerReload();
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
      if (!event.repeat) options()[chosen()]?.click(); // still held from the button that opened the search
    }
  }

  on(field, "input", ask);
  on(field, "keydown", key);
  on(close, "click", () => box.close());
  on(box, "pointerdown", ({ target }) => (pressTarget = target));
  on(box, "click", (event) => {
    if ((event.target === box && pressTarget === box) || around(event, '[role="option"]')) box.close();
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
