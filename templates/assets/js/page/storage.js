// The page about the site: a button that forgets what the browser keeps of it, and one that copies its citation.
import { copy, make, on, text } from "../base/dom.js";
import { forgotten } from "../runtime/offline.js";

/** The worker that keeps the pages, and all that it has kept of this site. */
async function unkeep() {
  const registration = await navigator.serviceWorker.getRegistration();
  if (!registration) return;
  const ours = `ladder-offline:${new URL(registration.scope).pathname}:`;
  const kept = (await caches.keys()).filter((name) => name.startsWith(ours));
  await Promise.all([...kept.map((name) => caches.delete(name)), registration.unregister()]);
}

/** @param {() => Storage} storage */
async function empty(storage) {
  const ours = Object.keys(storage()).filter((key) => /^ladder[-:]/.test(key));
  ours.forEach((key) => storage().removeItem(key));
}

/** What the browser forbids to ask for it has not kept either. */
const forget = () => Promise.allSettled([empty(() => localStorage), empty(() => sessionStorage), unkeep()]);

/** @param {HTMLElement} place */
export function addForgetButton(place) {
  const button = make("button", { type: "button", class: "button" }, "Forget all of it");
  const told = make("span", { role: "status" });
  place.replaceChildren(button, " ", told);
  on(button, "click", async () => {
    await forget();
    forgotten().catch(() => {}); // a browser without channels has only this tab to tell
    text(told, "Forgotten. Whatever you visit next is stored again.");
  });
}

/** @param {HTMLElement} block */
export function addCopyButton(block) {
  const button = make("button", { type: "button", class: "button" }, "Copy");
  block.nextElementSibling?.replaceChildren(button);
  on(button, "click", async () => {
    if (await copy(block.textContent ?? "")) text(button, "Copied");
    else getSelection()?.selectAllChildren(block);
  });
}
