// Pinned runs: a small table beside the figure of states worth keeping, with the settings in which they differ.
import { sound } from "../base/checked_record.js";
import { copy, fileName, make, on, save } from "../base/dom.js";
import { store } from "../base/store.js";
import { shownValue } from "./controls.js";

const MOST = 50;

/** @typedef {{record: Object, readouts: {name: string, label: string, value: string, unit: string}[]}} Pin */

const differ = (pins, of) => new Set(pins.map(of)).size > 1;
const withUnit = ({ label, unit }) => (unit ? `${label} (${unit})` : label);

/** A readout without a value, such as the error of no rotation, has no unit either; its column has. */
const unitOf = (pins, name) =>
  pins.flatMap((pin) => pin.readouts).find((each) => each.name === name && each.unit)?.unit ?? "";

/** [heading, cell of a pin as text] of every column; `all` also takes the settings that are equal in all rows. */
function columns(specs, pins, all) {
  const shown = (name) => (pin) => pin.record.controls[name];
  const settings = Object.entries(specs).filter(([name]) => all || differ(pins, shown(name)));
  const seed = all || differ(pins, (pin) => pin.record.seed);
  const readouts = pins.at(-1).readouts.map((each) => ({ ...each, unit: unitOf(pins, each.name) }));
  const value = (pin, name) => pin.readouts.find((each) => each.name === name)?.value ?? "–";
  return [
    ...settings.map(([name, spec]) => [withUnit(spec), (pin) => shownValue({ ...spec, unit: "" }, shown(name)(pin))]),
    ...(seed ? [["Seed", (pin) => String(pin.record.seed)]] : []),
    ["Actions", (pin) => String(pin.record.log.length)],
    ...readouts.map((each) => [withUnit(each), (pin) => value(pin, each.name)]),
  ];
}

function csv(specs, pins) {
  const cell = (value) => (/[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value).replaceAll("−", "-");
  const all = columns(specs, pins, true);
  const rows = [all.map(([heading]) => heading), ...pins.map((pin) => all.map(([, of]) => of(pin)))];
  return rows.map((row) => row.map(cell).join(",")).join("\n") + "\n";
}

function table(specs, pins) {
  const shown = columns(specs, pins, false);
  const button = (what, i) =>
    make("button", { type: "button", "data-do": what, "data-row": i, "aria-label": `${what} run ${i + 1}` }, what);
  const row = (pin, i) =>
    make(
      "tr",
      {},
      make("th", { scope: "row" }, String(i + 1)),
      ...shown.map(([, of]) => make("td", {}, of(pin))),
      make("td", { class: "runs-do" }, button("Restore", i), " ", button("Remove", i)),
    );
  const heads = ["Run", ...shown.map(([heading]) => heading)].map((heading) => make("th", { scope: "col" }, heading));
  return make(
    "table",
    {},
    make("caption", {}, "Pinned runs"),
    make("thead", {}, make("tr", {}, ...heads, make("td"))),
    make("tbody", {}, ...pins.map(row)),
  );
}

const WORDS = ["name", "label", "value", "unit"];
const read = (each) => WORDS.every((word) => typeof each?.[word] === "string");

/**
 * What an earlier visit or another tab kept, as far as it still is a pin of this figure. A control that the figure got
 * since then stands where the page has it; a run that cannot be done any more is none.
 */
function kept(key, { initial, spec }) {
  const pins = store.get(key);
  if (!Array.isArray(pins)) return [];
  return pins.slice(-MOST).flatMap((pin) => {
    const { controls, seed, log, widget, given } = pin?.record ?? {};
    if (widget !== initial.widget || !Array.isArray(log) || !Array.isArray(pin.readouts)) return [];
    const { record } = sound({ controls: { ...controls }, seed, log, given }, initial, spec);
    if (record.seed !== seed || record.log.length < log.length) return [];
    return [{ record, readouts: pin.readouts.filter(read) }];
  });
}

export function addPins(figure) {
  const box = figure.root.querySelector(".runs");
  const pin = figure.root.querySelector("[data-pin]");
  if (!box || !pin) return () => {};
  const specs = figure.spec.controls;
  const key = `ladder-pins:${location.pathname}#${figure.id}`;
  let pins = kept(key, figure);
  let stored = true;

  function show() {
    box.hidden = pins.length === 0;
    if (box.hidden) return box.replaceChildren();
    const scroll = make("div", { class: "runs-scroll", tabindex: "0", role: "group", "aria-label": "Pinned runs" });
    scroll.append(table(specs, pins));
    const tool = (what, words) => make("button", { type: "button", "data-do": what }, words);
    box.replaceChildren(scroll, tool("Copy", "Copy as CSV"), " ", tool("Save", "Save as CSV"));
  }

  /** Another tab may have pinned or removed runs; where nothing is stored, the page's own are all there are. */
  function look() {
    if (stored) pins = kept(key, figure);
    show();
  }

  function keep(next) {
    pins = next.slice(-MOST);
    stored = store.set(key, pins);
    show();
  }

  const does = {
    Restore: (row) => figure.ask(pins[row].record),
    Remove(row) {
      keep(pins.filter((_, i) => i !== row));
      (box.querySelectorAll('[data-do="Remove"]')[Math.min(row, pins.length - 1)] ?? pin).focus();
    },
    async Copy() {
      const text = csv(specs, pins);
      if (await copy(text)) figure.status.say("Pinned runs copied.");
      else figure.status.offer("Pinned runs:", text);
    },
    Save: () => save(fileName(figure.id, "-runs.csv"), csv(specs, pins), "text/csv"),
  };
  const disposers = [
    on(globalThis, "storage", (event) => event.key === key && look()),
    on(globalThis, "pageshow", (event) => event.persisted && look()),
    on(pin, "click", () => {
      look();
      const full = pins.length === MOST;
      const readouts = figure.frame.readouts.map(({ name, label, value, unit }) => ({ name, label, value, unit }));
      keep([...pins, { record: figure.shown, readouts }]);
      const notes = [
        full && `No more than ${MOST} are kept: the oldest one was dropped.`,
        !stored && "This browser could not store it: it is gone when you leave this page.",
      ];
      figure.status.say([`Run ${pins.length} pinned.`, ...notes.filter(Boolean)].join(" "));
    }),
    on(box, "click", (event) => {
      const node = event.target.closest("[data-do]");
      if (node) does[node.dataset.do](Number(node.dataset.row));
    }),
  ];
  show();
  return () => disposers.forEach((dispose) => dispose());
}
