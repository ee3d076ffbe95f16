// A record that came with an address: what is sound of it is taken, the rest is named. Python checks it all once more.

const FURTHEST = 1e6;
const LONGEST = 2000; // actions
const PRINT = /^[0-9a-f]{32}$/; // the fingerprint of a file that the link's writer had
const finite = (value, most) => typeof value === "number" && Math.abs(value) < most;

const fits = {
  slider: ({ low, high }, value) => finite(value, 1e15) && value >= low - 1e-9 && value <= high + 1e-9,
  choice: ({ options }, value) => typeof value === "string" && Object.hasOwn(options, value),
  toggle: (_, value) => typeof value === "boolean",
};

/** Whether the figure knows such an action: what is pressed is a button, all else has a place in the world. */
function known(spec, action) {
  if (!Array.isArray(action)) return false;
  const [kind, name, ...place] = action;
  if (kind === "press") return !place.length && spec.buttons.some((each) => each.does === "press" && each.name === name);
  const names = { drag: spec.handles, click: spec.clicks, hover: spec.hovers };
  const there = Object.hasOwn(names, kind) && names[kind].includes(name);
  return there && place.length === 2 && place.every((value) => finite(value, FURTHEST));
}

/** Of what a link's writer had brought along, what is named by a fingerprint. */
function brought(given, takes, ignored) {
  if (typeof given !== "object" || given === null || Array.isArray(given)) {
    ignored.push("what was brought along");
    return {};
  }
  const sound = ([place, key]) => takes.includes(place) && typeof key === "string" && PRINT.test(key);
  const [kept, others] = [true, false].map((is) => Object.entries(given).filter((each) => sound(each) === is));
  ignored.push(...others.map(([place]) => (takes.includes(place) ? `the ${place}` : `“${place.slice(0, 30)}”`)));
  return kept.length ? { given: Object.fromEntries(kept) } : {};
}

/**
 * The sound part of what a link gave, on top of `initial`, and the names of what was left out. From the first action
 * on that the figure does not know, none is taken: the later ones were done to a state that cannot be reached.
 */
export function sound(given, initial, spec) {
  const ignored = [];
  const controls = { ...initial.controls };
  for (const [name, value] of Object.entries(given.controls)) {
    const control = Object.hasOwn(spec.controls, name) ? spec.controls[name] : null;
    if (control && fits[control.kind](control, value)) controls[name] = value;
    else ignored.push(control ? control.label.toLowerCase() : `“${name.slice(0, 30)}”`);
  }
  const seed = Number.isInteger(given.seed) && given.seed >= 0 && given.seed < 2 ** 31;
  if (!seed) ignored.push("the seed");
  const stop = given.log.findIndex((action) => !known(spec, action));
  const count = Math.min(stop < 0 ? given.log.length : stop, LONGEST);
  if (count < given.log.length) ignored.push(`what was done from action ${count + 1} on`);
  const record = { ...initial, controls, seed: seed ? given.seed : initial.seed, log: given.log.slice(0, count) };
  if (given.given !== undefined) Object.assign(record, brought(given.given, spec.takes, ignored));
  return { record, ignored };
}
