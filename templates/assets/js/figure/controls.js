// Controls: the inputs and the record say the same. While a reader moves one, the record leads; else the frame does.
import { on, text } from "../base/dom.js";
import * as records from "../base/record.js";

/** A control's value as text: fixed decimals, a true minus, a space before the unit that no line ends at. */
export function shownValue(spec, value) {
  if (spec.kind === "toggle") return value ? "on" : "off";
  if (spec.kind === "choice") return spec.options[value] ?? String(value);
  const digits = Number(value).toFixed(spec.decimals).replace(/^-(?=0\.?0*$)/, "").replace("-", "−");
  return spec.unit ? `${digits}\u00a0${spec.unit}` : digits;
}

function write(form, name, spec, value) {
  const field = form.elements.namedItem(name);
  if (!field) return;
  if (spec.kind === "toggle") field.checked = value;
  else if (spec.kind === "choice") field.value = value;
  else {
    if (Number(field.value) !== value) field.value = value;
    const shown = shownValue(spec, value);
    field.setAttribute("aria-valuetext", shown);
    text(field.labels[0]?.querySelector("output"), shown);
  }
}

function read(input, spec) {
  if (spec.kind === "toggle") return input.checked;
  return spec.kind === "choice" ? input.value : Number(input.value);
}

export function addControls(figure) {
  const form = figure.root.querySelector("form.controls");
  if (!form) return () => {};
  const specs = figure.spec.controls;

  function show(values) {
    for (const [name, spec] of Object.entries(specs)) if (name in values) write(form, name, spec, values[name]);
  }

  function changed(event) {
    const spec = specs[event.target.name];
    if (!spec || (event.type === "input") !== (spec.kind === "slider")) return;
    const { name } = event.target;
    const wanted = records.control(figure.record, name, read(event.target, spec), spec);
    const merge = spec.kind === "slider" ? `control:${name}` : null;
    figure.ask(wanted, { merge, by: "control", at: event.timeStamp });
  }

  const disposers = [
    on(form, "input", changed),
    on(form, "change", changed),
    on(form, "submit", (event) => event.preventDefault()),
    figure.on("asked", () => show(figure.record.controls)),
    figure.on("frame", (frame) => {
      if (!figure.asked && !figure.waiting.length) show(frame.controls);
    }),
  ];
  form.hidden = false;
  show(figure.frame.controls);
  return () => disposers.forEach((dispose) => dispose());
}
