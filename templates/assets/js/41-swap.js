// Swaps a frame's panels into the stage. The handles' overlay stays, so that focus and pointer capture survive.
(() => {
  "use strict";

  const { make, text } = Ladder;

  const panelOf = (stage, name) => stage.querySelector(`.figure-panel[data-panel="${CSS.escape(name)}"]`);

  /** The drawing of a panel. */
  Ladder.drawing = (stage, name) => panelOf(stage, name)?.querySelector("svg.plot") ?? null;

  /** Whether a panel is to be seen: a slide may show some of a figure's panels only. */
  Ladder.onStage = (stage, name) => !panelOf(stage, name)?.hidden;

  /** The drawing that each panel element holds, as text: what has not changed is left alone. */
  const held = new WeakMap();

  /** A panel's caption: a line each, the first its name. */
  function caption(panel, words) {
    const lines = words.split("\n");
    const told = panel.querySelector(".panel-caption");
    if (!told) return;
    while (told.children.length < lines.length) told.append(make("span"));
    while (told.children.length > lines.length) told.lastChild.remove();
    lines.forEach((line, i) => text(told.children[i], line));
  }

  Ladder.swap = function (stage, panels) {
    const names = new Set(panels.map(({ name }) => name));
    for (const gone of stage.querySelectorAll(".figure-panel")) if (!names.has(gone.dataset.panel)) gone.remove();
    for (const { name, svg, caption: words } of panels) {
      const there = panelOf(stage, name);
      if (there) {
        if (held.get(there) !== svg) there.querySelector("svg.plot").outerHTML = svg;
        held.set(there, svg);
        caption(there, words);
        continue;
      }
      const panel = make("div", { class: "figure-panel", "data-panel": name });
      panel.innerHTML = svg;
      stage.insertBefore(panel, stage.querySelector(".figure-handles"));
    }
  };

  /**
   * A pointer's place in a panel's world. view: [x0, x1, y0, y1, width, height, left, top, right, bottom], the window
   * of the world and, in nominal px, the panel's size and what is left free around the window.
   */
  Ladder.world = function (rect, view, clientX, clientY) {
    const [x0, x1, y0, y1, width, height, left, top, right, bottom] = view;
    const across = (((clientX - rect.left) / rect.width) * width - left) / (width - left - right);
    const down = (((clientY - rect.top) / rect.height) * height - top) / (height - top - bottom);
    return [x0 + across * (x1 - x0), y1 - down * (y1 - y0)];
  };

  /** A world place in percent of the panel. */
  Ladder.percent = function (view, [x, y]) {
    const [x0, x1, y0, y1, width, height, left, top, right, bottom] = view;
    const across = left + ((x - x0) / (x1 - x0)) * (width - left - right);
    const down = top + ((y1 - y) / (y1 - y0)) * (height - top - bottom);
    return [(100 * across) / width, (100 * down) / height];
  };
})();
