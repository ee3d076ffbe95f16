// Tapes: frames recorded at build time, by record. A classic script each, so that they load from disk as well.
(() => {
  "use strict";

  /** Figure id → (record key → frame). */
  const tapes = new Map();

  /** What a tape file calls. A panel's `svg` is there the number of its drawing. */
  Ladder.tape = function (id, drawings, entries) {
    for (const { frame } of entries) for (const panel of frame.panels) panel.svg = drawings[panel.svg];
    tapes.set(id, new Map(entries.map(({ record, frame }) => [Ladder.record.key(record), frame])));
    Ladder.figures.get(id)?.tapeArrived();
  };

  /** The recorded frame of a figure's record, if there is one. */
  Ladder.taped = (id, record) => tapes.get(id)?.get(Ladder.record.key(record));

  /** Adds the figure's tape once the figure comes near the screen; without it the runtime answers all the same. */
  Ladder.loadTape = function (figure) {
    const { tape } = figure.root.dataset;
    if (!tape) return () => {};
    const watch = new IntersectionObserver(
      (entries) => {
        if (!entries.some((entry) => entry.isIntersecting)) return;
        watch.disconnect();
        document.head.append(Ladder.make("script", { src: tape }));
      },
      { rootMargin: "600px" },
    );
    watch.observe(figure.root);
    return () => watch.disconnect();
  };
})();
