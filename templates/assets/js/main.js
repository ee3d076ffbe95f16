// Brings the page to life: figures and their parts, the theme button, links, cards, the runtime. Each is set up
// separately, so that one failure leaves the rest working.
/** @import { Overlay } from "./figure/overlay.js" */

import { sound } from "./base/checked_record.js";
import { apart, find, on } from "./base/dom.js";
import { limits } from "./base/limits.js";
import { decode, key, press } from "./base/record.js";
import { runDeck } from "./deck/deck.js";
import { addAnnouncer } from "./figure/announcer.js";
import { addButtons } from "./figure/buttons.js";
import { addControls } from "./figure/controls.js";
import { addPicks } from "./figure/crosshairs.js";
import { addEnlarging } from "./figure/enlarge.js";
import { addPictureButtons } from "./figure/export.js";
import { Figure } from "./figure/figure.js";
import { addHandles } from "./figure/handles.js";
import { addJobs } from "./figure/jobs.js";
import { addLinkButton, followLinks } from "./figure/links.js";
import { addMore } from "./figure/more.js";
import { createOverlay } from "./figure/overlay.js";
import { addOwnClouds } from "./figure/own_clouds.js";
import { drawing, onStage } from "./figure/panels.js";
import { addPins } from "./figure/pins.js";
import { addPrediction } from "./figure/predict.js";
import { showReadouts, showWords } from "./figure/readouts.js";
import { figures } from "./figure/registry.js";
import { addStatus } from "./figure/status.js";
import { addWarmUp } from "./figure/warm_up.js";
import { addCards, describeCards } from "./page/cards.js";
import { addCopying } from "./page/copying.js";
import { keepPlace } from "./page/place.js";
import { revealNamed } from "./page/reveal.js";
import { clear, isSaved, still } from "./page/saved_page.js";
import { addSearch, receiveSections } from "./page/search.js";
import { addCopyButton, addForgetButton } from "./page/storage.js";
import { addThemeButton } from "./page/theme.js";
import { keepOffline, offline } from "./runtime/offline.js";
import { runtime } from "./runtime/runtime.js";
import { startWhenSeen } from "./runtime/start.js";
import { loadTape, receiveTape } from "./runtime/tape.js";

const page = document.documentElement;
const FIGURES = "figure.figure:has(> script.figure-record)";
const FORMULAS = ".formula, .held.long";

/**
 * A figure's parts, in the order in which they receive its events.
 * @type {((figure: Figure, overlay: Overlay) => void)[]}
 */
const PARTS = [
  addAnnouncer,
  addStatus,
  addHandles,
  addPicks,
  addControls,
  addButtons,
  addMore,
  addEnlarging,
  addPrediction,
  showReadouts,
  showWords,
  addJobs,
  addOwnClouds,
  addPins,
  addLinkButton,
  ({ root, endMotion }) => addPictureButtons(root, endMotion),
  addWarmUp,
  ({ root }) => loadTape(root),
];

/**
 * @param {string} selector
 * @param {(node: HTMLElement) => void} setUp
 */
function setUpAll(selector, setUp) {
  const nodes = /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(selector));
  nodes.forEach((node) => apart(() => setUp(node)));
}

/** @param {HTMLElement} root */
function live(root) {
  const figure = new Figure(root);
  figures.set(figure.id, figure);
  const overlay = createOverlay(figure);
  const touch = () => {
    runtime.touched = figure.id;
  };
  for (const part of PARTS) apart(() => part(figure, overlay));
  on(root, "pointerdown", touch);
  on(root, "focusin", touch);
}

/** Tells figures when they enter or leave the viewport: runs pause off screen. */
function watch() {
  const observer = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const figure = figures.get(target.id);
      if (!figure) continue;
      figure.see(isIntersecting);
    }
  });
  for (const { root } of figures.values()) observer.observe(root);
}

/**
 * Scrolls the ladder so that the page's own rung is in the middle where not all rungs fit.
 * @param {HTMLElement} ladder
 */
function climb(ladder) {
  const step = ladder.querySelector("[aria-current]")?.closest("li");
  if (!step) return;
  ladder.scrollLeft = step.offsetLeft - (ladder.clientWidth - step.offsetWidth) / 2;
  ladder.scrollTop = step.offsetTop - (ladder.clientHeight - step.offsetHeight) / 2;
}

/**
 * A formula wider than its column scrolls, from the keyboard too: its box is focusable for as long as it is too wide.
 * A reader's own letter spacing widens what is in the box, not the box.
 * @param {Iterable<Element>} boxes
 */
function reach(boxes) {
  const fit = new ResizeObserver((entries) => {
    for (const { target } of entries) {
      const box = target.closest(FORMULAS) ?? target;
      if (box.scrollWidth > box.clientWidth) box.setAttribute("tabindex", "0");
      else box.removeAttribute("tabindex");
    }
  });
  for (const box of boxes) {
    fit.observe(box);
    for (const formula of box.children) fit.observe(formula);
  }
}

/**
 * In the margin of a wide page the chapter's contents stay open, and their summary is not a tab stop.
 * @param {HTMLElement} contents
 */
function unfold(contents) {
  const wide = matchMedia("(min-width: 75rem)");
  const fold = () => {
    contents.toggleAttribute("open", wide.matches);
    find(contents, "summary").tabIndex = wide.matches ? -1 : 0;
  };
  on(wide, "change", fold);
  fold();
}

/** Marks the script as loaded, perhaps after theme.js had given up on it. */
function arrive() {
  page.classList.add("js");
  page.dataset.script = "here";
  document.querySelector(".unscripted")?.remove();
}

/**
 * Calls back after the first paint, so that the text is readable first; at once if nothing will be painted (a hidden
 * page) or if a figure may be the first thing seen (a link into the page, a deck).
 * @param {(value: void) => void} callback
 */
function painted(callback) {
  if (document.hidden || location.hash || document.querySelector("main.deck")) callback();
  else requestAnimationFrame(() => setTimeout(callback));
}

/** Starts the figures and everything around them. Until now the parts far below had no layout (theme.js). */
function enliven() {
  page.classList.remove("unpainted");
  setUpAll(FIGURES, isSaved ? still : live);
  apart(watch);
  setUpAll("main.deck", runDeck); // before the cards: Escape closes one first
  apart(addCards);
  apart(revealNamed);
  apart(followLinks);
  apart(keepPlace);
  if (isSaved) return;
  apart(() => startWhenSeen(document.querySelectorAll(FIGURES)));
  apart(keepOffline);
}

arrive();
const alive = new Promise(painted).then(enliven);

/**
 * The page's only global: tape and search files call `tape` and `searchable`; the rest is for tests, measurements, the
 * preview and the console.
 */
globalThis.Ladder = Object.freeze({
  tape: receiveTape,
  searchable: receiveSections,
  alive,
  figures,
  runtime,
  limits,
  record: { decode, key, press },
  sound,
  drawing,
  onStage,
  offline,
  describeCards,
});

if (isSaved) apart(clear);
setUpAll("figure.plot", addPictureButtons);
setUpAll(".ladder", climb);
setUpAll(".contents details", unfold);
apart(() => reach(document.querySelectorAll(FORMULAS)));
setUpAll("button.theme", addThemeButton);
setUpAll("button.search-open", addSearch);
setUpAll(".stored", addForgetButton);
setUpAll("pre.copied", addCopyButton);
addCopying();
