// Tapes: frames recorded at build time, by record. Each is a classic script, so that it loads from disk too.
/** @import { FigureRecord, Frame } from "../base/types.js" */

import { loadScript } from "../base/dom.js";
import { emitter } from "../base/emitter.js";
import * as records from "../base/record.js";

/**
 * Figure id → (record key → frame).
 * @type {Map<string, Map<string, Frame>>}
 */
const tapes = new Map();
/** @type {ReturnType<typeof emitter<Record<string, []>>>} */
const arrivals = emitter();

/**
 * Listens for a figure's tape.
 * @type {(id: string, heard: () => void) => void}
 */
export const onTape = (id, heard) => void arrivals.on(id, heard);

/**
 * Called by a tape file, in which a panel's `svg` is an index into `drawings`.
 * @param {string} id
 * @param {string[]} drawings
 * @param {{ record: FigureRecord, frame: Frame }[]} entries
 */
export function receiveTape(id, drawings, entries) {
  for (const { frame } of entries) for (const panel of frame.panels) panel.svg = drawings[Number(panel.svg)];
  tapes.set(id, new Map(entries.map(({ record, frame }) => [records.key(record), frame])));
  arrivals.emit(id);
}

/**
 * The recorded frame of a figure's record, if there is one.
 * @type {(id: string, record: FigureRecord) => Frame | undefined}
 */
export const taped = (id, record) => tapes.get(id)?.get(records.key(record));

/**
 * Whether a figure's tape has loaded or failed to load.
 * @param {string} id
 */
export const arrived = (id) => tapes.has(id);

/**
 * Loads the figure's tape once the figure comes near the viewport; without it the runtime still answers.
 * @param {HTMLElement} root
 */
export function loadTape(root) {
  const { tape } = root.dataset;
  if (!tape) return;
  const watch = new IntersectionObserver(
    (entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      watch.disconnect();
      loadScript(tape).catch(() => receiveTape(root.id, [], []));
    },
    { rootMargin: "600px" },
  );
  watch.observe(root);
}
