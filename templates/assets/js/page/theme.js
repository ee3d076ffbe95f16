// The theme button: auto, light, dark; the choice is stored and followed by every open page of the site.
import { on } from "../base/dom.js";

const THEMES = ["auto", "light", "dark"];
const KEY = "ladder-theme";
const page = document.documentElement;

function storedTheme() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return undefined;
  }
}

/** @param {HTMLElement} button */
export function addThemeButton(button) {
  const current = () => (THEMES.find((theme) => theme === page.dataset.theme) ?? "auto");

  /** @param {string} theme */
  function show(theme) {
    page.dataset.theme = THEMES.includes(theme) ? theme : "auto";
    button.setAttribute("aria-label", `Theme: ${current()}`);
    button.dataset.now = current();
  }

  on(button, "click", () => {
    show(THEMES[(THEMES.indexOf(current()) + 1) % THEMES.length]);
    try {
      localStorage.setItem(KEY, current());
    } catch {
      // the choice lasts for this page only
    }
  });
  on(globalThis, "storage", ({ key, newValue }) => key === KEY && show(newValue ?? "auto"));
  on(globalThis, "pageshow", ({ persisted }) => {
    const theme = storedTheme();
    if (persisted && theme !== undefined) show(theme ?? "auto"); // null: forgotten on another page
  });
  show(current());
}
