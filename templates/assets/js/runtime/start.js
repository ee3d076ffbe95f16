// When Python starts: a figure has been seen, the page has loaded, the browser is idle. On a line that must be spared,
// at the first touch that needs it.
/** @import { Dispose } from "../base/types.js" */

import { idle, on } from "../base/dom.js";
import { runtime } from "./runtime.js";

const line = navigator.connection;

/** Whether the reader's line is to be spared: asked to, metered, or slow. */
const slow = /2g|^3g/.test(line?.effectiveType ?? "");
export const frugal = Boolean(line?.saveData || line?.type === "cellular" || slow);

/**
 * A hand near a figure before the start: the largest file is fetched already, into the browser's cache. (Of a preload
 * that only a worker uses, Chromium complains.)
 */
function preload() {
  const wasm = runtime.urls.find((url) => url.endsWith(".wasm"));
  if (!wasm || runtime.state !== "idle") return;
  fetch(wasm).then((response) => response.arrayBuffer()).catch(() => {}); // what fails here, the start will tell
}

/** @param {NodeListOf<HTMLElement>} roots */
export function startWhenSeen(roots) {
  if (runtime.state !== "idle" || frugal) return;
  const watch = new IntersectionObserver((entries) => {
    if (!entries.some((entry) => entry.isIntersecting)) return;
    watch.disconnect();
    idle(runtime.start);
  });
  /** @type {Dispose[]} */
  const intent = [];
  const once = () => {
    intent.splice(0).forEach((dispose) => dispose());
    preload();
  };
  for (const root of roots) {
    watch.observe(root);
    intent.push(on(root, "pointerover", once), on(root, "focusin", once));
  }
}
