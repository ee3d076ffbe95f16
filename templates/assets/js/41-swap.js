// Swaps a frame's panels into the stage. The handles' overlay stays, so that focus and pointer capture survive.
(() => {
  "use strict";

  const { make } = Ladder;

  const panelOf = (stage, name) => stage.querySelector(`.figure-panel[data-panel="${CSS.escape(name)}"]`);

  /** The drawing of a panel. */
  Ladder.drawing = (stage, name) => panelOf(stage, name)?.querySelector("svg.plot") ?? null;

  Ladder.swap = function (stage, panels) {
    const names = new Set(panels.map(({ name }) => name));
    for (const gone of stage.querySelectorAll(".figure-panel")) if (!names.has(gone.dataset.panel)) gone.remove();
    for (const { name, svg } of panels) {
      const drawing = Ladder.drawing(stage, name);
      if (drawing) {
        drawing.outerHTML = svg;
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
