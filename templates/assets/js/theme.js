// Before the first paint: sets the reader's theme; the class `js`, so that whatever needs scripts keeps its place; and
// the class `unpainted`, which leaves the parts far below without a layout until then. If the page's own script does
// not load, `js` is removed, so that the page looks as it does without scripts, and a line says so.
(() => {
  "use strict";
  const PATIENCE = 10_000; // ms to wait for the script once the page itself is there
  const root = document.documentElement;
  root.classList.add("js");
  // A reload or a step back restores the scroll position, and a fragment sets one: everything above needs its height.
  const [way] = performance.getEntriesByType("navigation");
  root.classList.toggle("unpainted", !location.hash && /** @type {any} */ (way)?.type === "navigate");
  try {
    const theme = localStorage.getItem("ladder-theme");
    if (theme === "light" || theme === "dark") root.dataset.theme = theme;
  } catch {
    // storage is forbidden: the page follows the system
  }

  function look() {
    if (root.dataset.script || !root.classList.contains("js")) return;
    root.classList.remove("js");
    const line = document.createElement("p");
    const reload = document.createElement("button");
    line.className = "unscripted";
    line.setAttribute("role", "alert");
    reload.type = "button";
    reload.className = "button";
    reload.textContent = "Reload";
    reload.addEventListener("click", () => location.reload());
    line.append("This page’s script did not load, so its figures do not work. ", reload);
    document.body.append(line);
  }

  document.addEventListener("readystatechange", () => setTimeout(look, PATIENCE), { once: true });
  document.addEventListener("DOMContentLoaded", look); // by now the deferred script has run or never will
})();
