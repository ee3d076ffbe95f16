// Buttons: press, run (and pause), back, reset, reseed. They are disabled by aria-disabled, so that a button does not
// lose the keyboard focus when its last step is done.
/** @import { Button } from "../base/types.js" */
/** @import { Figure } from "./figure.js" */

import { around, on, text } from "../base/dom.js";
import { limits } from "../base/limits.js";
import * as records from "../base/record.js";
import { END } from "./play.js";

/** @param {Figure} figure */
export function addButtons(figure) {
  const { root, spec } = figure;
  const { clicks = [], hovers = [] } = spec;
  const passing = hovers.filter((name) => clicks.includes(name)); // a hover there ends when the pointer leaves
  const boxes = /** @type {HTMLElement[]} */ ([...root.querySelectorAll(".buttons")]);
  const specs = new Map(spec.buttons.map((button) => [button.name, button]));
  const nodes = /** @type {HTMLElement[]} */ ([...root.querySelectorAll("[data-button]")]);
  /** @param {HTMLElement} node */
  const buttonOf = (node) => /** @type {Button} */ (specs.get(node.dataset.button ?? ""));
  /** @type {{ button: Button, due: ReturnType<typeof setTimeout> | undefined, at: number } | null} */
  let run = null; // due: the next tick's timer; at: the time of the last one

  /** @param {Button} button */
  function off({ name, does, repeats }) {
    const { disabled } = figure.frame;
    if (disabled.includes(name)) return true;
    if (does === "run") return disabled.includes(repeats);
    if (does === "back") return figure.record.log.length === 0;
    const start = records.key(figure.record) === records.key(records.reset(figure.fresh));
    return does === "reset" && start && figure.state !== "failed" && figure.state !== "waiting";
  }

  function show() {
    for (const node of nodes) {
      const button = buttonOf(node);
      const running = run?.button === button;
      node.setAttribute("aria-disabled", String(!running && off(button)));
      // While it says Pause it keeps its width, so that nothing moves; in CSS px, as a slide may be scaled.
      if (running === !node.style.width) node.style.width = running ? getComputedStyle(node).width : "";
      text(node, running ? "Pause" : button.label);
    }
  }

  /** @param {string} name */
  const afterPress = (name) => records.press(records.left(figure.record, ...passing), name);

  function stop() {
    clearTimeout(run?.due);
    run = null;
    figure.run(false);
    show();
  }

  /** Presses once more; waits while the figure is off screen, the page hidden or the last press not yet shown. */
  function tick() {
    if (!run || !figure.visible || document.hidden || figure.pending) return;
    if (off(run.button)) {
      stop();
      figure.speak();
      return;
    }
    clearTimeout(run.due);
    run.at = performance.now();
    figure.ask(afterPress(run.button.repeats), { merge: "run", by: "run" });
  }

  function repeat() {
    if (!run) return;
    clearTimeout(run.due);
    run.due = setTimeout(tick, Math.max(0, run.at + limits.run - performance.now()));
  }

  /** @type {Record<Button["does"], (button: Button, at: number) => void>} */
  const actions = {
    press({ name }, at) {
      const [kind, last] = figure.record.log.at(-1) ?? [];
      if (figure.pending && name === END && kind === "press" && last === END) return; // already asked
      figure.ask(afterPress(name), { at });
    },
    /** Undoes the last action; a hover since then does not count as one. */
    back: (_, at) => figure.ask(records.back(records.left(figure.record, ...hovers)), { at }),
    reset: () => figure.reset(),
    reseed: (_, at) => figure.ask(records.reseed(figure.record), { at }),
    run(button) {
      run = { button, due: undefined, at: 0 };
      figure.run(true);
      tick();
      show();
    },
  };

  /** @param {MouseEvent} event */
  function press(event) {
    const node = around(event, "[data-button]");
    if (!node || node.getAttribute("aria-disabled") === "true") return;
    const button = buttonOf(node);
    const paused = run?.button === button;
    if (run) stop();
    if (paused) figure.speak();
    else actions[button.does](button, event.timeStamp);
  }

  /**
   * A held key presses no faster than frames arrive. It runs, pauses and presses the figure's other buttons only once:
   * they may have moved the focus to the next.
   * @param {KeyboardEvent} event
   */
  function hold(event) {
    const node = around(event, "button");
    if (!node || !event.repeat || event.key !== "Enter") return;
    const { does = "run" } = buttonOf(node) ?? {};
    if (figure.pending || does === "run") event.preventDefault();
  }

  on(document, "visibilitychange", repeat);
  figure.on("seen", repeat);
  figure.on("frame", () => {
    show();
    repeat();
  });
  figure.on("asked", (by) => {
    if (run && !["run", "control", "hover"].includes(by)) stop();
  });
  figure.on("state", show);
  on(root, "keydown", hold);
  on(root, "click", press);
  for (const box of boxes) box.hidden = false;
  show();
}
