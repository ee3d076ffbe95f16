// Before the first paint: the reader's theme, and a class that says scripts run: what needs them keeps its place.
(() => {
  "use strict";
  const root = document.documentElement;
  root.classList.add("js");
  try {
    const theme = localStorage.getItem("ladder-theme");
    if (theme === "light" || theme === "dark") root.dataset.theme = theme;
  } catch {
    // storage is forbidden: the page follows the system
  }
})();
