// Stores the site for offline use once the browser is idle; a line in the footer says when it is complete.
import { idle, text } from "../base/dom.js";
import { megabytes } from "../base/format.js";
import { runtime } from "./runtime.js";
import { frugal } from "./start.js";

const worker = new URL("../sw.js", /** @type {HTMLScriptElement} */ (document.currentScript).src);

/** ready: every page and Python are stored, so that everything works without the server. */
export const offline = { ready: false };

/** @param {boolean} ready @param {string} words the footer's line */
function show(ready, words) {
  offline.ready = ready;
  text(document.querySelector(".site-kept"), words);
}

/** A channel between this site's pages in all tabs: what one of them deletes is gone for the others too. */
const channel = () => new BroadcastChannel(`ladder:${worker.pathname}`);

/** Clears the footer's line here and in the other tabs: nothing is stored any more. */
export async function forgotten() {
  show(false, "");
  channel().postMessage("forgotten");
}

/**
 * Resolves as soon as Python is not loading: two loads at once would only slow each other down.
 * @returns {Promise<void>}
 */
function quiet() {
  return new Promise((resolve) => {
    const stop = runtime.on("change", look);
    function look() {
      if (runtime.state === "loading") return;
      stop();
      resolve();
    }
    look();
  });
}

/**
 * @param {ServiceWorker} active
 * @returns {Promise<{ kept: boolean, bytes: number }>}
 */
function ask(active) {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = ({ data }) => {
      port1.close();
      resolve(data);
    };
    active.postMessage({ keep: true }, [port2]);
  });
}

async function keep() {
  try {
    await quiet();
    await navigator.serviceWorker.register(worker);
    const { active } = await navigator.serviceWorker.ready;
    await quiet();
    const { kept, bytes } = await ask(/** @type {ServiceWorker} */ (active));
    if (!kept) return;
    show(true, `Works offline: stored on this device (${megabytes(bytes)} MB)`);
    channel().onmessage = () => show(false, "");
  } catch {
    // a browser may refuse or lack service workers; the site works without them
  }
}

export function keepOffline() {
  if (frugal || !location.protocol.startsWith("http")) return;
  idle(() => idle(keep)); // after Python's start, which takes the first idle period if a figure is in sight
}
