// A page that is open while the site is published anew asks for files that are gone. Where Python could not be loaded, or
// a part of it later, it looks whether that is why: then a reload helps, and nothing else does.
/** @import { Figure } from "./figure.js" */

import { fragmentOf } from "../base/address.js";
import * as records from "../base/record.js";
import { figures } from "./registry.js";
import { runtime } from "../runtime/runtime.js";

/**
 * Whether a page would load something else later, by names that hold the content's hash. What a browser's extensions
 * have written beside them plays no part.
 * @param {Document} page
 */
const differs = ({ body }) =>
  Object.entries(body.dataset).some(([name, value]) => value !== document.body.dataset[name]);

async function look() {
  const answer = await fetch(location.pathname + location.search, { cache: "no-cache" });
  if (!answer.ok) return;
  const now = new DOMParser().parseFromString(await answer.text(), "text/html");
  published.anew = differs(now);
  for (const figure of figures.values()) figure.tell();
}

export const published = {
  anew: false,
  /**
   * Loads the page as it is now; the state that the reader wants of a figure goes along in the address.
   * @param {Figure} figure
   */
  reload(figure) {
    if (figure.waiting) history.replaceState(null, "", fragmentOf(figure.id, records.encode(figure.record)));
    location.reload();
  },
};

const check = () => void look().catch(() => {}); // no network: nothing is known
runtime.on("change", () => runtime.state === "failed" && !runtime.stopped && check());
runtime.on("lack", check);
