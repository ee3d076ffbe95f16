// In a figure of many small panels one can be enlarged. On a phone one always is, at first the first: it is
// interactive, and the others are buttons that enlarge them.
/** @import { Figure } from "./figure.js" */

import { make, on } from "../base/dom.js";

const PHONE = "(max-width: 40rem)";

/** @param {Figure} figure */
export function addEnlarging(figure) {
  const panels = /** @type {HTMLElement[]} */ ([...figure.root.querySelectorAll(".many > .figure-stage > .figure-panel")]);
  if (!panels.length) return;
  const phone = matchMedia(PHONE);
  const buttons = panels.map((panel) => {
    const button = make("button", { type: "button", class: "enlarge", "aria-pressed": "false" });
    on(button, "click", () => show(panel, !phone.matches && !(enlarged() && large() === panel)));
    panel.append(button);
    return button;
  });

  /**
   * @param {HTMLElement} large
   * @param {boolean} enlarged  on a wide page
   */
  function show(large, enlarged) {
    figure.stage.classList.toggle("enlarged", enlarged);
    panels.forEach((panel, i) => {
      const name = panel.querySelector(".panel-caption > :first-child")?.textContent ?? panel.dataset.panel ?? "";
      panel.classList.toggle("large", panel === large);
      panel.toggleAttribute("data-thumb", phone.matches && panel !== large);
      buttons[i].setAttribute("aria-pressed", String(panel === large && (enlarged || phone.matches)));
      buttons[i].setAttribute("aria-label", `Enlarge ${name}`);
    });
    figure.rescaled();
  }

  const large = () => panels.find((panel) => panel.classList.contains("large")) ?? panels[0];
  const enlarged = () => figure.stage.classList.contains("enlarged");
  const fit = () => show(large(), enlarged());
  on(phone, "change", fit);
  fit();
}
