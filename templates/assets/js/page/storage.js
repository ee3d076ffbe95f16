// The About page's buttons: one deletes everything that the browser stores for the site, one copies its citation.
import { copy, make, on, text } from "../base/dom.js";
import { forgotten } from "../runtime/offline.js";

/** Removes the service worker and everything that it has cached for this site. */
async function unkeep() {
  const registration = await navigator.serviceWorker.getRegistration();
  if (!registration) return;
  const ours = `ladder-offline:${new URL(registration.scope).pathname}:`;
  const names = (await caches.keys()).filter((name) => name.startsWith(ours));
  await Promise.all([...names.map((name) => caches.delete(name)), registration.unregister()]);
}

/** @param {() => Storage} storage */
async function empty(storage) {
  const ours = Object.keys(storage()).filter((key) => /^ladder[-:]/.test(key));
  ours.forEach((key) => storage().removeItem(key));
}

/** Deletes everything. A storage that the browser denies access to holds nothing either, so its failure is ignored. */
const forget = () => Promise.allSettled([empty(() => localStorage), empty(() => sessionStorage), unkeep()]);

/** @param {HTMLElement} parent */
export function addForgetButton(parent) {
  const button = make("button", { type: "button", class: "button" }, "Forget all of it");
  const status = make("span", { role: "status" });
  parent.replaceChildren(button, " ", status);
  on(button, "click", async () => {
    await forget();
    forgotten().catch(() => {}); // without BroadcastChannel the other tabs cannot be told
    text(status, "Forgotten. Whatever you visit next is stored again.");
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
