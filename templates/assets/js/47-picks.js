// Picks: panels that take a click at a place. By keyboard a crosshair does: arrows move it, Enter or Space picks.
(() => {
  "use strict";

  const { make, on, percent, record: records, world } = Ladder;
  const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

  function crosshair(figure, overlay, name) {
    const attributes = { type: "button", class: "crosshair", "data-pick": name };
    const button = overlay.layer.appendChild(make("button", attributes));
    const view = () => figure.frame.panels.find((panel) => panel.name === name).view;
    const [x0, x1, y0, y1] = view();
    let at = [(x0 + x1) / 2, (y0 + y1) / 2];

    function put(place) {
      at = place;
      overlay.put(button, name, ...percent(view(), at));
      const where = at.map((value) => value.toFixed(2).replace("-", "−")).join(", ");
      button.setAttribute("aria-label", `Pick a place: ${where}. Arrow keys move, Enter picks.`);
    }

    function key(event) {
      const way = WAYS[event.key];
      if (!way) return;
      event.preventDefault();
      const [a, b, c, d] = view();
      const part = event.shiftKey ? 1 / 8 : 1 / 40;
      put([clamp(at[0] + way[0] * part * (b - a), a, b), clamp(at[1] + way[1] * part * (d - c), c, d)]);
    }

    const pick = (place) => {
      put(place);
      figure.ask(records.click(figure.record, name, place));
    };
    put(at);
    const panel = figure.stage.querySelector(`.figure-panel[data-panel="${CSS.escape(name)}"]`);
    return [
      on(button, "keydown", key),
      on(button, "click", (event) => {
        if (event.detail === 0) pick(at);
      }),
      on(panel, "click", (event) => {
        overlay.measure();
        const [x, y] = world(overlay.rect(name), view(), event.clientX, event.clientY);
        const [a, b, c, d] = view();
        if (x >= a && x <= b && y >= c && y <= d) pick([x, y]);
      }),
      () => overlay.remove(button),
    ];
  }

  Ladder.picks = function (figure, overlay) {
    const disposers = (figure.spec.clicks ?? []).flatMap((name) => crosshair(figure, overlay, name));
    return () => disposers.forEach((dispose) => dispose());
  };
})();
