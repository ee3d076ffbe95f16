// Handles: buttons over the picture that a pointer drags and arrow keys move. A key press is a drag to the place that
// the frame gives for it.
/** @import { Handle } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, make, on } from "../base/dom.js";
import * as records from "../base/record.js";
import { addDrags } from "./drags.js";
import { onStage } from "./panels.js";

const HINT = "handle-hint";
const MOST_KEYS = 50;

function hint() {
  const words = "Arrow keys move, Shift for larger steps.";
  if (!document.getElementById(HINT)) document.body.append(make("p", { id: HINT, hidden: true }, words));
}

/**
 * Makes a handle's button in a panel. Its role is slider, because screen readers do not pass arrow keys on to a button.
 * In all panels but one it is a copy, for the pointer only.
 * @param {Handle} handle
 * @param {string} panel
 * @param {boolean} copy
 */
function handleButton({ name, label, kind, radius }, panel, copy) {
  const shared = { type: "button", "data-handle": name, "data-panel": panel };
  const attributes =
    !copy
      ? { ...shared, class: `handle ${kind}`, role: "slider", "aria-label": label, "aria-describedby": HINT }
      : { ...shared, class: `handle ${kind} copy`, tabindex: "-1", "aria-hidden": "true" };
  const button = make("button", attributes);
  button.style.width = button.style.height = `${Math.max(44, 2 * radius)}px`;
  return button;
}

/**
 * Writes the handle's place into its slider attributes.
 * @param {HTMLElement} button
 * @param {Handle} handle
 */
function slide(button, { value, slider: [low, high, current] }) {
  if (button.getAttribute("aria-valuetext") === value) return;
  const attributes = { "aria-valuetext": value, "aria-valuemin": low, "aria-valuemax": high, "aria-valuenow": current };
  for (const [name, content] of Object.entries(attributes)) button.setAttribute(name, String(content));
}

/**
 * @param {Figure} figure
 * @param {Overlay} overlay
 */
export function addHandles(figure, overlay) {
  /** @type {Map<string, HTMLButtonElement>} */
  const buttons = new Map(); // by handle name; copies by handle and panel name
  /** @param {string} name */
  const of = (name) => figure.frame.handles.find((handle) => handle.name === name);
  /** @param {string} name */
  const buttonOf = (name) => buttons.get(name);
  const drags = addDrags(figure, overlay, { of, own: buttonOf, update });
  /** @type {[handle: string, key: string][]} key presses that wait for their frames */
  let keys = [];

  function update() {
    /** @param {string} panel */
    const isVisible = (panel) => onStage(figure.root, panel);
    const entries = figure.frame.handles.flatMap((handle) =>
      [handle.panel, ...(handle.also ?? [])]
        .filter(isVisible)
        .map((panel, i) => ({ key: i ? `${handle.name} ${panel}` : handle.name, handle, panel, copy: i > 0 })),
    );
    const panels = new Map(entries.map(({ key, panel }) => [key, panel]));
    for (const [key, button] of buttons) {
      if (panels.get(key) === button.dataset.panel) continue;
      if (button === document.activeElement) figure.focus();
      overlay.remove(button);
      buttons.delete(key);
    }
    for (const { key, handle, panel, copy } of entries) {
      const button = buttons.get(key) ?? overlay.layer.appendChild(handleButton(handle, panel, copy));
      buttons.set(key, button);
      if (!copy) slide(button, handle);
      if (drags.held !== button) overlay.put(button, panel, handle.left, handle.top);
    }
  }

  /** @param {KeyboardEvent} event */
  function key(event) {
    const name = around(event, ".handle")?.dataset.handle;
    if (!name || event.altKey || event.ctrlKey || event.metaKey) return;
    const combination = (event.shiftKey ? "Shift+" : "") + event.key;
    if (!of(name)?.keys[combination]) return;
    event.preventDefault();
    const room = event.repeat ? 1 : MOST_KEYS; // a held key stops moving the handle on release
    if (!drags.held && keys.length < room) keys.push([name, combination]);
    next(event.timeStamp);
  }

  /**
   * A key's place is valid for the current frame only: the next key waits for the next frame.
   * @param {number} [at]
   */
  function next(at) {
    const press = figure.pending ? undefined : keys.shift();
    if (!press) return;
    const [name, combination] = press;
    const handle = of(name);
    const to = handle?.keys[combination];
    if (!handle || !to) return;
    const record = records.put(figure.record, handle, to, figure.spec.controls);
    figure.ask(record, { merge: `drag:${name}`, by: "key", at });
  }

  figure.on("frame", () => {
    update();
    next();
  });
  figure.on("asked", (by) => {
    if (by !== "key") keys = [];
  });
  figure.on("scaled", update);
  on(overlay.layer, "keydown", key);
  hint();
  update();
}
