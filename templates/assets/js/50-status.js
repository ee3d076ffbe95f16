// The status line: what a figure waits for, why it failed, what it notes. Progress is shown and not spoken; what a
// discrete action led to is spoken and, where the picture says it already, not shown.
(() => {
  "use strict";

  const { make, on, runtime, text } = Ladder;

  const PAUSE = 300; // ms
  const SLOW = 1000; // ms after which an answer is slow enough to say so
  const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
  const STAGES = { python: "unpacking", numpy: "starting numpy", widgets: "starting the solvers" };
  const FROM_DISK =
    "Opened from disk: to bring the figures alive, run “python3 -m http.server” in this folder and open localhost:8000.";

  function progress() {
    const { loaded, total, stage } = runtime;
    return STAGES[stage] ?? `${megabytes(loaded)} of ${megabytes(total)} MB`;
  }

  const sentence = (words) => words.match(/^.*?[.!?](?=\s|$)/s)?.[0] ?? words;

  /** What the line says: words, progress, which ways on. `late`: the answer that is being drawn takes long. */
  function told(figure, late) {
    if (figure.error) {
      const words = runtime.state === "file" ? `${figure.error} ${FROM_DISK}` : figure.error;
      return { words, ways: runtime.state === "file" ? [] : ["Reset"] };
    }
    const waits = figure.waiting.length > 0;
    if (runtime.state === "failed" && (waits || figure.visible)) {
      const kept = waits ? " What you did is kept." : "";
      return { words: `${runtime.message}.${kept}`, ways: runtime.stopped ? ["Retry", "Reset"] : ["Retry"] };
    }
    if (waits && runtime.state !== "live") {
      return { words: "Python is starting; this will then be shown.", progress: progress(), ways: [] };
    }
    const first = Ladder.figures.values().next().value === figure;
    if (runtime.state === "file" && first) return { words: FROM_DISK, ways: [] };
    if (runtime.state === "idle" && Ladder.frugal && !figure.frame.note) {
      return { words: `Python (${megabytes(runtime.total)} MB) loads when you first need it.`, ways: [] };
    }
    return { words: late ? "Python is working on this." : figure.frame.note, ways: [] };
  }

  const ways = {
    Retry: () => runtime.restart(),
    Reset: (figure) => figure.reset(),
  };

  Ladder.status = function (figure) {
    const line = figure.root.querySelector(".figure-status");
    const words = make("span", { class: "status-words" });
    const bytes = make("span", { class: "status-progress", "aria-hidden": "true" });
    const heard = make("span", { class: "visually-hidden" });
    const choices = make("span", { class: "status-ways" });
    const offer = make("span", { class: "status-offer" });
    let offered = "";
    let passing = ""; // said once, gone with the next question
    let quiet = 0;
    let watched = null; // the question that is being drawn
    let late = false; // its answer
    let patience = 0;
    line.replaceChildren(words, " ", bytes, choices, offer, heard);

    /** What is seen, in a sentence, once things have been still for a moment. */
    function speak() {
      clearTimeout(quiet);
      quiet = setTimeout(() => {
        if (!figure.speaks || figure.asked || figure.waiting.length || figure.finer) return;
        figure.speaks = false;
        text(heard, words.textContent ? "" : sentence(figure.frame.description));
      }, PAUSE);
    }

    function watch() {
      if (watched === figure.asked) return;
      watched = figure.asked;
      late = false;
      clearTimeout(patience);
      if (!watched) return;
      patience = setTimeout(() => {
        late = true;
        show();
      }, SLOW);
    }

    function show() {
      watch();
      const now = told(figure, late);
      text(words, passing || now.words);
      text(bytes, now.progress ?? "");
      if (offered !== now.ways.join()) {
        offered = now.ways.join();
        choices.replaceChildren(...now.ways.map((way) => make("button", { type: "button", "data-way": way }, way)));
      }
      if (figure.speaks) speak();
    }

    const disposers = [
      figure.on("state", show),
      figure.on("seen", show),
      figure.on("asked", () => {
        passing = "";
        offer.replaceChildren();
      }),
      on(choices, "click", (event) => ways[event.target.closest("[data-way]")?.dataset.way]?.(figure)),
    ];
    figure.status = {
      say(message) {
        passing = message;
        show();
      },
      /** Offers text that the clipboard would not take, selected, for the reader to copy. */
      offer(label, value) {
        const field = make("input", { type: "text", readonly: true, value, "aria-label": label });
        this.say(label);
        offer.replaceChildren(field);
        field.focus();
        field.select();
      },
    };
    show();
    disposers.push(() => [quiet, patience].forEach(clearTimeout));
    return () => disposers.forEach((dispose) => dispose());
  };
})();
