// Brings the page to life: its figures with their parts, the theme's button, links, cards, the runtime's start. Each is
// set up apart, so that one that fails leaves the others.
/** @import { Overlay } from "./figure/overlay.js" */

import { sound } from "./base/checked_record.js";
import { apart, find, on } from "./base/dom.js";
import { limits } from "./base/limits.js";
import * as record from "./base/record.js";
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
import { revealNamed } from "./page/reveal.js";
import { addSearch, receiveSections } from "./page/search.js";
import { addCopyButton, addForgetButton } from "./page/storage.js";
import { addThemeButton } from "./page/theme.js";
import { keepOffline, offline } from "./runtime/offline.js";
import { runtime } from "./runtime/runtime.js";
import { startWhenSeen } from "./runtime/start.js";
import { loadTape, receiveTape } from "./runtime/tape.js";

const page = document.documentElement;
const FIGURES = "figure.figure:has(> script.figure-record)";

/**
 * A figure's parts, in the order in which they hear of what happens to it.
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
  ({ root }) => addPictureButtons(root),
  addWarmUp,
  ({ root }) => loadTape(root),
];

/**
 * @param {string} selector
 * @param {(node: HTMLElement) => void} setUp
 */
function each(selector, setUp) {
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

/** Figures know whether they are on screen: runs pause off it. */
function watch() {
  const seen = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const figure = figures.get(target.id);
      if (!figure) continue;
      figure.see(isIntersecting);
    }
  });
  for (const { root } of figures.values()) seen.observe(root);
}

/**
 * Where not all rungs fit, the page's own is in the middle.
 * @param {HTMLElement} ladder
 */
function climb(ladder) {
  const step = ladder.querySelector("[aria-current]")?.closest("li");
  if (!step) return;
  ladder.scrollLeft = step.offsetLeft - (ladder.clientWidth - step.offsetWidth) / 2;
  ladder.scrollTop = step.offsetTop - (ladder.clientHeight - step.offsetHeight) / 2;
}

/**
 * An equation wider than its column scrolls, by key as well: it can be focused for as long as it is too wide.
 * @param {Iterable<Element>} formulas
 */
function reach(formulas) {
  const fit = new ResizeObserver((entries) => {
    for (const { target } of entries) {
      if (target.scrollWidth > target.clientWidth) target.setAttribute("tabindex", "0");
      else target.removeAttribute("tabindex");
    }
  });
  for (const formula of formulas) fit.observe(formula);
}

/**
 * In the margin of a wide page the chapter's contents are all to be seen: open, and no stop to fold them.
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

/** The script has come, perhaps after theme.js had given it up. */
function arrive() {
  page.classList.add("js");
  page.dataset.script = "here";
  document.querySelector(".unscripted")?.remove();
}

/**
 * Once the page has been painted, so that reading comes first. At once where nothing is painted (a hidden page), or where
 * what is to be seen is a figure's (a link into the page, a deck).
 * @param {(value: void) => void} then
 */
function painted(then) {
  if (document.hidden || location.hash || document.querySelector("main.deck")) then();
  else requestAnimationFrame(() => setTimeout(then));
}

/** The figures, and all that goes on with them. What is far below has been left without a layout until now (theme.js). */
function enliven() {
  page.classList.remove("unpainted");
  each(FIGURES, live);
  apart(watch);
  each("main.deck", runDeck); // before the cards: Escape closes one first
  apart(addCards);
  apart(revealNamed);
  apart(followLinks);
  apart(() => startWhenSeen(document.querySelectorAll(FIGURES)));
  apart(keepOffline);
}

arrive();
const alive = new Promise(painted).then(enliven);

/**
 * All that the page shows of itself to the outside: the files of tapes and of the search call `tape` and `searchable`; the
 * rest is for whoever looks in (tests, measurements, the preview, a console).
 */
globalThis.Ladder = Object.freeze({
  tape: receiveTape,
  searchable: receiveSections,
  alive,
  figures,
  runtime,
  limits,
  record,
  sound,
  drawing,
  onStage,
  offline,
  describeCards,
});

each("figure.graph", addPictureButtons);
each(".ladder", climb);
each(".contents details", unfold);
apart(() => reach(document.querySelectorAll(".formula")));
each("button.theme", addThemeButton);
each("button.search-open", addSearch);
each(".stored", addForgetButton);
each("pre.copied", addCopyButton);
