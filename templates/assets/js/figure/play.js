// Plays a record press by press, at the pace of Run, so that the way to it is seen and not only its end.
/** @import { FigureRecord } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { on } from "../base/dom.js";
import { limits } from "../base/limits.js";
import * as records from "../base/record.js";
import { runtime } from "../runtime/runtime.js";
import { taped } from "../runtime/tape.js";

const MOST = 32; // presses that are played, four seconds' worth; then comes the end
export const END = "finish"; // the button that does all of Run's presses at once

/** @typedef {{ counted: boolean, within: (record: FigureRecord) => boolean, ended: () => boolean, go: () => void }} Play */

/**
 * The way to a record that repeats Run's press a number of times or to the end; null for any other record. within:
 * whether a record lies on that way. ended: whether the figure shows the end of a run on it.
 * @param {Figure} figure
 * @param {() => FigureRecord} wanted  always the same, except for the reader's own clouds
 * @returns {Play | null}
 */
export function createPlay(figure, wanted) {
  const repeats = figure.spec.buttons.find(({ does }) => does === "run")?.repeats;
  const { log } = wanted();
  const counted = log.every(([kind, name]) => kind === "press" && name === repeats);
  const whole = log.length === 1 && log[0][1] === END;
  if (!repeats || !log.length || !(counted || whole)) return null;
  const limit = counted ? log.length : MOST;
  let playing = false;
  let askTime = 0; // the time of the last press
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;

  /** @param {FigureRecord} record */
  const within = (record) =>
    records.key(records.reset(record)) === records.key(records.reset(wanted())) &&
    record.log.every(([kind, name]) => kind === "press" && [repeats, END].includes(name));

  const ended = () =>
    whole && !figure.pending && within(figure.shown) && figure.frame.disabled.includes(/** @type {string} */ (repeats));

  /** @param {FigureRecord} record */
  function ask(record) {
    askTime = performance.now();
    figure.ask(record, { by: "play" });
  }

  function press() {
    if (!figure.visible || document.hidden) return; // it goes on once the figure is in view
    const base = records.left(figure.record, ...(figure.spec.hovers ?? []));
    const further = records.press(base, /** @type {string} */ (repeats));
    const isReady = runtime.state === "live" || taped(figure.id, further);
    ask(isReady && further.log.length <= limit ? further : wanted());
  }

  /** @param {boolean} [handedOn]  to a run of the reader's own */
  function stop(handedOn = false) {
    clearTimeout(timer);
    if (playing && !handedOn) figure.run(false);
    playing = false;
  }

  function frame() {
    clearTimeout(timer);
    if (!playing || figure.pending) return;
    if (ended() || records.key(figure.shown) === records.key(wanted())) stop();
    else timer = setTimeout(press, Math.max(0, askTime + limits.run - performance.now()));
  }

  function go() {
    playing = true;
    ask(records.reset(wanted())); // stops a run of the reader's own
    if (playing) figure.run(true);
  }

  figure.on("frame", frame);
  figure.on("seen", frame);
  on(document, "visibilitychange", frame);
  figure.on("asked", (by) => {
    if (!["play", "hover"].includes(by)) stop(by === "run");
  });
  return { counted, within, ended, go };
}
