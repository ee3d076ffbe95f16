// Checks a record from a link: valid parts are accepted, the rest is named. Python checks everything again.

/** @import { Control, FigureRecord, Spec } from "./types.js" */

const FURTHEST = 1e6;
const LONGEST = 2000; // actions
const PRINT = /^[0-9a-f]{32}$/; // the fingerprint of a file that the link's author had

/** @type {(value: unknown, most: number) => value is number} */
const finite = (value, most) => typeof value === "number" && Math.abs(value) < most;

/** @type {(control: Control, value: any) => boolean} */
function fits(control, value) {
  if (control.kind === "toggle") return typeof value === "boolean";
  if (control.kind === "choice") return typeof value === "string" && Object.hasOwn(control.options, value);
  return finite(value, 1e15) && value >= control.low - 1e-9 && value <= control.high + 1e-9;
}

/**
 * Whether the figure knows such an action: a press names a button, every other action has a place in the world.
 * @type {(spec: Spec, action: unknown) => boolean}
 */
function known(spec, action) {
  if (!Array.isArray(action)) return false;
  const [kind, name, ...place] = action;
  if (kind === "press") return !place.length && spec.buttons.some((each) => each.does === "press" && each.name === name);
  /** @type {Record<string, string[]>} */
  const names = { drag: spec.handles, click: spec.clicks, hover: spec.hovers };
  const there = Object.hasOwn(names, kind) && names[kind].includes(name);
  return there && place.length === 2 && place.every((value) => finite(value, FURTHEST));
}

/**
 * The link author's own files that are named by a valid fingerprint; the others are added to `ignored`.
 * @type {(given: unknown, takes: string[], ignored: string[]) => Pick<FigureRecord, "given">}
 */
function brought(given, takes, ignored) {
  if (typeof given !== "object" || given === null || Array.isArray(given)) {
    ignored.push("your files");
    return {};
  }
  /** @type {Record<string, string>} */
  const kept = {};
  for (const [place, key] of Object.entries(given)) {
    const taken = takes.includes(place);
    if (taken && typeof key === "string" && PRINT.test(key)) kept[place] = key;
    else ignored.push(taken ? `the ${place}` : `“${place.slice(0, 30)}”`);
  }
  return Object.keys(kept).length ? { given: kept } : {};
}

/**
 * The valid part of a link's record, on top of `initial`, and the names of what was ignored. The log is cut at the
 * first action that the figure does not know: later ones applied to a state that cannot be reached.
 * @param {{ controls: object, seed: any, log: any[], given?: unknown }} given
 * @param {FigureRecord} initial
 * @param {Spec} spec
 * @returns {{ record: FigureRecord, ignored: string[] }}
 */
export function sound(given, initial, spec) {
  /** @type {string[]} */
  const ignored = [];
  const controls = { ...initial.controls };
  for (const [name, value] of Object.entries(given.controls)) {
    const control = Object.hasOwn(spec.controls, name) ? spec.controls[name] : null;
    if (control && fits(control, value)) controls[name] = value;
    else ignored.push(control ? control.label.toLowerCase() : `“${name.slice(0, 30)}”`);
  }
  const seed = Number.isInteger(given.seed) && given.seed >= 0 && given.seed < 2 ** 31;
  if (!seed) ignored.push("the seed");
  const stop = given.log.findIndex((action) => !known(spec, action));
  const count = Math.min(stop < 0 ? given.log.length : stop, LONGEST);
  if (count < given.log.length) ignored.push(`everything from action ${count + 1} on`);
  const record = { ...initial, controls, seed: seed ? given.seed : initial.seed, log: given.log.slice(0, count) };
  if (given.given !== undefined) Object.assign(record, brought(given.given, spec.takes, ignored));
  return { record, ignored };
}
