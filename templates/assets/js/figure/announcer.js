// What a figure says to those who hear it: what the reader's own doing led to, and nothing unasked. It speaks once things
// have been still for a moment, now and then while they are not, and never more often than one can listen.
/** @import { Frame, Readout } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { find } from "../base/dom.js";
import { limits } from "../base/limits.js";

const MOST = 8; // numbers in one go

/** @param {string} words */
const sentences = (words) => words.split(/(?<=[.!?])\s+/);
/** @param {Readout} readout */
const told = ({ label, value, unit }) => (value === "–" ? `${label} none` : `${label} ${value} ${unit}`.trimEnd());

/**
 * What there is to tell of the frame `now` to who knows `before`: its note, and the numbers that are new.
 * @type {(before: Frame, now: Frame) => string}
 */
function news(before, now) {
  const known = new Map(before.readouts.map(({ name, value }) => [name, value]));
  const changed = now.readouts.filter(({ name, value }) => known.get(name) !== value);
  const numbers = changed.slice(0, MOST).map(told).join("; ");
  if (now.note || numbers) return [now.note, numbers && `${numbers}.`].filter(Boolean).join(" ");
  const old = new Set(sentences(before.description));
  return sentences(now.description).find((each) => !old.has(each)) ?? "The numbers are the same.";
}

/**
 * A message, such as why something failed, comes before what is seen.
 * @param {Figure} figure
 */
export function addAnnouncer(figure) {
  const line = find(figure.root, ".figure-voice");
  let known = figure.frame; // the one spoken of last
  let message = "";
  let at = -Infinity; // when it spoke last
  let latest = 0; // when it speaks at the latest; 0 where there is nothing to tell
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let due;

  function speak() {
    const words = message || news(known, figure.frame);
    if (!message) {
      known = figure.frame;
      figure.spoken();
    }
    message = "";
    at = performance.now();
    latest = 0;
    // The same words once more: to be heard, they have to differ.
    line.textContent = line.textContent === words ? `${words}\u00a0` : words;
    plan();
  }

  function plan() {
    clearTimeout(due);
    const fresh = figure.frame !== known;
    if (!fresh && !figure.pending && figure.speaks) figure.spoken(); // nothing came of it
    if (!message && !(fresh && figure.speaks)) return;
    const now = performance.now();
    latest ||= now + limits.gap;
    due = setTimeout(speak, Math.max(at + limits.gap, Math.min(now + limits.pause, latest)) - now);
  }

  figure.on("announce", (words) => {
    message = words;
    plan();
  });
  figure.on("state", plan);
}
