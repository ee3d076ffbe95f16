// A page that a browser saved as it stood: its scripts run again, over what they once made. Neither tapes nor Python
// were saved, and the pictures need not be those of the records that the page was built with, so figures stay pictures.
import { find, text } from "../base/dom.js";
import { addPictureButtons } from "../figure/export.js";

const MADE = ".figure-handles > *, .enlarge, .figure-take, .way-back, dialog.search";
const WORDS = "Saved as a picture. The figure itself works on the site, and in the download named at the page’s foot.";

/** Whether this page is such a copy: a page as it is sent does not say that its script has run. */
export const isSaved = document.documentElement.dataset.script === "here";

/** Removes what will be made again, or could do nothing. */
export function clear() {
  for (const node of document.querySelectorAll(MADE)) node.remove();
  for (const button of /** @type {NodeListOf<HTMLButtonElement>} */ (document.querySelectorAll("button.try"))) button.disabled = true;
  for (const card of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".card"))) card.hidden = true;
}

/** @param {HTMLElement} root a figure */
export function still(root) {
  const controls = /** @type {NodeListOf<HTMLButtonElement>} */ (root.querySelectorAll("button, input, select"));
  for (const control of controls) control.disabled = true;
  text(find(root, ".figure-status"), WORDS);
  addPictureButtons(root);
}
