// Before the first paint: the reader's theme, a class that says scripts run: what needs them keeps its place, and one that
// leaves what is far below without a layout until then. Where the page's own script does not come, the first class goes,
// so that the page is what it is without scripts, and a line says it.
(() => {
  "use strict";
  const PATIENCE = 10_000; // ms for the script, once the page itself is there
  const root = document.documentElement;
  root.classList.add("js");
  // A reload and a way back lead to a place in the page, as an address may: all above it must have its height.
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
  document.addEventListener("DOMContentLoaded", look); // by now a deferred script has run, or never will
})();
