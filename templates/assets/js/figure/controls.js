// Controls: keeps the inputs in step with the record while a question is pending, and with the frame otherwise.
/** @import { Control, FigureRecord, Value } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { on, text } from "../base/dom.js";
import * as records from "../base/record.js";
import { shownValue } from "./shown_value.js";

/**
 * @param {HTMLFormElement[]} forms
 * @param {string} name
 * @param {Control} spec
 * @param {Pick<FigureRecord, "controls" | "log">} record
 */
function write(forms, name, spec, record) {
  const value = record.controls[name];
  const element = forms.map(({ elements }) => elements.namedItem(name)).find(Boolean);
  const field = /** @type {HTMLInputElement | undefined} */ (element);
  if (!field) return;
  if (spec.kind === "toggle") field.checked = Boolean(value);
  else if (spec.kind === "choice") {
    field.value = String(value);
    const control = forms.map((form) => form.querySelector(`[name="${name}"]`)?.closest(".control")).find(Boolean);
    control?.toggleAttribute("data-adjusted", records.adjusted(record, name, spec));
  } else {
    if (Number(field.value) !== value) field.value = String(value);
    const words = shownValue(spec, value);
    field.setAttribute("aria-valuetext", words);
    const label = field.labels?.[0];
    text(label?.querySelector("output"), words);
    if (!spec.named) return;
    const [choice, labels] = spec.named;
    text(label?.querySelector(".control-label"), labels[String(record.controls[choice])] ?? spec.label);
  }
}

/** @type {(input: HTMLInputElement, spec: Control) => Value} */
function read(input, spec) {
  if (spec.kind === "toggle") return input.checked;
  return spec.kind === "choice" ? input.value : Number(input.value);
}

/** @param {Figure} figure */
export function addControls(figure) {
  const forms = /** @type {HTMLFormElement[]} */ ([...figure.root.querySelectorAll("form.controls")]);
  const specs = figure.spec.controls;

  /** @param {Pick<FigureRecord, "controls" | "log">} record */
  function show(record) {
    for (const [name, spec] of Object.entries(specs)) if (name in record.controls) write(forms, name, spec, record);
  }

  /** Picking the chosen option again fires no change event, but must restore its values. @param {UIEvent} event */
  function reapply({ target, timeStamp }) {
    const { name, type, value } = /** @type {HTMLInputElement} */ (target);
    const { record } = figure;
    if (type !== "radio" || record.controls[name] !== value) return;
    if (!records.adjusted(record, name, specs[name])) return;
    figure.ask(records.control(record, name, value, specs[name]), { by: "control", at: timeStamp });
  }

  /** @param {Event} event */
  function change(event) {
    const input = /** @type {HTMLInputElement} */ (event.target);
    const spec = specs[input.name];
    if (!spec || (event.type === "input") !== (spec.kind === "slider")) return;
    const { name } = input;
    const record = records.control(figure.record, name, read(input, spec), spec);
    const merge = spec.kind === "slider" ? `control:${name}` : null;
    figure.ask(record, { merge, by: "control", at: event.timeStamp });
  }

  for (const form of forms) {
    on(form, "input", change);
    on(form, "change", change);
    on(form, "click", reapply);
    on(form, "keyup", (event) => event.key === " " && reapply(event));
    on(form, "submit", (event) => event.preventDefault());
    form.hidden = false;
  }
  figure.on("asked", () => show(figure.record));
  figure.on("frame", ({ controls }) => {
    if (!figure.pending) show({ controls, log: figure.record.log });
  });
  show({ controls: figure.frame.controls, log: figure.record.log });
}
