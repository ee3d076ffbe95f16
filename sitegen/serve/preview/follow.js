/* Keeps the page in step with the builds of `python3 build.py serve`, which alone adds it; published pages lack it. */

import { elsewhere, hide, problems } from "./messages.js";
import { keep, ladder, place, restore, unfold } from "./place.js";
import { same, swap } from "./swap.js";

/** @import { BuildState, Kept } from "./types.js" */

const KEPT = "ladder-preview";
let currentBuild = buildOf(document);
/** @type {Document | null} the page as built, before scripts changed it */
let source = null;
/** @type {EventSource | null} */
let events = null;
let reloading = false;

async function fetched() {
  const answer = await fetch(location.pathname + location.search, { cache: "no-cache" });
  return new DOMParser().parseFromString(await answer.text(), "text/html");
}

/**
 * The name of the build that made a page.
 * @param {Document} page
 */
function buildOf(page) {
  return /** @type {HTMLScriptElement | null} */ (page.querySelector("script[data-build]"))?.dataset.build;
}

const pageName = () => location.pathname.split("/").at(-1) || "index.html";

function reload() {
  reloading = true;
  try {
    sessionStorage.setItem(KEPT, JSON.stringify(keep()));
  } catch {
    // storage is forbidden or full: the page returns at its top
  }
  location.reload();
}

/**
 * Brings the page up to date with a published build, with as little disturbance as possible.
 * @param {BuildState} state
 */
async function update({ build, edited }) {
  if (build === currentBuild || reloading) return;
  const fresh = await fetched();
  if (!source || (!same(source, fresh) && !swap(source, fresh))) return reload();
  [source, currentBuild] = [fresh, buildOf(fresh)];
  const [edit] = edited;
  if (edit && edited.every(({ page }) => page !== pageName())) elsewhere(edit.page, edit.file);
}

let last = Promise.resolve();
function open() {
  events = new EventSource("/.ladder/events");
  events.onmessage = ({ data }) => {
    /** @type {BuildState} */
    const state = JSON.parse(data);
    hide();
    if (state.lines.length) problems(state.title, state.lines);
    else last = last.then(() => update(state)).catch(() => {}); // server down: the next message comes with it
  };
}

// A browser allows six connections per server, so a hidden page releases its own.
function follow() {
  if (document.hidden) {
    events?.close();
    events = null;
  } else if (!events) open();
}

/**
 * After a reload: scrolls to the author's place before the first paint, and keeps it until fonts and pictures have
 * loaded. The rest waits for the figures, whose buttons cannot be focused earlier.
 */
async function comeBack() {
  /** @type {Kept | null} */
  let state = null;
  try {
    state = JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
    sessionStorage.removeItem(KEPT);
  } catch {
    // storage is forbidden: nothing was kept
  }
  if (state?.page !== location.pathname) return;
  unfold(state);
  place(state);
  const movement = new AbortController();
  for (const type of ["wheel", "touchstart", "pointerdown", "keydown"]) {
    addEventListener(type, () => movement.abort(), { once: true, passive: true, signal: movement.signal });
  }
  const hold = () => movement.signal.aborted || place(state);
  document.fonts.ready.then(hold);
  addEventListener("load", hold, { once: true });
  await ladder()?.alive;
  restore(state);
}

const back = comeBack();
addEventListener("pagehide", () => {
  history.scrollRestoration = reloading ? "manual" : "auto"; // the browser's own restoration goes by pixels
  events?.close();
  events = null;
});
addEventListener("pageshow", ({ persisted }) => persisted && follow());
Promise.all([fetched(), back]).then(
  ([page]) => {
    source = page;
    if (buildOf(page) !== currentBuild) return reload();
    document.addEventListener("visibilitychange", follow);
    follow();
  },
  () => {}, // the server is down
);
