// Buttons: press, run (and pause), back, reset, reseed. What cannot be pressed is told by aria-disabled, so that a
// button does not lose the keyboard's focus when its last step is done.
import { on, text } from "../base/dom.js";
import { limits } from "../base/limits.js";
import * as records from "../base/record.js";

export function addButtons(figure) {
  const { root, spec } = figure;
  const box = root.querySelector(".buttons");
  if (!box) return () => {};
  const specs = new Map(spec.buttons.map((each) => [each.name, each]));
  const nodes = [...box.querySelectorAll("[data-button]")];
  let run = null; // { button, due: the next tick's timer, at: when the last one was }

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
      const each = specs.get(node.dataset.button);
      const running = run?.button === each;
      node.setAttribute("aria-disabled", String(!running && off(each)));
      text(node, running ? "Pause" : each.label);
    }
  }

  function stop() {
    clearTimeout(run?.due);
    run = null;
    figure.running = false;
    show();
  }

  /** One press more; waits where the figure is off screen, the page hidden, or the last press not yet shown. */
  function tick() {
    if (!run || !figure.visible || document.hidden || figure.asked || figure.waiting.length) return;
    if (off(run.button)) {
      stop();
      figure.speak();
      return;
    }
    clearTimeout(run.due);
    run.at = performance.now();
    figure.ask(records.press(figure.record, run.button.repeats), { merge: "run", by: "run" });
  }

  function again() {
    if (!run) return;
    clearTimeout(run.due);
    run.due = setTimeout(tick, Math.max(0, run.at + limits.run - performance.now()));
  }

  const does = {
    press: ({ name }, at) => figure.ask(records.press(figure.record, name), { at }),
    back: (_, at) => figure.ask(records.back(figure.record), { at }),
    reset: () => figure.reset(),
    reseed: (_, at) => figure.ask(records.reseed(figure.record), { at }),
    run(each) {
      run = { button: each, due: 0, at: 0 };
      figure.running = true;
      tick();
      show();
    },
  };

  function press(event) {
    const node = event.target.closest("[data-button]");
    if (!node || node.getAttribute("aria-disabled") === "true") return;
    const each = specs.get(node.dataset.button);
    const paused = run?.button === each;
    if (run) stop();
    if (paused) figure.speak();
    else does[each.does](each, event.timeStamp);
  }

  const disposers = [
    on(box, "click", press),
    on(document, "visibilitychange", again),
    figure.on("seen", again),
    figure.on("frame", () => {
      show();
      again();
    }),
    figure.on("asked", (by) => {
      if (run && !["run", "control", "hover"].includes(by)) stop();
    }),
    figure.on("state", show),
    stop,
  ];
  box.hidden = false;
  show();
  return () => disposers.forEach((dispose) => dispose());
}
