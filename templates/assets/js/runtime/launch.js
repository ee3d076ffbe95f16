// How a worker with Python is launched: its script, the runtime's files, and the message that starts it.
/** @import { RuntimeFile } from "../base/types.js" */

import { store } from "../base/store.js";

const { runtime: folder = "", runtimeFiles, worker: script = "" } = document.body.dataset;
/** @type {RuntimeFile[]} */
export const files = JSON.parse(runtimeFiles || "[]");
export const scriptName = script.split("/").at(-1);
const ENGINE = "ladder-engine"; // storage key: the hash of the engine that last started in this browser
const engine = files.find(({ name }) => name.endsWith(".wasm"))?.sha256;
let launcher = ""; // the blob's URL

/** @param {string} url */
const absolute = (url) => new URL(url, document.baseURI).href;

/** All that a start requests. */
export const addresses = () => [script, ...files.map(({ name }) => folder + name)].map(absolute);

/**
 * A blob URL that imports the worker's script: a worker made from a blob inherits its page's content security policy,
 * whereas one made from a file has only the policy in the file's headers, and some hosts send none.
 */
function blob() {
  const code = `import ${JSON.stringify(absolute(script))};`;
  return URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
}

/**
 * A new worker that has been told to start. careful: an earlier start failed. Throws if the browser allows no worker or,
 * as in a lockdown mode, no WebAssembly: then nothing is loaded in vain.
 * @param {boolean} careful
 */
export function launch(careful) {
  if (!globalThis.WebAssembly) throw new Error("WebAssembly is turned off");
  const worker = new Worker((launcher ||= blob()), { type: "module" });
  const isKnown = store.get(ENGINE) === engine;
  worker.postMessage({ type: "start", runtime: absolute(folder), files, again: careful, known: isKnown });
  return worker;
}

/** Notes that the engine has started in this browser. */
export const noteEngine = () => store.set(ENGINE, engine);
