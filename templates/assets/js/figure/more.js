// More: what of a figure does not lead. It opens in place, by itself where something in it is meant, and a link tells it.
/** @import { Figure } from "./figure.js" */

import { on } from "../base/dom.js";

export const MORE = "&more"; // in the address of a state, after the record

/** @type {(root: HTMLElement) => HTMLDetailsElement | null} */
export const moreOf = (root) => root.querySelector("details.figure-rest");

/**
 * What is behind it is measured once it is seen.
 * @param {Figure} figure
 */
export function addMore(figure) {
  const more = moreOf(figure.root);
  if (more) on(more, "toggle", () => figure.rescaled());
}
