// Brings the page to life: its figures with their parts, the theme's button, links, cards, the runtime's start.
(() => {
  "use strict";

  const { figures, on, runtime } = Ladder;

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
      Ladder.status(figure),
      Ladder.handles(figure, overlay),
      Ladder.picks(figure, overlay),
      Ladder.controls(figure),
      Ladder.buttons(figure),
      Ladder.showReadouts(figure),
      Ladder.showWords(figure),
      Ladder.jobs(figure),
      Ladder.own(figure, overlay),
      Ladder.pins(figure),
      Ladder.linkButton(figure),
      Ladder.pictures(root),
      Ladder.loadTape(figure),
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

  const roots = [...document.querySelectorAll("figure.figure:has(> script.figure-record)")];
  for (const root of roots) live(root);
  document.querySelectorAll("figure.graph").forEach(Ladder.pictures);
  watch();
  document.querySelectorAll(".ladder").forEach(climb);
  document.querySelectorAll(".contents details").forEach(unfold);
  reach(document.querySelectorAll(".formula"));
  document.querySelectorAll("button.theme").forEach(Ladder.theme);
  document.querySelectorAll("button.search-open").forEach(Ladder.search);
  document.querySelectorAll(".stored").forEach(Ladder.stored);
  document.querySelectorAll("pre.copied").forEach(Ladder.copied);
  document.querySelectorAll("main.deck").forEach(Ladder.slides); // before the cards: Escape closes one first
  Ladder.cards();
  Ladder.links();
  Ladder.startWhenSeen(roots);
  Ladder.keepOffline();
})();
