// Keeps the site for offline use once the browser is idle, and says at the page's foot when all of it is kept.
import { idle, text } from "../base/dom.js";
import { megabytes } from "../base/format.js";
import { runtime } from "./runtime.js";
import { frugal } from "./start.js";

const worker = new URL("../sw.js", /** @type {HTMLScriptElement} */ (document.currentScript).src);

/** ready: every page and Python are kept, so that all works without the server. */
export const offline = { ready: false };

/** @param {boolean} ready @param {string} words what the page's foot says of it */
function show(ready, words) {
  offline.ready = ready;
  text(document.querySelector(".site-kept"), words);
}

/** Joins the pages of this site in all tabs: what one of them forgets is gone for the others. */
const channel = () => new BroadcastChannel(`ladder:${worker.pathname}`);

/** Nothing is kept any more: said here and in the other tabs. */
export async function forgotten() {
  show(false, "");
  channel().postMessage("forgotten");
}

/**
 * Until Python is up, or is not wanted yet: two loads of it at once would only slow each other down.
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
    // a browser may refuse, or have no such thing; the site works all the same
  }
}

export function keepOffline() {
  if (frugal || !location.protocol.startsWith("http")) return;
  idle(() => idle(keep)); // Python's start, where a figure is in sight, waits for the first of them
}
