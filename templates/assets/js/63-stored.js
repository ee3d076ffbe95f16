// The page about the site: a button that forgets what the browser keeps of it, and one that copies its citation.
(() => {
  "use strict";

  const { copy, make, on, text } = Ladder;
  const OURS = "ladder-";

  /** Removes pins, the theme, the kept pages and the worker that keeps them; what cannot be reached is not kept. */
  async function forget() {
    const attempts = [
      async () => Object.keys(localStorage).filter((key) => key.startsWith(OURS)).forEach((key) => localStorage.removeItem(key)),
      async () => (await navigator.serviceWorker.getRegistration())?.unregister(),
      async () => Promise.all((await caches.keys()).filter((key) => key.startsWith(OURS)).map((key) => caches.delete(key))),
    ];
    for (const attempt of attempts) {
      try {
        await attempt();
      } catch {
        // forbidden here, so that nothing was kept either
      }
    }
  }

  Ladder.stored = function (place) {
    const button = make("button", { type: "button", class: "button" }, "Forget all of it");
    const told = make("span", { role: "status" });
    place.replaceChildren(button, " ", told);
    return on(button, "click", async () => {
      await forget();
      text(told, "Forgotten. What you visit next is kept again.");
    });
  };

  Ladder.copied = function (block) {
    const button = make("button", { type: "button", class: "button" }, "Copy");
    block.after(button);
    return on(button, "click", async () => {
      if (await copy(block.textContent)) text(button, "Copied");
      else getSelection().selectAllChildren(block);
    });
  };
})();
