// Picks: panels that take a click at a place, or answer to what is pointed at. By keyboard a crosshair does: arrows move
// it and, where a click counts, Enter or Space picks.
import { make, on } from "../base/dom.js";
import * as records from "../base/record.js";
import { percent, world } from "./coordinates.js";
import { drawing, onStage } from "./panels.js";
import { runtime } from "../runtime/runtime.js";

const WAYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

/** A crosshair over a panel. Returns { at, put, where(event): the pointer's place or null, button, panel, off }. */
export function crosshair(figure, overlay, name, { does, hint }, moved) {
  const shown = drawing(figure.stage, name).getAttribute("aria-label");
  const says = { role: "slider", "aria-label": `${does}: ${shown}`, "aria-description": hint };
  const attributes = { type: "button", class: "crosshair", "data-pick": name, ...says };
  const button = overlay.layer.appendChild(make("button", attributes));
  const panel = figure.stage.querySelector(`.figure-panel[data-panel="${CSS.escape(name)}"]`);
  const view = () => figure.frame.panels.find((each) => each.name === name).view;
  const [x0, x1, y0, y1] = view();
  const cross = { at: [(x0 + x1) / 2, (y0 + y1) / 2], put, where, button, panel };
  button.setAttribute("aria-valuemin", x0);
  button.setAttribute("aria-valuemax", x1);

  function put(place) {
    cross.at = place;
    overlay.put(button, name, ...percent(view(), place));
    const [x, y] = place.map((value) => value.toFixed(2));
    button.setAttribute("aria-valuenow", x);
    button.setAttribute("aria-valuetext", `x ${x}, y ${y}`.replaceAll("-", "−"));
  }

  function where(event) {
    const [x, y] = world(overlay.rect(name), view(), event.clientX, event.clientY);
    const [a, b, c, d] = view();
    return x >= a && x <= b && y >= c && y <= d ? [x, y] : null;
  }

  function key(event) {
    const way = WAYS[event.key];
    if (!way) return;
    event.preventDefault();
    const [a, b, c, d] = view();
    const part = event.shiftKey ? 1 / 8 : 1 / 40;
    const [x, y] = cross.at;
    put([clamp(x + way[0] * part * (b - a), a, b), clamp(y + way[1] * part * (d - c), c, d)]);
    moved(event.timeStamp);
  }

  put(cross.at);
  cross.off = [on(button, "keydown", key), () => overlay.remove(button)];
  return cross;
}

function picked(figure, overlay, name) {
  const words = { does: "Pick a place", hint: "Arrow keys move, Shift for larger steps; Enter picks." };
  const cross = crosshair(figure, overlay, name, words, () => {});
  const pick = (place) => {
    cross.put(place);
    figure.ask(records.click(figure.record, name, place));
  };
  return [
    ...cross.off,
    on(cross.button, "click", (event) => {
      if (event.detail === 0) pick(cross.at);
    }),
    on(cross.panel, "click", (event) => {
      overlay.measure();
      const place = cross.where(event);
      if (place) pick(place);
    }),
  ];
}

/** The pointer asks only while Python is up: passing over a picture must not set it waiting. A tap or a key may. */
function pointed(figure, overlay, name) {
  const words = { does: "Look at a place", hint: "Arrow keys move, Shift for larger steps." };
  const ask = (at) =>
    figure.ask(records.hover(figure.record, name, cross.at), { merge: `hover:${name}`, by: "hover", at });
  const cross = crosshair(figure, overlay, name, words, (at) => {
    ask(at);
    figure.speak();
  });
  let ahead = 0; // the animation frame that will ask

  function follow(event) {
    if (event.pointerType === "touch" || event.buttons || runtime.state !== "live") return;
    const place = cross.where(event);
    if (!place) return;
    cross.put(place);
    const { timeStamp } = event;
    ahead ||= requestAnimationFrame(() => {
      ahead = 0;
      ask(timeStamp);
    });
  }

  return [
    ...cross.off,
    on(cross.panel, "pointermove", follow),
    on(cross.panel, "click", (event) => {
      overlay.measure();
      const place = cross.where(event);
      if (!place) return;
      cross.put(place);
      ask(event.timeStamp);
      figure.speak();
    }),
    () => cancelAnimationFrame(ahead),
  ];
}

export function addPicks(figure, overlay) {
  const seen = (name) => onStage(figure.stage, name);
  const disposers = [
    ...(figure.spec.clicks ?? []).filter(seen).flatMap((name) => picked(figure, overlay, name)),
    ...(figure.spec.hovers ?? []).filter(seen).flatMap((name) => pointed(figure, overlay, name)),
  ];
  return () => disposers.forEach((dispose) => dispose());
}
