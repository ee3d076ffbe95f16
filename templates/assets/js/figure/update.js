// If Python, or a part that it needs later, could not be loaded, figures offer a reload where the site has been updated
// since the page was opened.
/** @import { Figure } from "./figure.js" */

import { fragmentOf } from "../base/address.js";
import * as records from "../base/record.js";
import { hasNewVersion } from "../base/version.js";
import { figures } from "./registry.js";
import { runtime } from "../runtime/runtime.js";

async function look() {
  update.available = await hasNewVersion();
  for (const figure of figures.values()) figure.tell();
}

export const update = {
  available: false,
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
