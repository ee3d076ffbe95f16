// What a figure announces to screen readers: the results of the reader's own actions, nothing else. It speaks once the
// figure has been still for a moment, now and then while it is not, and never faster than one can listen.
/** @import { Frame, Readout } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { find } from "../base/dom.js";
import { limits } from "../base/limits.js";

const MOST = 8; // numbers per announcement

/** @param {string} words */
const sentences = (words) => words.split(/(?<=[.!?])\s+/);
/** @param {Readout} readout */
const phrase = ({ label, value, unit }) => `${label}: ${value === "–" ? "none" : `${value} ${unit}`}`.trimEnd();

/**
 * What is new in the frame `current` after `previous`: its note and the changed numbers, else the first changed sentence of
 * its description.
 * @type {(previous: Frame, current: Frame) => string}
 */
function news(previous, current) {
  const oldValues = new Map(previous.readouts.map(({ name, value }) => [name, value]));
  const changes = current.readouts.filter(({ name, value }) => oldValues.get(name) !== value);
  const numbers = changes.slice(0, MOST).map(phrase).join("; ");
  if (current.note || numbers) return [current.note, numbers && `${numbers}.`].filter(Boolean).join(" ");
  const old = new Set(sentences(previous.description));
  return sentences(current.description).find((sentence) => !old.has(sentence)) ?? "The numbers are the same.";
}

/**
 * Announces messages, such as why something failed, before changes of the frame.
 * @param {Figure} figure
 */
export function addAnnouncer(figure) {
  const line = find(figure.root, ".figure-voice");
  let announced = figure.frame; // the last frame announced
  let message = "";
  let at = -Infinity; // when it last spoke
  let latest = 0; // when it must speak at the latest; 0 if there is nothing to say
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;

  function speak() {
    const words = message || news(announced, figure.frame);
    if (!message) {
      announced = figure.frame;
      figure.spoken();
    }
    message = "";
    at = performance.now();
    latest = 0;
    // Repeated words must differ to be announced.
    line.textContent = line.textContent === words ? `${words}\u00a0` : words;
    plan();
  }

  function plan() {
    clearTimeout(timer);
    const fresh = figure.frame !== announced;
    if (!fresh && !figure.pending && figure.speaks) figure.spoken(); // the action changed nothing
    if (!message && !(fresh && figure.speaks)) return;
    const now = performance.now();
    latest ||= now + limits.gap;
    timer = setTimeout(speak, Math.max(at + limits.gap, Math.min(now + limits.pause, latest)) - now);
  }

  figure.on("announce", (words) => {
    message = words;
    plan();
  });
  figure.on("state", plan);
}
