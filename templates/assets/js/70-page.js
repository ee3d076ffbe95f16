// Brings the page to life: its figures with their parts, the theme's button, links, cards, the runtime's start. Each is
// set up apart, so that one that fails leaves the others.
(() => {
  "use strict";

  const { apart, figures, on, runtime } = Ladder;
  const page = document.documentElement;
  const FIGURES = "figure.figure:has(> script.figure-record)";

  /** A figure's part: what takes it away again, also where there was nothing to set up. */
  const part = (setUp) => apart(setUp) ?? (() => {});
  const each = (selector, setUp) => document.querySelectorAll(selector).forEach((node) => apart(() => setUp(node)));

  function live(root) {
    const figure = new Ladder.Figure(root);
    figures.set(figure.id, figure);
    const overlay = Ladder.overlay(figure);
    const touch = () => {
      runtime.touched = figure.id;
    };
    figure.voice = Ladder.voice(figure);
    figure.disposers.push(
      figure.voice.dispose,
      part(() => Ladder.status(figure)),
      part(() => Ladder.handles(figure, overlay)),
      part(() => Ladder.picks(figure, overlay)),
      part(() => Ladder.controls(figure)),
      part(() => Ladder.buttons(figure)),
      part(() => Ladder.showReadouts(figure)),
      part(() => Ladder.showWords(figure)),
      part(() => Ladder.jobs(figure)),
      part(() => Ladder.own(figure, overlay)),
      part(() => Ladder.pins(figure)),
      part(() => Ladder.linkButton(figure)),
      part(() => Ladder.pictures(root)),
      part(() => Ladder.loadTape(figure)),
      overlay.dispose,
      on(root, "pointerdown", touch),
      on(root, "focusin", touch),
      () => figures.delete(figure.id),
    );
  }

  /** Figures know whether they are on screen: runs pause off it. */
  function watch() {
    const seen = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const figure = figures.get(target.id);
        if (!figure) continue;
        figure.visible = isIntersecting;
        figure.warm();
        figure.emit("seen");
      }
    });
    for (const { root } of figures.values()) seen.observe(root);
  }

  /** Where not all rungs fit, the page's own is in the middle. */
  function climb(ladder) {
    const step = ladder.querySelector("[aria-current]")?.closest("li");
    if (!step) return;
    ladder.scrollLeft = step.offsetLeft - (ladder.clientWidth - step.offsetWidth) / 2;
    ladder.scrollTop = step.offsetTop - (ladder.clientHeight - step.offsetHeight) / 2;
  }

  /** An equation wider than its column scrolls, by key as well: it can be focused for as long as it is too wide. */
  function reach(formulas) {
    const fit = new ResizeObserver((entries) => {
      for (const { target } of entries) {
        if (target.scrollWidth > target.clientWidth) target.tabIndex = 0;
        else target.removeAttribute("tabindex");
      }
    });
    for (const formula of formulas) fit.observe(formula);
  }

  /** In the margin of a wide page the chapter's contents are all to be seen: open, and no stop to fold them. */
  function unfold(contents) {
    const wide = matchMedia("(min-width: 75rem)");
    const fold = () => {
      contents.open = wide.matches;
      contents.querySelector("summary").tabIndex = wide.matches ? -1 : 0;
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

  arrive();
  each(FIGURES, live);
  each("figure.graph", Ladder.pictures);
  apart(watch);
  each(".ladder", climb);
  each(".contents details", unfold);
  apart(() => reach(document.querySelectorAll(".formula")));
  each("button.theme", Ladder.theme);
  each("button.search-open", Ladder.search);
  each(".stored", Ladder.stored);
  each("pre.copied", Ladder.copied);
  each("main.deck", Ladder.slides); // before the cards: Escape closes one first
  apart(Ladder.cards);
  apart(Ladder.links);
  apart(() => Ladder.startWhenSeen(document.querySelectorAll(FIGURES)));
  apart(Ladder.keepOffline);
})();
