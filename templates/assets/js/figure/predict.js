// A prediction before the run: the reader picks an answer or places a ghost, then the figure runs and shows both. The
// score stays in the tab.
/** @import { Figure } from "./figure.js" */
/** @import { Overlay } from "./overlay.js" */

import { around, calm, find, findButton, make, on, pageName, text } from "../base/dom.js";
import * as records from "../base/record.js";
import { session } from "../base/store.js";
import { createGhost } from "./ghost.js";
import { approach } from "./links.js";
import { createPlay } from "./play.js";

const KEY = "ladder:predictions";

/** Whether each prediction in this tab so far was right, by page and figure; the first answer counts. */
function score() {
  const results = session.get(KEY);
  return /** @type {Record<string, boolean>} */ (results && typeof results === "object" ? results : {});
}

/**
 * @param {string} name
 * @param {boolean} right
 */
function count(name, right) {
  const answers = { [name]: right, ...score() };
  session.set(KEY, answers);
  const of = Object.values(answers);
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
  const status = find(box, ".predict-says");
  const asks = JSON.parse(box.dataset.record ?? "{}");
  const target = () => ({ ...figure.fresh, ...asks });
  const tolerance = Number(box.dataset.within ?? 0);
  const play = createPlay(figure, target);
  let restores = false; // whether the answer puts the reader's settings back
  const name = `${pageName()}#${figure.id}`;
  /** @type {ReturnType<typeof createGhost> | null} */
  let ghost = null;
  /** @type {(() => void) | null} called once the run's end is shown */
  let compare = null;
  /** @type {(() => void) | null} ends the wait for the picture in which a ghost is placed */
  let waits = null;

  /** @type {(record: import("../base/types.js").FigureRecord) => boolean} */
  const isShown = (record) => records.key(figure.shown) === records.key(record) && !figure.pending;

  /** @param {boolean} right @param {string | Node} words */
  function tell(right, words) {
    box?.setAttribute("data-told", right ? "right" : "wrong");
    status.replaceChildren(
      make("strong", {}, right ? "Right." : "Wrong."),
      " ",
      words,
      " ",
      restores ? "The settings were put back to those of the question. " : "",
      make("span", { class: "predict-score" }, `${count(name, right)}.`),
      " ",
      make("button", { type: "button", "data-do": "again" }, "Ask again"),
    );
  }

  /** @param {() => void} callback */
  function run(callback) {
    compare = callback;
    if (play && !calm()) play.go();
    else approach(figure, target(), "predict");
    look();
  }

  function look() {
    if (ghost && !ghost.compared && !compare) return follow();
    if (!isShown(target()) && !play?.ended()) {
      if (ghost?.compared && !compare) clear(); // the result that it is compared with is gone
      return;
    }
    const action = compare;
    compare = null;
    action?.();
    if (action) figure.speak();
  }

  /** Judges a ghost when the reader's own presses have run the figure, and withdraws it when they lead elsewhere. */
  function follow() {
    if (figure.pending) return;
    const record = records.left(figure.shown, ...(figure.spec.hovers ?? []));
    if (isShown(target()) || play?.ended()) {
      judge();
      figure.speak();
    } else if (records.key(record) !== records.key(figure.fresh) && !play?.within(record)) clear();
  }

  /** Notes whether the settings are neither the figure's nor the question's. */
  function compareSettings() {
    const keys = [figure.record, figure.fresh, target()].map((record) => records.key(records.reset(record)));
    const [current, ...expected] = keys;
    restores = !expected.includes(current);
  }

  /** @param {HTMLElement} chosen */
  function answer(chosen) {
    compareSettings();
    for (const option of answers) {
      option.setAttribute("aria-pressed", String(option === chosen));
      option.setAttribute("aria-disabled", "true");
    }
    const right = chosen.dataset.right === "yes";
    run(() => {
      for (const option of answers) option.classList.toggle("is-right", option.dataset.right === "yes");
      const correct = answers.filter((option) => option.dataset.right === "yes");
      const rights = correct.map((option) => option.textContent?.trim());
      tell(right, make("span", { class: "visually-hidden" }, `${rights.join(", ").replace(/\.?$/, ".")}`));
    });
  }

  /** Adds a ghost where the source is, for the reader to drag to where it will stop. */
  function placeGhost() {
    compareSettings();
    if (!isShown(figure.fresh)) figure.ask(figure.fresh);
    const begin = () => {
      if (!isShown(figure.fresh)) return;
      unwait();
      ghost = createGhost(figure, overlay);
      offer(true);
      text(status, "Drag the ghost to where the source will stop; the dashed handle turns it.");
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
    const previous = restores;
    compareSettings();
    restores ||= previous;
    ghost?.fix();
    run(judge);
  }

  /** Compares the ghost with the run's end, which is shown. */
  function judge() {
    ghost?.fix();
    const far = ghost?.compare() ?? 0;
    const right = far <= tolerance;
    const limit = right ? "" : `; right means within ${tolerance}\u00a0u`;
    tell(right, `Your ghost’s points are ${far.toFixed(2)}\u00a0u away on average${limit}.`);
  }

  /** @param {boolean} placed  whether there is a ghost to run; a question without ghosts has neither button */
  function offer(placed) {
    box?.querySelector("[data-do=place]")?.toggleAttribute("hidden", placed);
    box?.querySelector("[data-do=run]")?.toggleAttribute("hidden", !placed);
  }

  /** Withdraws the prediction. */
  function clear() {
    ghost?.dispose();
    ghost = null;
    compare = null;
    unwait();
    box?.removeAttribute("data-told");
    for (const option of answers) {
      option.classList.remove("is-right");
      option.setAttribute("aria-pressed", "false");
      option.removeAttribute("aria-disabled");
    }
    offer(false);
    status.replaceChildren();
  }

  /** @param {MouseEvent} event */
  function press(event) {
    const button = around(event, "button");
    if (!button || button.getAttribute("aria-disabled") === "true") return;
    if (button.dataset.right) answer(button);
    else if (button.dataset.do === "place") placeGhost();
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
    const isOnWay = ["predict", "play", "hover"].includes(by) || (by !== "left" && further && !play?.counted);
    if (compare && !isOnWay) clear(); // the reader went elsewhere before the run was seen, or it cannot be drawn
  });
}
