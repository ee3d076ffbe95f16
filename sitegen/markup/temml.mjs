// Formulas to MathML: one JSON request on stdin, one JSON answer as the last line of stdout.
// Request: { module, macros: { "\\name": "LaTeX" }, formulas: [{ source, display }] }
// Answer: for each formula { mathml } or { message, position }, position an offset in the source or null.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const request = JSON.parse(readFileSync(0, "utf8"));
const { default: temml } = await import(pathToFileURL(request.module).href);

// Dots and named functions spaced as in print: no operator's space about dots, none after a function that ends a formula,
// and one thin space before a function, also where the author has written it. Without attributes that change nothing.
const SPACED = [
  [/<mo>([…⋯])<\/mo>/g, "<mi>$1</mi>"],
  [/(<mspace width="0.1667em"><\/mspace>)((?:<mrow>)?)\1/g, "$2$1"],
  [/<mspace width="0.1667em"><\/mspace>((?:<\/mrow>)*<\/math>)/g, "$1"],
  [/ (?:fence|separator)="true"/g, ""],
];
const spaced = (mathml) => SPACED.reduce((text, [pattern, replacement]) => text.replace(pattern, replacement), mathml);

const answers = request.formulas.map(({ source, display }) => {
  try {
    const macros = { ...request.macros }; // a formula that defines a macro defines it for itself
    const options = { displayMode: display, annotate: display, throwOnError: true, strict: true, macros };
    return { mathml: spaced(temml.renderToString(source, options)) };
  } catch (error) {
    return { message: String(error.message), position: Number.isInteger(error.position) ? error.position : null };
  }
});
process.stdout.write(JSON.stringify(answers) + "\n", () => process.exit(0));
