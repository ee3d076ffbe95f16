// A prediction before the run: the reader picks an answer or places a ghost, then the figure runs and shows both. The
// score stays in the tab.
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, calm, find, findButton, make, on, text } from "../base/dom.js";
import * as records from "../base/record.js";
import { session } from "../base/store.js";
import { createGhost } from "./ghost.js";
import { approach } from "./links.js";
import { createPlay } from "./play.js";

const KEY = "ladder:predictions";

/** Whether each prediction in this tab so far was right, by page and figure; the first answer counts. */
function score() {
  const kept = session.get(KEY);
  return /** @type {Record<string, boolean>} */ (kept && typeof kept === "object" ? kept : {});
}

/**
 * @param {string} name
 * @param {boolean} right
 */
function count(name, right) {
  const all = { [name]: right, ...score() };
  session.set(KEY, all);
  const of = Object.values(all);
  return `${of.filter(Boolean).length} of ${of.length} right in this tab`;
}

/**
 * @param {Figure} figure
 * @param {Overlay} overlay
 */
export function addPrediction(figure, overlay) {
  const box = /** @type {HTMLElement | null} */ (figure.root.querySelector(".predict"));
  if (!box) return;
  const answers = /** @type {HTMLElement[]} */ ([...box.querySelectorAll("[data-right]")]);
  const says = find(box, ".predict-says");
  const asks = JSON.parse(box.dataset.record ?? "{}");
  const wanted = () => ({ ...figure.fresh, ...asks });
  const within = Number(box.dataset.within ?? 0);
  const play = createPlay(figure, wanted);
  let moved = false; // whether the answer puts the reader's settings back
  const name = `${location.pathname.split("/").at(-1)}#${figure.id}`;
  /** @type {ReturnType<typeof createGhost> | null} */
  let ghost = null;
  /** @type {(() => void) | null} called once the run's end is shown */
  let compare = null;
  /** @type {(() => void) | null} ends the wait for the picture in which a ghost is placed */
  let waits = null;

  /** @type {(record: import("../base/types.js").FigureRecord) => boolean} */
  const seen = (record) => records.key(figure.shown) === records.key(record) && !figure.pending;

  /** @param {boolean} right @param {string | Node} words */
  function tell(right, words) {
    box?.setAttribute("data-told", right ? "right" : "wrong");
    says.replaceChildren(
      make("strong", {}, right ? "Right." : "Wrong."),
      " ",
      words,
      " ",
      moved ? "The settings were put back to those of the question. " : "",
      make("span", { class: "predict-score" }, `${count(name, right)}.`),
      " ",
      make("button", { type: "button", "data-do": "again" }, "Ask again"),
    );
  }

  /** @param {() => void} then */
  function run(then) {
    compare = then;
    if (play && !calm()) play.go();
    else approach(figure, wanted(), "predict");
    look();
  }

  function look() {
    if (!seen(wanted()) && !play?.ended()) {
      if (ghost?.compared && !compare) clear(); // the result that it is compared with is gone
      return;
    }
    const does = compare;
    compare = null;
    does?.();
    if (does) figure.speak();
  }

  /** Notes whether the settings are neither the figure's nor the question's. */
  function compareSettings() {
    const [now, ...known] = [figure.record, figure.fresh, wanted()].map((record) => records.key(records.reset(record)));
    moved = !known.includes(now);
  }

  /** @param {HTMLElement} chosen */
  function answer(chosen) {
    compareSettings();
    for (const each of answers) {
      each.setAttribute("aria-pressed", String(each === chosen));
      each.setAttribute("aria-disabled", "true");
    }
    const right = chosen.dataset.right === "yes";
    run(() => {
      for (const each of answers) each.classList.toggle("is-right", each.dataset.right === "yes");
      const rights = answers.filter((each) => each.dataset.right === "yes").map((each) => each.textContent?.trim());
      tell(right, make("span", { class: "visually-hidden" }, `${rights.join(", ").replace(/\.?$/, ".")}`));
    });
  }

  /** Adds a ghost where the source is, for the reader to drag to where it will stop. */
  function place() {
    compareSettings();
    if (!seen(figure.fresh)) figure.ask(figure.fresh);
    const begin = () => {
      if (!seen(figure.fresh)) return;
      unwait();
      ghost = createGhost(figure, overlay);
      findButton(/** @type {HTMLElement} */ (box), "[data-do=place]").hidden = true;
      findButton(/** @type {HTMLElement} */ (box), "[data-do=run]").hidden = false;
      text(says, "Drag the ghost to where the source will stop; the dashed handle turns it.");
      ghost.focus();
    };
    unwait();
    waits = figure.on("frame", begin);
    begin();
  }

  function unwait() {
    waits?.();
    waits = null;
  }

  function stop() {
    const before = moved;
    compareSettings();
    moved ||= before;
    ghost?.fix();
    run(() => {
      const far = ghost?.compare() ?? 0;
      const right = far <= within;
      const limit = right ? "" : `; right means within ${within} u`;
      tell(right, `Your ghost’s points are ${far.toFixed(2)} u away on average${limit}.`);
    });
  }

  /** Withdraws the prediction. */
  function clear() {
    ghost?.dispose();
    ghost = null;
    compare = null;
    unwait();
    box?.removeAttribute("data-told");
    for (const each of answers) {
      each.classList.remove("is-right");
      each.setAttribute("aria-pressed", "false");
      each.removeAttribute("aria-disabled");
    }
    const [to, go] = ["place", "run"].map((each) => box?.querySelector(`[data-do=${each}]`));
    to?.removeAttribute("hidden");
    go?.setAttribute("hidden", "");
    says.replaceChildren();
  }

  /** @param {MouseEvent} event */
  function press(event) {
    const button = around(event, "button");
    if (!button || button.getAttribute("aria-disabled") === "true") return;
    if (button.dataset.right) answer(button);
    else if (button.dataset.do === "place") place();
    else if (button.dataset.do === "run") stop();
    else {
      clear();
      figure.ask(figure.fresh);
      findButton(/** @type {HTMLElement} */ (box), ".predict-answers button").focus();
    }
  }

  box.hidden = false;
  on(box, "click", press);
  figure.on("frame", look);
  figure.on("asked", (by) => {
    if (by !== "hover") unwait(); // the reader went elsewhere before there was a ghost
    const further = figure.record.log.length > 0 && play?.within(figure.record);
    const there = ["predict", "play", "hover"].includes(by) || (by !== "left" && further && !play?.counted);
    if (compare && !there) clear(); // the reader went elsewhere before the run was seen, or it cannot be drawn
  });
}
