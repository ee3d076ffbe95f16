// The theme button: auto, light, dark; the choice is stored and followed by every open page of the site.
import { on } from "../base/dom.js";

const THEMES = ["auto", "light", "dark"];
const KEY = "ladder-theme";
const page = document.documentElement;

function kept() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

/** @param {HTMLElement} button */
export function addThemeButton(button) {
  const now = () => (THEMES.find((theme) => theme === page.dataset.theme) ?? "auto");

  /** @param {string} theme */
  function show(theme) {
    page.dataset.theme = THEMES.includes(theme) ? theme : "auto";
    button.setAttribute("aria-label", `Theme: ${now()}`);
    button.dataset.now = now();
  }

  on(button, "click", () => {
    show(THEMES[(THEMES.indexOf(now()) + 1) % THEMES.length]);
    try {
      localStorage.setItem(KEY, now());
    } catch {
      // the choice lasts for this page only
    }
  });
  on(globalThis, "storage", ({ key, newValue }) => key === KEY && show(newValue ?? "auto"));
  on(globalThis, "pageshow", ({ persisted }) => persisted && show(kept() ?? now()));
  show(now());
}
