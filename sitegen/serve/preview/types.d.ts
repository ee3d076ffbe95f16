// What the preview's scripts hand each other, what its server tells them, and what they look at in the page.

import type { sound } from "../../../templates/assets/js/base/checked_record.js";
import type * as record from "../../../templates/assets/js/base/record.js";
import type { FigureRecord } from "../../../templates/assets/js/base/types.js";
import type { figures } from "../../../templates/assets/js/figure/registry.js";
import type { describeCards } from "../../../templates/assets/js/page/cards.js";

/** What of the page's own scripts is used (main.js). */
export interface PageLadder {
  alive: Promise<void>;
  figures: typeof figures;
  record: typeof record;
  sound: typeof sound;
  describeCards: typeof describeCards;
}

/** The way to an element: from the nearest id, "" for the page itself, the place among each parent's children. */
export interface Way {
  id: string;
  steps: number[];
}

/** A block to find the place by: the nth of its name, and where it stood in the window. */
export interface Mark {
  name: string;
  nth: number;
  top: number;
}

/** A figure that was changed: what it shows, and what it showed first. */
export interface State {
  id: string;
  initial: FigureRecord;
  record: FigureRecord;
}

/** Where the author is: plain data, which outlives the page. */
export interface Kept {
  page: string;
  marks: Mark[];
  focus: (Way & { name: string }) | null;
  details: (Way & { open: boolean })[];
  states: State[];
}

/** What a build has come to. lines: its problems; edited: the chapters that were edited, with their pages. */
export interface BuildState {
  build: string;
  title: string;
  lines: string[];
  edited: { page: string; file: string }[];
}
