// A control's value as text, written as the build does: `slider_text` in sitegen/pages/views.py.
/** @import { Control, Value } from "../base/types.js" */

import { quantity } from "../base/format.js";

/**
 * Fixed decimals, a true minus sign, a no-break space before the unit, except before °.
 * @type {(spec: Control, value: Value) => string}
 */
export function shownValue(spec, value) {
  if (spec.kind === "toggle") return value ? "on" : "off";
  if (spec.kind === "choice") return spec.options[String(value)] ?? String(value);
  const digits = Number(value).toFixed(spec.decimals).replace(/^-(?=0\.?0*$)/, "").replace("-", "−");
  return quantity(digits, spec.unit);
}
