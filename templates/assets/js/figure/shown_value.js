// A control's value in words, as the build writes it: `shown` in sitegen/pages/views.py.
/** @import { Control, Value } from "../base/types.js" */

/**
 * Fixed decimals, a true minus, a space before the unit that no line ends at; 60° has none.
 * @type {(spec: Control, value: Value) => string}
 */
export function shownValue(spec, value) {
  if (spec.kind === "toggle") return value ? "on" : "off";
  if (spec.kind === "choice") return spec.options[String(value)] ?? String(value);
  const digits = Number(value).toFixed(spec.decimals).replace(/^-(?=0\.?0*$)/, "").replace("-", "−");
  const apart = spec.unit && spec.unit !== "°";
  return apart ? `${digits}\u00a0${spec.unit}` : `${digits}${spec.unit}`;
}
