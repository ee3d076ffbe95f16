// A deck: its slides are sections in a scrolling column. Keys, buttons, swipes and the address move between them; the
// current slide always follows from the scroll position.
/** @import { Options, Steps } from "./keys.js" */

import { named } from "../base/address.js";
import { around, find, findButton, on, text } from "../base/dom.js";
import { addKeys, addSwipes } from "./keys.js";
import { figures } from "../figure/registry.js";

/**
 * Keeps the deck in step with a second window of it, in both directions. Returns the channel that sends it the current
 * slide; null where there is none, as where the browser forbids storage.
 * @param {(slide: number, options: Options) => void} go
 */
function shared(go) {
  if (location.protocol === "file:") return null;
  try {
    const channel = new BroadcastChannel(`ladder-slides:${location.pathname}`);
    on(channel, "message", (/** @type {MessageEvent} */ { data }) => {
      if (Number.isInteger(data.slide)) go(data.slide, { told: true });
    });
    return channel;
  } catch {
    return null;
  }
}

/** @param {HTMLElement} root */
export function runDeck(root) {
  const page = document.documentElement;
  const slides = /** @type {HTMLElement[]} */ ([...root.querySelectorAll(":scope > .slide")]);
  const bar = find(document, ".deck-bar");
  /** @param {string} name */
  const button = (name) => findButton(bar, `[data-slides="${name}"]`);
  const counter = bar.querySelector(".deck-at");
  const progress = find(bar, ".deck-progress");
  let current = 0; // the current slide, from 0
  let marked = 0; // the slide that last had the focus in the overview
  let byPointer = false; // whether the reader acted with a pointer last, and not with a key
  let frameRequest = 0; // the animation frame that will check the scroll position

  /**
   * Shows which slide is current, in words and on the progress bar.
   * @param {number} index
   */
  function show(index) {
    current = index;
    text(counter, `${index + 1} of ${slides.length}`);
    progress.style.setProperty("--part", (index / (slides.length - 1)).toFixed(4));
    slides.forEach((slide, i) => slide.classList.toggle("current", i === index));
    button("before").setAttribute("aria-disabled", String(index === 0));
    button("after").setAttribute("aria-disabled", String(index === slides.length - 1));
  }

  /** Writes the current slide into the address. */
  const address = () => history.replaceState(history.state, "", `#${current + 1}`);

  /** @param {HTMLElement} slide */
  const reveal = (slide) => slide.scrollIntoView({ block: "start", behavior: "instant" });

  /**
   * Goes to a slide. focus: it takes the focus, so that keys and screen readers go on from there. jump: Back returns to
   * the previous slide. told: another window asked for it, so it is not sent back.
   * @param {number} index
   * @param {Options} [options]
   */
  function go(index, { focus = false, jump = false, told: remote = false } = {}) {
    const to = Math.min(slides.length - 1, Math.max(0, index));
    if (jump && to !== current) history.pushState(null, "", `#${to + 1}`);
    const slide = slides[to];
    overview(false);
    reveal(slide);
    if (to !== current) {
      show(to);
      address();
      if (!remote) tell(to);
    }
    if (!focus) return;
    slide.tabIndex = -1;
    slide.focus({ preventScroll: true });
  }

  /** After a manual scroll, makes the slide in the middle of the viewport the current one. */
  function look() {
    frameRequest = 0;
    if (page.dataset.slides === "grid") return;
    const middle = innerHeight / 2;
    const index = slides.findIndex((slide) => slide.getBoundingClientRect().bottom > middle);
    if (index < 0 || index === current) return;
    show(index);
    address();
    tell(index);
  }

  /** After a change of the slides' size, scrolls back to the current slide and realigns the figures' handles. */
  function rescaled() {
    reveal(slides[current]);
    for (const figure of figures.values()) figure.rescaled();
  }

  /**
   * Shows all slides at once, small, with their contents inert; or returns to the current slide.
   * @param {boolean} active
   */
  function overview(active) {
    if (active === (page.dataset.slides === "grid")) return;
    if (active) page.dataset.slides = "grid";
    else delete page.dataset.slides;
    button("grid").setAttribute("aria-pressed", String(active));
    for (const slide of slides) {
      const parts = slide.querySelectorAll(".slide-inside > :not(h2, .slide-head)");
      for (const part of /** @type {NodeListOf<HTMLElement>} */ (parts)) part.inert = active;
      find(slide, ".slide-open").tabIndex = active ? 0 : -1;
    }
    rescaled();
    const reached = active ? find(slides[current], ".slide-open") : slides[current];
    marked = current;
    if (!active) reached.tabIndex = -1;
    if (active || document.activeElement?.matches("body, .slide-open")) reached.focus({ preventScroll: true });
  }

  /** @param {boolean} visible */
  function notes(visible) {
    page.dataset.notes = visible ? "shown" : "hidden";
    button("notes").setAttribute("aria-pressed", String(visible));
    rescaled();
  }

  function full() {
    if (document.fullscreenElement) document.exitFullscreen();
    else page.requestFullscreen().catch(() => {}); // refused: nothing changes
  }

  /** @type {Steps} */
  const steps = {
    before: (options) => step(-1, options),
    after: (options) => step(1, options),
    first: (options) => reach(0, options),
    last: (options) => reach(slides.length - 1, options),
    grid: () => overview(page.dataset.slides !== "grid"),
    notes: () => notes(page.dataset.notes !== "shown"),
    full,
    second: () => open(`${location.pathname}?notes#${current + 1}`, "ladder-notes", "popup,width=1280,height=800"),
  };

  /** The index of the slide that the address names: a number, or a figure with or without a state; -1 without one. */
  function addressed() {
    const target = named();
    return target ? slides.findIndex((slide) => slide.contains(target)) : -1;
  }

  /** @param {EventTarget | null} node */
  function slideAround(node) {
    const slide = node instanceof Element ? node.closest(".slide") : null;
    return slides.findIndex((candidate) => candidate === slide);
  }

  /** Follows a change of the address, and leaves it as it is: it may hold a figure's state. */
  function linked() {
    const index = addressed();
    if (index < 0) return;
    const another = index !== current;
    overview(false);
    show(index);
    reveal(slides[index]);
    if (another) tell(index);
  }

  /** After a resize, scrolls the current slide back to the middle before `look` takes another one for current. */
  function resized() {
    if (page.dataset.slides === "grid") return;
    const { top, bottom } = slides[current].getBoundingClientRect();
    const middle = innerHeight / 2;
    if (top > middle || bottom <= middle) reveal(slides[current]);
  }

  /**
   * Whether a slide taller than the viewport has more to scroll to, downwards (by > 0) or upwards.
   * @param {number} by
   */
  function goesOn(by) {
    if (page.dataset.slides === "grid") return false;
    const { top, bottom } = slides[current].getBoundingClientRect();
    return by > 0 ? bottom > innerHeight + 1 : top < -1;
  }

  /**
   * Goes to a slide; in the overview only the focus moves, and Enter picks.
   * @param {number} index
   * @param {Options} options
   */
  function reach(index, options) {
    if (page.dataset.slides !== "grid") return go(index, options);
    marked = Math.min(slides.length - 1, Math.max(0, index));
    find(slides[marked], ".slide-open").focus();
  }

  /** @type {(by: number, options: Options) => void} */
  const step = (by, options) => reach((page.dataset.slides === "grid" ? marked : current) + by, options);

  const channel = shared(go);
  const tell = (/** @type {number} */ slide) => channel?.postMessage({ slide });
  addKeys(steps, goesOn);
  addSwipes(root, steps);
  on(bar, "click", (event) => steps[around(event, "[data-slides]")?.dataset.slides ?? ""]?.({}));
  on(root, "click", (event) => {
    const link = around(event, ".slide-open");
    if (!link) return;
    event.preventDefault();
    go(slideAround(link), { focus: true, jump: true });
  });
  on(root, "focusin", (event) => {
    const index = slideAround(event.target);
    if (page.dataset.slides === "grid") marked = index;
    else if (index >= 0 && index !== current && !byPointer) go(index); // what is pressed stays under the pointer
  });
  on(document, "pointerdown", () => (byPointer = true), { capture: true });
  on(document, "keydown", () => (byPointer = false), { capture: true });
  on(document, "scroll", () => (frameRequest ||= requestAnimationFrame(look)), { passive: true });
  on(globalThis, "resize", resized);
  on(globalThis, "hashchange", linked);
  on(document, "fullscreenchange", () => {
    button("full").setAttribute("aria-pressed", String(Boolean(document.fullscreenElement)));
    reveal(slides[current]);
  });
  button("full").hidden = !document.fullscreenEnabled;
  button("second").hidden = !channel;
  show(Math.max(0, addressed()));
  notes(new URLSearchParams(location.search).has("notes"));
}
