// A figure's whole state is a record of plain data. Every action makes a new record; none is ever changed in place.

/** @import { Action, Control, FigureRecord, Handle, Point, Value, Values } from "./types.js" */

import { four } from "./format.js";

const LONGEST_LINK = 200_000;

/**
 * A string that is equal for equal states; JSON.stringify writes every number, so Python's 1.0 is 1 here.
 * @param {FigureRecord} record
 */
export function key(record) {
  const controls = Object.entries(record.controls).sort(([a], [b]) => (a < b ? -1 : 1));
  return JSON.stringify([record.widget, controls, record.seed, record.log, record.given ?? {}]);
}

/** @typedef {(record: FigureRecord, name: string, point: Point) => FigureRecord} Placing */

/** @type {(record: FigureRecord, ...actions: Action[]) => FigureRecord} */
const logged = (record, ...actions) => ({ ...record, log: [...record.log, ...actions] });

/** @type {(record: FigureRecord, name: string) => FigureRecord} */
export const press = (record, name) => logged(record, ["press", name]);

/** @type {Placing} */
export const click = (record, panel, [x, y]) => logged(record, ["click", panel, four(x), four(y)]);

/**
 * Adds a drag; it replaces the last action if that dragged the same handle.
 * @type {Placing}
 */
export const drag = (record, handle, point) => latest(record, "drag", handle, point);

/**
 * Adds a hover; it replaces the last action if that was a hover over the same panel.
 * @type {Placing}
 */
export const hover = (record, panel, point) => latest(record, "hover", panel, point);

/**
 * Drops a last hover over one of these panels; without one, returns the record itself.
 * @type {(record: FigureRecord, ...panels: string[]) => FigureRecord}
 */
export function left(record, ...panels) {
  const last = record.log.at(-1);
  return last && last[0] === "hover" && panels.includes(last[1]) ? back(record) : record;
}

/** @type {(record: FigureRecord, kind: "drag" | "hover", name: string, point: Point) => FigureRecord} */
function latest(record, kind, name, [x, y]) {
  const last = record.log.at(-1);
  const repeats = last && last[0] === kind && last[1] === name;
  return logged(repeats ? back(record) : record, [kind, name, four(x), four(y)]);
}

/** @type {(record: FigureRecord) => FigureRecord} */
export const back = (record) => ({ ...record, log: record.log.slice(0, -1) });

/** @type {(record: FigureRecord) => FigureRecord} */
export const reset = (record) => ({ ...record, log: [] });

/** @type {(record: FigureRecord) => FigureRecord} */
export const reseed = (record) => ({
  ...record,
  seed: (record.seed + 13) % 2 ** 31,
  log: record.log.filter(([kind]) => kind !== "press"),
});

/** @type {Record<Control["keeps"], (log: Action[]) => Action[]>} */
const KEPT = {
  log: (log) => log,
  presses: (log) => log.filter(([kind]) => kind === "press"),
  pose: (log) => log.filter(([kind]) => kind === "drag"),
  nothing: () => [],
};

/** The controls that an option of a choice sets. @type {(spec: Control, value: Value) => Values} */
const brings = (spec, value) => (spec.kind === "choice" && spec.sets?.[String(value)]) || {};

/**
 * Whether a control that the chosen option set has since changed, or a handle was dragged although the option places
 * the start.
 * @type {(record: Pick<FigureRecord, "controls" | "log">, name: string, spec: Control) => boolean}
 */
export const adjusted = ({ controls, log }, name, spec) =>
  Object.entries(brings(spec, controls[name])).some(([affected, value]) => controls[affected] !== value) ||
  (spec.kind === "choice" && Boolean(spec.places) && log.some(([kind]) => kind === "drag"));

/**
 * Sets a control and whatever its chosen option sets; keeps as much of the log as the control's spec says.
 * @type {(record: FigureRecord, name: string, value: Value, spec: Control) => FigureRecord}
 */
export function control(record, name, value, spec) {
  const effects = brings(spec, value);
  return { ...record, controls: { ...record.controls, [name]: value, ...effects }, log: KEPT[spec.keeps](record.log) };
}

/**
 * Where a handle put at a place ends up: there, or at the nearest value of the slider that it sets.
 * @type {(handle: Pick<Handle, "sets" | "world">, point: Point, controls: Record<string, Control>) => Point}
 */
export function reached({ sets, world }, point, controls) {
  const spec = controls[sets ?? ""];
  if (spec?.kind !== "slider") return point;
  const { low, high, step, decimals } = spec;
  const value = low + step * Math.round((point[0] - low) / step);
  return [Number(Math.min(Math.max(value, low), high).toFixed(decimals)), world[1]];
}

/**
 * Puts a handle at a place: adds a drag, or changes the slider that the handle sets. Returns the record itself if the
 * slider already has that value.
 * @type {(record: FigureRecord, handle: Handle, point: Point, controls: Record<string, Control>) => FigureRecord}
 */
export function put(record, handle, point, controls) {
  const { name, sets } = handle;
  if (!sets) return drag(record, name, point);
  const [value] = reached(handle, point, controls);
  return record.controls[sets] === value ? record : control(record, sets, value, controls[sets]);
}

/**
 * Whether `current` is `previous` plus one press or click, the only change that may be shown as a motion.
 * @type {(previous: FigureRecord, current: FigureRecord) => boolean}
 */
export const pressed = (previous, current) =>
  ["press", "click"].includes(String(current.log.at(-1)?.[0])) && key(back(current)) === key(previous);

/**
 * Encodes a record for a link: base64url of its JSON.
 * @type {(record: FigureRecord) => string}
 */
export function encode(record) {
  const bytes = new TextEncoder().encode(JSON.stringify(record));
  const binary = Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
  return btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** @type {(value: unknown) => value is Record<string, any>} */
const isMapping = (value) => typeof value === "object" && value !== null && !Array.isArray(value);

/**
 * Decodes a record from a link, on top of `initial`; checks its shape only, Python checks its values.
 * @type {(data: string, initial: FigureRecord) => FigureRecord}
 * @throws {Error} that says what is wrong
 */
export function decode(data, initial) {
  if (data.length > LONGEST_LINK) throw new Error("it is too long");
  let plain;
  try {
    const binary = atob(data.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(binary, (letter) => letter.charCodeAt(0));
    plain = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch {
    throw new Error("it is damaged");
  }
  if (!isMapping(plain) || plain.widget !== initial.widget) throw new Error("it belongs to another figure");
  const { preset = initial.preset, controls = {}, seed = initial.seed, log = [] } = plain;
  if (!isMapping(controls) || !Array.isArray(log)) throw new Error("it is damaged");
  const ownFiles = plain.given === undefined ? {} : { given: plain.given };
  return { widget: initial.widget, preset, controls: { ...initial.controls, ...controls }, seed, log, ...ownFiles };
}
