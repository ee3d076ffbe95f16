// A figure's whole state is a record, plain data. Every action makes a new record; none is ever changed in place.

/**
 * @typedef {["press", string] | ["drag" | "click" | "hover", string, number, number]} Action
 * @typedef {Object<string, number|string|boolean>} Values
 * @typedef {{widget: string, preset: string, controls: Values, seed: number, log: Action[],
 *   given?: Object<string, string>}} Rec  given: place → fingerprint of what the reader brought
 */

const LONGEST_LINK = 200_000;
const four = (value) => Math.round(value * 1e4) / 1e4 + 0;

/** Equal for equal states; numbers are written by one parser's printer, so Python's 1.0 is 1 here. */
export function key(record) {
  const controls = Object.entries(record.controls).sort(([a], [b]) => (a < b ? -1 : 1));
  return JSON.stringify([record.widget, controls, record.seed, record.log, record.given ?? {}]);
}

const logged = (record, ...actions) => ({ ...record, log: [...record.log, ...actions] });
export const press = (record, name) => logged(record, ["press", name]);
export const click = (record, panel, [x, y]) => logged(record, ["click", panel, four(x), four(y)]);

/** A drag of the same handle once more replaces the last one. */
export function drag(record, handle, [x, y]) {
  const last = record.log.at(-1);
  const again = last && last[0] === "drag" && last[1] === handle;
  return logged(again ? back(record) : record, ["drag", handle, four(x), four(y)]);
}

/** What is pointed at now takes the place of what was pointed at before. */
export function hover(record, panel, [x, y]) {
  const last = record.log.at(-1);
  const again = last && last[0] === "hover" && last[1] === panel;
  return logged(again ? back(record) : record, ["hover", panel, four(x), four(y)]);
}

export const back = (record) => ({ ...record, log: record.log.slice(0, -1) });
export const reset = (record) => ({ ...record, log: [] });
const unpressed = (log) => log.filter(([kind]) => kind !== "press");
export const reseed = (record) => ({ ...record, seed: (record.seed + 13) % 2 ** 31, log: unpressed(record.log) });

/** A control's new value, what the chosen option brings along, and as much of the log as the control's spec keeps. */
export function control(record, name, value, spec) {
  const kept = { log: (log) => log, pose: (log) => log.filter(([kind]) => kind === "drag"), nothing: () => [] };
  const controls = { ...record.controls, [name]: value, ...spec.sets?.[value] };
  return { ...record, controls, log: kept[spec.keeps](record.log) };
}

/** Whether `after` is `before` and one press more, which is what may be shown as a motion. */
export function pressed(before, after) {
  return after.log.at(-1)?.[0] === "press" && key(back(after)) === key(before);
}

/** The record as a link carries it: base64url of its JSON. */
export function encode(record) {
  const bytes = new TextEncoder().encode(JSON.stringify(record));
  const binary = Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
  return btoa(binary).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/**
 * A record out of a link, on top of `initial`; its values are checked by Python, its shape here.
 * @throws {Error} that says what is wrong
 */
export function decode(data, initial) {
  if (data.length > LONGEST_LINK) throw new Error("it is too long");
  let given;
  try {
    const binary = atob(data.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(binary, (letter) => letter.charCodeAt(0));
    given = JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch {
    throw new Error("it is damaged");
  }
  const mapping = (value) => typeof value === "object" && value !== null && !Array.isArray(value);
  if (!mapping(given) || given.widget !== initial.widget) throw new Error("it belongs to another figure");
  const { preset = initial.preset, controls = {}, seed = initial.seed, log = [] } = given;
  if (!mapping(controls) || !Array.isArray(log)) throw new Error("it is damaged");
  const brought = given.given === undefined ? {} : { given: given.given };
  return { widget: initial.widget, preset, controls: { ...initial.controls, ...controls }, seed, log, ...brought };
}
