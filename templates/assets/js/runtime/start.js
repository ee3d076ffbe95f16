// When Python starts: once a figure has been in view, the page has loaded and the browser is idle; on a slow or metered
// connection only when an interaction needs it.
/** @import { Dispose } from "../base/types.js" */

import { idle, on } from "../base/dom.js";
import { runtime } from "./runtime.js";

const line = navigator.connection;

/** Whether to save the reader's data: on request, or because the connection is metered or slow. */
const slow = /2g|^3g/.test(line?.effectiveType ?? "");
export const frugal = Boolean(line?.saveData || line?.type === "cellular" || slow);

/**
 * Fetches the largest file into the browser's cache when a pointer or the focus reaches a figure before the start.
 * (Chromium warns about a preload link that only a worker uses.)
 */
function preload() {
  const wasm = runtime.urls.find((url) => url.endsWith(".wasm"));
  if (!wasm || runtime.state !== "idle") return;
  fetch(wasm, { priority: "low" }).then((response) => response.arrayBuffer()).catch(() => {}); // the start will report what fails here
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
