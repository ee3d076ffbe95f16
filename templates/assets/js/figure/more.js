// More: a figure's secondary parts. It opens in place, and by itself if a link says that it was open.
/** @import { Figure } from "./figure.js" */

import { on } from "../base/dom.js";

export const MORE = "&more"; // in the address of a state, after the record

/** @type {(root: HTMLElement) => HTMLDetailsElement | null} */
export const moreOf = (root) => root.querySelector("details.figure-rest");

/**
 * Has the parts behind it measured once they are shown.
 * @param {Figure} figure
 */
export function addMore(figure) {
  const details = moreOf(figure.root);
  if (details) on(details, "toggle", () => figure.rescaled());
}
