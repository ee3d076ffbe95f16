// Links to a state (#fig-solve?s=…) and buttons in the text (Try this): both set a figure's record and go to the
// figure.
/** @import { Asker, FigureRecord } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { fragment } from "../base/address.js";
import { sound } from "../base/checked_record.js";
import { around, calm, copy, messageOf, on } from "../base/dom.js";
import * as records from "../base/record.js";
import { MORE, moreOf } from "./more.js";
import { figures } from "./registry.js";
import { runtime } from "../runtime/runtime.js";
import { taped } from "../runtime/tape.js";
import { goTo, offerWayBack } from "./way_back.js";

/**
 * Scrolls the stage into view if needed and moves the focus there; returns whether it scrolled.
 * @param {Figure} figure
 */
function visit(figure) {
  const { stage } = figure;
  const { top, bottom } = stage.getBoundingClientRect();
  const isAway = top < 0 || bottom > innerHeight;
  if (isAway) goTo(stage);
  figure.focus();
  return isAway;
}

/**
 * Shows a record. If it ends in a press that can be shown as a motion, the state before the press comes first.
 * @param {Figure} figure
 * @param {FigureRecord} target
 * @param {Asker} [by]
 */
export function approach(figure, target, by = "") {
  const previous = records.back(target);
  const endsInPress = target.log.at(-1)?.[0] === "press" && !records.pressed(figure.shown, target);
  if (endsInPress && !calm() && (runtime.state === "live" || taped(figure.id, previous))) figure.ask(previous, { by });
  figure.ask(target, { by });
}

/** @param {MouseEvent} event */
function tried(event) {
  const button = around(event, "button.try");
  const { figure: id = "", record = "{}" } = button?.dataset ?? {};
  const figure = figures.get(id);
  if (!button || !figure) return;
  const target = JSON.parse(record);
  const { fresh } = figure;
  if (visit(figure)) offerWayBack(button);
  approach(figure, { ...fresh, ...target, controls: { ...fresh.controls, ...target.controls } });
}

/** @type {Map<string, string>} the state that the address last gave to a figure */
const lastStates = new Map();

/**
 * Shows the state in the address; returns true if there is one.
 * @param {unknown} [known]  whether this entry of the history has been shown before
 */
function linked(known) {
  const { name, state } = fragment();
  const figure = figures.get(name);
  if (!figure || state === null) return;
  const [data, suffix] = state.split(MORE);
  const details = moreOf(figure.root);
  if (details && suffix !== undefined) details.open = true;
  visit(figure);
  if (known && lastStates.get(name) === data) return true; // by Back: the work that began with it stays
  lastStates.set(name, data);
  history.replaceState(true, "");
  try {
    const { record, ignored } = sound(records.decode(data, figure.initial), figure.initial, figure.spec);
    figure.ask(record);
    if (ignored.length) figure.say(`Ignored in the state in this page’s address: ${ignored.join(", ")}.`);
  } catch (error) {
    figure.refuse(`The state in this page’s address cannot be shown: ${messageOf(error)}.`);
  }
  return true;
}

/**
 * Opens the device's share sheet for a link, on a touch device that has one; returns whether that was possible.
 * @param {string} url
 */
async function handOn(url) {
  if (!navigator.share || !matchMedia("(pointer: coarse)").matches) return false;
  try {
    await navigator.share({ title: document.title, url });
  } catch (error) {
    return error instanceof Error && error.name === "AbortError"; // the reader has closed the sheet
  }
  return true;
}

/** @param {Figure} figure */
export function addLinkButton(figure) {
  const button = figure.root.querySelector("[data-link]");
  if (!button) return;
  on(button, "click", async () => {
    const link = figure.link();
    if (await handOn(link)) return;
    const without = figure.shown.given ? " It does not contain your clouds: whoever opens it must open the same files." : "";
    if (await copy(link)) figure.say(`Link copied.${without}`);
    else figure.offer("Link to this state:", link);
  });
}

/**
 * Follows a link to the page's current address: no hashchange fires, but the reader wants to go there.
 * @param {MouseEvent} event
 */
function followAgain(event) {
  const link = around(event, "a[href]");
  const isHandled = event.defaultPrevented || event.button || event.ctrlKey || event.metaKey || event.shiftKey;
  if (!isHandled && link instanceof HTMLAnchorElement && link.href === location.href && linked()) event.preventDefault();
}

export function followLinks() {
  linked();
  on(document, "click", tried);
  on(document, "click", followAgain);
  on(globalThis, "hashchange", () => linked(history.state));
}
