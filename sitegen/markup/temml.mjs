// Formulas to MathML: one JSON request on stdin, one JSON answer as the last line of stdout.
// Request: { module, macros: { "\\name": "LaTeX" }, formulas: [{ source, display }] }
// Answer: for each formula { mathml } or { message, position }, position an offset in the source or null.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const request = JSON.parse(readFileSync(0, "utf8"));
const { default: temml } = await import(pathToFileURL(request.module).href);

const answers = request.formulas.map(({ source, display }) => {
  try {
    const macros = { ...request.macros }; // a formula that defines a macro defines it for itself
    const options = { displayMode: display, annotate: display, throwOnError: true, strict: true, macros };
    return { mathml: temml.renderToString(source, options) };
  } catch (error) {
    return { message: String(error.message), position: Number.isInteger(error.position) ? error.position : null };
  }
});
process.stdout.write(JSON.stringify(answers) + "\n", () => process.exit(0));
