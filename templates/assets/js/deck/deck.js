// A deck: its slides are sections in a column that can be scrolled. Keys, buttons, swipes and the address lead from one
// to another; the slide that is seen is always known from where the column stands.
import { on, text } from "../base/dom.js";
import { addKeys, addSwipes } from "./keys.js";
import { figures } from "../figure/registry.js";

/** A fragment as it was written; what cannot be decoded names nothing here. */
function decoded(fragment) {
  try {
    return decodeURI(fragment);
  } catch {
    return "";
  }
}

/** What goes with the current slide on other screens: the deck opened a second time follows, and leads. */
function together(deck) {
  if (!globalThis.BroadcastChannel || location.protocol === "file:") return { tell() {}, dispose() {} };
  const channel = new BroadcastChannel(`ladder-slides:${location.pathname}`);
  const heard = ({ data }) => {
    if (Number.isInteger(data.slide)) deck.go(data.slide, { told: true });
  };
  const off = on(channel, "message", heard);
  return {
    tell: (slide) => channel.postMessage({ slide }),
    dispose() {
      off();
      channel.close();
    },
  };
}

export function runDeck(root) {
  const page = document.documentElement;
  const slides = [...root.querySelectorAll(":scope > .slide")];
  const bar = document.querySelector(".deck-bar");
  const button = (what) => bar.querySelector(`[data-slides="${what}"]`);
  const place = bar.querySelector(".deck-at");
  const progress = bar.querySelector(".deck-progress");
  let now = 0; // the slide that is seen, from 0
  let ahead = 0; // the animation frame that will look where the column stands

  /** Tells which slide is seen, in words and by the bar. */
  function show(index) {
    now = index;
    text(place, `${index + 1} of ${slides.length}`);
    progress.style.setProperty("--part", (index / (slides.length - 1)).toFixed(4));
    slides.forEach((slide, i) => slide.classList.toggle("current", i === index));
    button("before").setAttribute("aria-disabled", String(index === 0));
    button("after").setAttribute("aria-disabled", String(index === slides.length - 1));
  }

  /** Puts the slide that is seen into the address. */
  const address = () => history.replaceState(history.state, "", `#${now + 1}`);

  const shown = (slide) => slide.scrollIntoView({ block: "start", behavior: "instant" });

  /**
   * Goes to a slide. focus: it takes the focus, so that keys and screen readers go on from there. jump: the way back
   * leads to the slide before. told: by another window, which knows.
   */
  function go(index, { focus = false, jump = false, told = false } = {}) {
    const to = Math.min(slides.length - 1, Math.max(0, index));
    if (jump && to !== now) history.pushState(null, "", `#${to + 1}`);
    const slide = slides[to];
    overview(false);
    shown(slide);
    if (to !== now) {
      show(to);
      address();
      if (!told) others.tell(to);
    }
    if (!focus) return;
    slide.tabIndex = -1;
    slide.focus({ preventScroll: true });
  }

  /** After a scroll by hand: the slide in the middle of the screen. */
  function look() {
    ahead = 0;
    if (page.dataset.slides === "grid") return;
    const middle = innerHeight / 2;
    const index = slides.findIndex((slide) => slide.getBoundingClientRect().bottom > middle);
    if (index < 0 || index === now) return;
    show(index);
    address();
    others.tell(index);
  }

  /** The slides have another size: the one that is seen stays, and its figure's handles find their places. */
  function rescaled() {
    shown(slides[now]);
    for (const figure of figures.values()) figure.emit("scaled");
  }

  /** All slides at once, small; what stands on them is out of reach meanwhile. */
  function overview(wanted) {
    if (wanted === (page.dataset.slides === "grid")) return;
    if (wanted) page.dataset.slides = "grid";
    else delete page.dataset.slides;
    button("grid").setAttribute("aria-pressed", String(wanted));
    for (const slide of slides) {
      for (const part of slide.querySelectorAll(".slide-inside > :not(h2, .slide-head)")) part.inert = wanted;
      slide.querySelector(".slide-open").tabIndex = wanted ? 0 : -1;
    }
    rescaled();
    if (wanted) slides[now].querySelector(".slide-open").focus({ preventScroll: true });
  }

  function notes(wanted) {
    page.dataset.notes = wanted ? "shown" : "hidden";
    button("notes").setAttribute("aria-pressed", String(wanted));
    rescaled();
  }

  function full() {
    if (document.fullscreenElement) document.exitFullscreen();
    else page.requestFullscreen().catch(() => {}); // refused: all stays as it is
  }

  const does = {
    before: (options) => step(-1, options),
    after: (options) => step(1, options),
    first: (options) => go(0, options),
    last: (options) => go(slides.length - 1, options),
    grid: () => overview(page.dataset.slides !== "grid"),
    notes: () => notes(page.dataset.notes !== "shown"),
    full,
    second: () => open(`${location.pathname}?notes#${now + 1}`, "ladder-notes", "popup,width=1280,height=800"),
  };

  /** The slide of whatever the address names: a number, or a figure with or without a state. */
  function addressed() {
    const name = decoded(location.hash.slice(1)).split("?")[0];
    const target = name && document.getElementById(name);
    return target ? slides.findIndex((slide) => slide.contains(target)) : -1;
  }

  /** The address stays as it is: it may hold a figure's state. */
  function linked() {
    const index = addressed();
    if (index < 0) return;
    overview(false);
    show(index);
    shown(slides[index]);
  }

  /** One on or back; in the overview the focus goes, and Enter picks. */
  function step(by, options) {
    if (page.dataset.slides !== "grid") return go(now + by, options);
    const at = slides.indexOf(document.activeElement.closest(".slide"));
    slides[Math.min(slides.length - 1, Math.max(0, at + by))].querySelector(".slide-open").focus();
  }

  const others = together({ go });
  const disposers = [
    addKeys(does),
    addSwipes(root, does),
    on(bar, "click", (event) => does[event.target.closest("[data-slides]")?.dataset.slides]?.({})),
    on(root, "click", (event) => {
      const link = event.target.closest(".slide-open");
      if (!link) return;
      event.preventDefault();
      go(slides.indexOf(link.closest(".slide")), { focus: true, jump: true });
    }),
    on(root, "focusin", (event) => {
      const index = slides.indexOf(event.target.closest(".slide"));
      if (page.dataset.slides !== "grid" && index >= 0 && index !== now) go(index);
    }),
    on(document, "scroll", () => (ahead ||= requestAnimationFrame(look)), { passive: true }),
    on(globalThis, "hashchange", linked),
    on(document, "fullscreenchange", () => {
      button("full").setAttribute("aria-pressed", String(Boolean(document.fullscreenElement)));
      shown(slides[now]);
    }),
    () => cancelAnimationFrame(ahead),
    others.dispose,
  ];
  button("full").hidden = !document.fullscreenEnabled;
  button("second").hidden = !globalThis.BroadcastChannel || location.protocol === "file:";
  show(Math.max(0, addressed()));
  notes(new URLSearchParams(location.search).has("notes"));
  return () => disposers.forEach((dispose) => dispose());
}
