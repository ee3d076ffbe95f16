// Tapes: frames recorded at build time, by record. A classic script each, so that they load from disk as well.
import { make } from "../base/dom.js";
import { emitter } from "../base/emitter.js";
import * as records from "../base/record.js";

/** Figure id → (record key → frame). */
const tapes = new Map();
const arrivals = emitter();

/** Listens for a figure's tape. */
export const onTape = (id, heard) => arrivals.on(id, heard);

/** What a tape file calls. A panel's `svg` is there the number of its drawing. */
export function receiveTape(id, drawings, entries) {
  for (const { frame } of entries) for (const panel of frame.panels) panel.svg = drawings[panel.svg];
  tapes.set(id, new Map(entries.map(({ record, frame }) => [records.key(record), frame])));
  arrivals.emit(id);
}

/** The recorded frame of a figure's record, if there is one. */
export const taped = (id, record) => tapes.get(id)?.get(records.key(record));

/** Adds the figure's tape once the figure comes near the screen; without it the runtime answers all the same. */
export function loadTape(figure) {
  const { tape } = figure.root.dataset;
  if (!tape) return () => {};
  const watch = new IntersectionObserver(
    (entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      watch.disconnect();
      document.head.append(make("script", { src: tape }));
    },
    { rootMargin: "600px" },
  );
  watch.observe(figure.root);
  return () => watch.disconnect();
}
