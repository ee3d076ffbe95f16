// A page that is open while a new version of the site is published asks for files that are gone. If Python, or a part
// that it needs later, could not be loaded, the page checks whether that is why: then only a reload helps.
/** @import { Figure } from "./figure.js" */

import { fragmentOf } from "../base/address.js";
import * as records from "../base/record.js";
import { figures } from "./registry.js";
import { runtime } from "../runtime/runtime.js";

/**
 * Whether a page would load other files later, judged by file names with content hashes. Attributes added by browser
 * extensions are ignored.
 * @param {Document} page
 */
const differs = ({ body }) =>
  Object.entries(body.dataset).some(([name, value]) => value !== document.body.dataset[name]);

async function look() {
  const answer = await fetch(location.pathname + location.search, { cache: "no-cache" });
  if (!answer.ok) return;
  const page = new DOMParser().parseFromString(await answer.text(), "text/html");
  published.anew = differs(page);
  for (const figure of figures.values()) figure.tell();
}

export const published = {
  anew: false,
  /**
   * Loads the new version of the page; the address carries the state that the reader is waiting for.
   * @param {Figure} figure
   */
  reload(figure) {
    if (figure.waiting) history.replaceState(null, "", fragmentOf(figure.id, records.encode(figure.record)));
    location.reload();
  },
};

const check = () => void look().catch(() => {}); // without a network nothing is known
runtime.on("change", () => runtime.state === "failed" && !runtime.stopped && check());
runtime.on("lack", check);
