// Pinned runs: a small table of states worth keeping, with the settings in which they differ.
/** @import { Control, FigureRecord, Readout, Value } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { sound } from "../base/checked_record.js";
import { around, copy, fileName, make, on, pageName, save } from "../base/dom.js";
import { quantity, withUnit } from "../base/format.js";
import { store } from "../base/store.js";
import { shownValue } from "./shown_value.js";

const MOST = 50;

/** @typedef {{ record: FigureRecord, readouts: Omit<Readout, "role">[] }} Pin */
/** @typedef {Record<string, Control>} Controls */
/** @typedef {[heading: string, cell: (pin: Pin) => string]} Column */

/** @type {(pins: Pin[], of: (pin: Pin) => unknown) => boolean} */
const differ = (pins, of) => new Set(pins.map(of)).size > 1;

/**
 * A readout's column. The pins' unit is in its heading; if they have several, each stands beside its value, in a file
 * in a second column. A readout without a number, such as the error of no rotation, has no unit either.
 * @type {(pins: Pin[], readout: Pin["readouts"][0], all: boolean) => Column[]}
 */
function measured(pins, { name, label }, all) {
  /** @param {Pin} pin */
  const found = (pin) => pin.readouts.find((readout) => readout.name === name) ?? { value: "–", unit: "" };
  const units = [...new Set(pins.map(found).flatMap(({ value, unit }) => (/\d/.test(value) ? unit : [])))];
  if (units.length < 2) return [[withUnit({ label, unit: units[0] }), (pin) => found(pin).value]];
  if (!all) return [[label, (pin) => quantity(found(pin).value, found(pin).unit)]];
  return [[label, (pin) => found(pin).value], [`${label}: unit`, (pin) => found(pin).unit]];
}

/**
 * The table's columns; `all` includes the settings that are equal in all rows.
 * @type {(specs: Controls, pins: Pin[], all: boolean) => Column[]}
 */
function columns(specs, pins, all) {
  /** @type {(name: string) => (pin: Pin) => Value} */
  const settingOf = (name) => (pin) => pin.record.controls[name];
  const settings = Object.entries(specs).filter(([name]) => all || differ(pins, settingOf(name)));
  const seed = all || differ(pins, (pin) => pin.record.seed);
  const latest = /** @type {Pin} */ (pins.at(-1));
  /** @type {(name: string, spec: Control) => Column} */
  const setting = (name, spec) => {
    if (spec.kind !== "slider") return [spec.label, (pin) => shownValue(spec, settingOf(name)(pin))];
    const [choice, labels] = spec.named ?? ["", {}];
    const options = new Set(pins.map(settingOf(choice)));
    const label = labels[[...options].join()] ?? spec.label; // several options: the name for all
    const unitless = { ...spec, unit: "" };
    return [withUnit({ label, unit: spec.unit }), (pin) => shownValue(unitless, settingOf(name)(pin))];
  };
  /** @type {Column[]} */
  const seeds = seed ? [["Seed", (pin) => String(pin.record.seed)]] : [];
  return [
    ...settings.map(([name, spec]) => setting(name, spec)),
    ...seeds,
    ["Actions", (pin) => String(pin.record.log.length)],
    ...latest.readouts.flatMap((readout) => measured(pins, readout, all)),
  ];
}

/** @type {(specs: Controls, pins: Pin[]) => string} */
function csv(specs, pins) {
  /** @param {string} value */
  const cell = (value) => (/[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value).replaceAll("−", "-");
  const all = columns(specs, pins, true);
  const rows = [all.map(([heading]) => heading), ...pins.map((pin) => all.map(([, of]) => of(pin)))];
  return rows.map((row) => row.map(cell).join(",")).join("\n") + "\n";
}

/** @type {(specs: Controls, pins: Pin[]) => HTMLTableElement} */
function table(specs, pins) {
  const visible = columns(specs, pins, false);
  /** @type {(action: string, i: number) => HTMLButtonElement} */
  const button = (action, i) => {
    const attributes = { type: "button", "data-do": action, "data-row": i, "aria-label": `${action} run ${i + 1}` };
    return make("button", attributes, action);
  };
  /** @type {(pin: Pin, i: number) => HTMLTableRowElement} */
  const row = (pin, i) =>
    make(
      "tr",
      {},
      make("th", { scope: "row" }, String(i + 1)),
      make("td", { class: "runs-do" }, button("Restore", i), " ", button("Remove", i)),
      ...visible.map(([, of]) => make("td", {}, of(pin))),
    );
  /** @param {string} heading */
  const head = (heading) => make("th", { scope: "col" }, heading);
  return make(
    "table",
    {},
    make("caption", {}, "Pinned runs"),
    make("thead", {}, make("tr", {}, head("Run"), make("td"), ...visible.map(([heading]) => head(heading)))),
    make("tbody", {}, ...pins.map(row)),
  );
}

const WORDS = ["name", "label", "value", "unit"];
/** @param {any} entry */
const isReadout = (entry) => WORDS.every((word) => typeof entry?.[word] === "string");

/**
 * The stored pins of earlier visits and other tabs that are still valid for this figure. A control added since then has
 * the page's value; a run that can no longer be replayed is dropped.
 * @type {(key: string, figure: Figure) => Pin[]}
 */
function storedPins(key, { initial, spec }) {
  const pins = store.get(key);
  if (!Array.isArray(pins)) return [];
  return pins.slice(-MOST).flatMap((pin) => {
    const { controls, seed, log, widget, given } = pin?.record ?? {};
    if (widget !== initial.widget || !Array.isArray(log) || !Array.isArray(pin.readouts)) return [];
    const { record } = sound({ controls: { ...controls }, seed, log, given }, initial, spec);
    if (record.seed !== seed || record.log.length < log.length) return [];
    return [{ record, readouts: pin.readouts.filter(isReadout) }];
  });
}

/** @param {Figure} figure */
export function addPins(figure) {
  const box = /** @type {HTMLElement | null} */ (figure.root.querySelector(".runs"));
  const pin = /** @type {HTMLElement | null} */ (figure.root.querySelector("[data-pin]"));
  if (!box || !pin) return;
  const specs = figure.spec.controls;
  const key = `ladder-pins:${new URL(`${pageName()}.html`, location.href).pathname}#${figure.id}`;
  let pins = storedPins(key, figure);
  let stored = true;

  function show() {
    if (!box) return;
    box.hidden = pins.length === 0;
    if (box.hidden) {
      box.replaceChildren();
      return;
    }
    const focused = document.activeElement;
    const focus = focused instanceof HTMLElement && box.contains(focused) ? { ...focused.dataset } : {};
    const left = box.querySelector(".runs-scroll")?.scrollLeft ?? 0;
    const region = { class: "runs-scroll", tabindex: "0", role: "group", "aria-label": "Pinned runs" };
    const scroll = make("div", region, table(specs, pins));
    /** @type {(action: string, words: string) => HTMLButtonElement} */
    const tool = (action, words) => make("button", { type: "button", "data-do": action }, words);
    box.replaceChildren(scroll, tool("Copy", "Copy as CSV"), " ", tool("Save", "Save as CSV"));
    scroll.scrollLeft = left;
    const row = focus.row ? `[data-row="${focus.row}"]` : "";
    const target = focus.do ? box.querySelector(`[data-do="${focus.do}"]${row}`) : null;
    if (target instanceof HTMLElement) target.focus({ preventScroll: true });
  }

  /** Rereads the pins, as another tab may have changed them; if storing failed, the page's own are all there are. */
  function look() {
    if (stored) pins = storedPins(key, figure);
    show();
  }

  /** @param {Pin[]} next */
  function keep(next) {
    pins = next.slice(-MOST);
    stored = store.set(key, pins);
    show();
  }

  /** @type {Record<string, (row: number) => void>} */
  const actions = {
    Restore: (row) => figure.ask(pins[row].record),
    Remove(row) {
      keep(pins.filter((_, i) => i !== row));
      const buttons = /** @type {NodeListOf<HTMLElement>} */ (box.querySelectorAll('[data-do="Remove"]'));
      (buttons[Math.min(row, pins.length - 1)] ?? pin).focus();
    },
    async Copy() {
      const text = csv(specs, pins);
      if (await copy(text)) figure.say("Pinned runs copied.");
      else figure.offer("Pinned runs:", text);
    },
    Save: () => save(fileName(figure.id, "-runs.csv"), csv(specs, pins), "text/csv"),
  };
  on(globalThis, "storage", (event) => event.key === key && look());
  on(globalThis, "pageshow", (event) => event.persisted && look());
  on(pin, "click", () => {
    look();
    const full = pins.length === MOST;
    const readouts = figure.frame.readouts.map(({ name, label, value, unit }) => ({ name, label, value, unit }));
    keep([...pins, { record: figure.shown, readouts }]);
    const notes = [
      full && `At most ${MOST} are kept: the oldest was dropped.`,
      !stored && "This browser could not store it: it will be lost when you leave this page.",
    ];
    figure.say([`Run ${pins.length} pinned.`, ...notes.filter(Boolean)].join(" "));
  });
  on(box, "click", (event) => {
    const node = around(event, "[data-do]");
    if (node) actions[node.dataset.do ?? ""](Number(node.dataset.row));
  });
  show();
}
