// Checks a record from a link: valid parts are accepted, the rest is named. Python checks everything again.

/** @import { Control, FigureRecord, Spec } from "./types.js" */

const FURTHEST = 1e6;
const LONGEST = 2000; // actions
const PRINT = /^[0-9a-f]{32}$/; // the fingerprint of a file that the link's author had

/** @type {(value: unknown, limit: number) => value is number} */
const finite = (value, limit) => typeof value === "number" && Math.abs(value) < limit;

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
function isKnown(spec, action) {
  if (!Array.isArray(action)) return false;
  const [kind, name, ...point] = action;
  if (kind === "press") return !point.length && spec.buttons.some((button) => button.does === "press" && button.name === name);
  /** @type {Record<string, string[]>} */
  const names = { drag: spec.handles, click: spec.clicks, hover: spec.hovers };
  const isNamed = Object.hasOwn(names, kind) && names[kind].includes(name);
  return isNamed && point.length === 2 && point.every((value) => finite(value, FURTHEST));
}

/**
 * The link author's own files that are named by a valid fingerprint; the others are added to `ignored`.
 * @type {(files: unknown, takes: string[], ignored: string[]) => Pick<FigureRecord, "given">}
 */
function ownFiles(files, takes, ignored) {
  if (typeof files !== "object" || files === null || Array.isArray(files)) {
    ignored.push("your files");
    return {};
  }
  /** @type {Record<string, string>} */
  const valid = {};
  for (const [slot, key] of Object.entries(files)) {
    const isSlot = takes.includes(slot);
    if (isSlot && typeof key === "string" && PRINT.test(key)) valid[slot] = key;
    else ignored.push(isSlot ? `the ${slot}` : `“${slot.slice(0, 30)}”`);
  }
  return Object.keys(valid).length ? { given: valid } : {};
}

/**
 * The valid part of a link's record, on top of `initial`, and the names of what was ignored. The log is cut at the
 * first action that the figure does not know: later ones applied to a state that cannot be reached.
 * @param {{ controls: object, seed: any, log: any[], given?: unknown }} input
 * @param {FigureRecord} initial
 * @param {Spec} spec
 * @returns {{ record: FigureRecord, ignored: string[] }}
 */
export function sound(input, initial, spec) {
  /** @type {string[]} */
  const ignored = [];
  const controls = { ...initial.controls };
  for (const [name, value] of Object.entries(input.controls)) {
    const control = Object.hasOwn(spec.controls, name) ? spec.controls[name] : null;
    if (control && fits(control, value)) controls[name] = value;
    else ignored.push(control ? control.label.toLowerCase() : `“${name.slice(0, 30)}”`);
  }
  const seed = Number.isInteger(input.seed) && input.seed >= 0 && input.seed < 2 ** 31;
  if (!seed) ignored.push("the seed");
  const stop = input.log.findIndex((action) => !isKnown(spec, action));
  const count = Math.min(stop < 0 ? input.log.length : stop, LONGEST);
  if (count < input.log.length) ignored.push(`everything from action ${count + 1} on`);
  const record = { ...initial, controls, seed: seed ? input.seed : initial.seed, log: input.log.slice(0, count) };
  if (input.given !== undefined) Object.assign(record, ownFiles(input.given, spec.takes, ignored));
  return { record, ignored };
}
