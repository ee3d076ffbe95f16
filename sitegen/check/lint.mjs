// Lints scripts with ESLint: one JSON request on stdin, one JSON answer as the last line of stdout.
// Request: { library, files: { path: text } }. Answer: [{ path, line, column, message }].
// tsc checks names and types; this finds well-formed mistakes, and imports in the wrong direction.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const request = JSON.parse(readFileSync(0, "utf8"));
const { Linter } = await import(pathToFileURL(request.library).href);

const MISTAKES = `
array-callback-return constructor-super for-direction getter-return no-async-promise-executor no-case-declarations
no-class-assign no-compare-neg-zero no-cond-assign no-const-assign no-constant-binary-expression no-constant-condition
no-constructor-return no-control-regex no-debugger no-delete-var no-dupe-args no-dupe-class-members no-dupe-else-if
no-dupe-keys no-duplicate-case no-duplicate-imports no-empty no-empty-character-class no-empty-pattern
no-empty-static-block no-ex-assign no-extra-boolean-cast no-fallthrough no-func-assign no-global-assign
no-import-assign no-invalid-regexp no-irregular-whitespace no-loss-of-precision no-misleading-character-class
no-new-native-nonconstructor no-nonoctal-decimal-escape no-obj-calls no-octal no-promise-executor-return
no-prototype-builtins no-redeclare no-regex-spaces no-self-assign no-self-compare no-setter-return
no-shadow-restricted-names no-sparse-arrays no-this-before-super no-unassigned-vars no-unexpected-multiline
no-unmodified-loop-condition no-unreachable no-unreachable-loop no-unsafe-finally no-unsafe-negation
no-unsafe-optional-chaining no-unused-labels no-unused-private-class-members no-useless-assignment
no-useless-backreference no-useless-catch no-useless-escape no-var no-with prefer-const require-yield
use-isnan valid-typeof`;
const RULES = {
  ...Object.fromEntries(MISTAKES.trim().split(/\s+/).map((name) => [name, "error"])),
  eqeqeq: "error",
  "no-unused-vars": ["error", { argsIgnorePattern: "^_" }],
  "no-promise-executor-return": ["error", { allowVoid: true }],
};

/** Folder of the page's scripts → the folders that it must not import from. */
const ABOVE = {
  base: ["runtime", "figure", "deck", "page"],
  runtime: ["figure", "deck", "page"],
  figure: ["deck", "page"],
  deck: ["page"],
  page: ["deck"],
};
const oneWay = Object.entries(ABOVE).map(([folder, above]) => ({
  files: [`**/js/${folder}/**`],
  rules: { "no-restricted-imports": ["error", { patterns: [...above.map((name) => `**/${name}/**`), "**/main.js"] }] },
}));

const module = (type) => ({ ecmaVersion: "latest", sourceType: type });
const config = [
  { files: ["**/*.js", "**/*.mjs"], languageOptions: module("module"), rules: RULES },
  { files: ["**/sw.js"], languageOptions: module("script") },
  ...oneWay,
];

const linter = new Linter({ configType: "flat" });
const answers = Object.entries(request.files).flatMap(([path, text]) =>
  linter.verify(text, config, { filename: path }).map(({ line, column, message, ruleId }) => ({
    path,
    line: line ?? 0,
    column: column ?? 0,
    message: ruleId ? `${message} (${ruleId})` : message,
  })),
);
process.stdout.write(JSON.stringify(answers) + "\n", () => process.exit(0));
