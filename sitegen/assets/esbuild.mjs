// Bundles modules and style sheets with esbuild: one JSON request on stdin, one JSON answer as the last line of stdout.
// Request: { library, wasm, bundles: [{ entry, files: { path: text }, pictures: { name: address } }] }
// Answer: for each bundle { code, map, messages: [{ path, line, column, text }] }, lines and columns from 1.
//
// esbuild's build for browsers runs in this process: its build for Node would start a second one, with whatever is
// called "node" on the machine. Nothing else is read from disk, so the request holds everything in a bundle.

import { readFileSync } from "node:fs";
import { posix } from "node:path";
import { pathToFileURL } from "node:url";
import { setFlagsFromString } from "node:v8";

setFlagsFromString("--liftoff-only"); // the optimising compiler would take seconds, for a run of a tenth of one
globalThis.self = globalThis;

const request = JSON.parse(readFileSync(0, "utf8"));
const { default: esbuild } = await import(pathToFileURL(request.library).href);
await esbuild.initialize({ wasmModule: new WebAssembly.Module(readFileSync(request.wasm)), worker: false });

/** A plugin that resolves files by their names in the request and nothing else. */
function inMemory(files, pictures) {
  return {
    name: "in-memory",
    setup(build) {
      build.onResolve({ filter: /.*/ }, ({ path, importer, kind }) => {
        if (kind === "url-token") return { path: pictures[path] ?? path, external: true };
        const name = kind === "entry-point" ? path : posix.join(posix.dirname(importer.slice(1)), path);
        if (name in files) return { path: `/${name}` };
        return { errors: [{ text: `there is no ${name}` }] };
      });
      build.onLoad({ filter: /.*/ }, ({ path }) => ({
        contents: files[path.slice(1)],
        loader: path.endsWith(".css") ? "css" : "js",
      }));
    },
  };
}

function problemOf({ text, location, notes }) {
  const words = [text, ...notes.map((note) => note.text)].join(" ");
  if (!location) return { path: "", line: 0, column: 0, text: words };
  const { file, line, column, lineText } = location; // column: in bytes
  const head = Buffer.from(lineText).subarray(0, column).toString();
  return { path: file.replace(/^\//, ""), line, column: [...head].length + 1, text: words };
}

async function bundle({ entry, files, pictures }) {
  const style = entry.endsWith(".css");
  const options = {
    entryPoints: [entry],
    bundle: true,
    minify: true,
    charset: "utf8",
    legalComments: "none",
    format: style ? undefined : entry.endsWith(".mjs") ? "esm" : "iife",
    banner: entry.endsWith(".js") ? { js: '"use strict";' } : {}, // a classic script is not strict by default
    sourcemap: "external",
    absWorkingDir: "/",
    outdir: "/",
    write: false,
    logLevel: "silent",
    plugins: [inMemory(files, pictures)],
  };
  const { outputFiles = [], errors, warnings } = await esbuild.build(options).catch((failed) => {
    if (!failed.errors) throw failed;
    return failed;
  });
  const text = (map) => outputFiles.find(({ path }) => path.endsWith(".map") === map)?.text ?? "";
  return { code: text(false), map: text(true), messages: [...errors, ...warnings].map(problemOf) };
}

const answers = [];
for (const item of request.bundles) answers.push(await bundle(item));
process.stdout.write(JSON.stringify(answers) + "\n", () => process.exit(0));
