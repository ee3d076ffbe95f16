// The types that the preview's scripts exchange with each other, with the server, and with the page.

import type { sound } from "../../../templates/assets/js/base/checked_record.js";
import type * as record from "../../../templates/assets/js/base/record.js";
import type { FigureRecord } from "../../../templates/assets/js/base/types.js";
import type { figures } from "../../../templates/assets/js/figure/registry.js";
import type { describeCards } from "../../../templates/assets/js/page/cards.js";

/** The part of the page's own scripts that the preview uses (main.js). */
export interface PageLadder {
  alive: Promise<void>;
  figures: typeof figures;
  record: typeof record;
  sound: typeof sound;
  describeCards: typeof describeCards;
}

/** The path to an element: the nearest id ("" for the page itself), then the index among each parent's children. */
export interface Way {
  id: string;
  steps: number[];
}

/** A block to find the place by: its name, its number among blocks of that name, and its top in the window. */
export interface Mark {
  name: string;
  nth: number;
  top: number;
}

/** A figure that the author has changed: its current state and its initial one. */
export interface State {
  id: string;
  initial: FigureRecord;
  record: FigureRecord;
}

/** The author's place: plain data, which outlives the page. */
export interface Kept {
  page: string;
  marks: Mark[];
  focus: (Way & { name: string }) | null;
  details: (Way & { open: boolean })[];
  states: State[];
}

/** The result of a build. lines: its problems; edited: the chapters that were edited, with their pages. */
export interface BuildState {
  build: string;
  title: string;
  lines: string[];
  edited: { page: string; file: string }[];
}
