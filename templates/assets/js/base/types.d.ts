// The types of Python's questions and answers, and of the data that the page's scripts share.

export type Point = [x: number, y: number];
export type Dispose = () => void;

export type Action = ["press", string] | ["drag" | "click" | "hover", string, number, number];
export type Value = number | string | boolean;
export type Values = Record<string, Value>;

/** A figure's whole state. given: place → fingerprint of the reader's own file there. */
export interface FigureRecord {
  widget: string;
  preset: string;
  controls: Values;
  seed: number;
  log: Action[];
  given?: Record<string, string>;
}

interface Labelled {
  label: string;
  keeps: "log" | "presses" | "pose" | "nothing";
}
interface Slider extends Labelled {
  kind: "slider";
  low: number;
  high: number;
  step: number;
  unit: string;
  decimals: number;
  named?: [choice: string, labels: Record<string, string>];
}
interface Choice extends Labelled {
  kind: "choice";
  options: Record<string, string>;
  sets: Record<string, Values>;
  places?: true;
}
interface Toggle extends Labelled {
  kind: "toggle";
}
export type Control = Slider | Choice | Toggle;

/** "": not yet known; file: the page was opened from disk, where browsers allow no worker */
export type RuntimeState = "" | "idle" | "loading" | "live" | "failed" | "file";

export interface Button {
  name: string;
  label: string;
  does: "press" | "run" | "back" | "reset" | "reseed";
  repeats: string;
}

export interface Spec {
  buttons: Button[];
  controls: Record<string, Control>;
  handles: string[];
  clicks: string[];
  hovers: string[];
  takes: string[];
  details: number;
}

/**
 * [x0, x1, y0, y1, width, height, left, top, right, bottom]: the window in world coordinates and, in nominal px, the
 * panel's size and the margins around the window.
 */
export type View = [number, number, number, number, number, number, number, number, number, number];

export interface Panel {
  name: string;
  svg: string;
  view: View;
  caption: string;
}

export interface Readout {
  name: string;
  label: string;
  value: string;
  unit: string;
  role: string;
}

export interface Handle {
  name: string;
  label: string;
  kind: string;
  radius: number;
  panel: string;
  also?: string[];
  left: number;
  top: number;
  value: string;
  world: Point;
  /** the slider whose value is the handle's x */
  sets?: string;
  slider: [low: number, high: number, current: number];
  keys: Record<string, Point>;
}

/** Turned by `turn` degrees about `about`, then moved by `shift`, in SVG units. */
export interface Move {
  group: string;
  turn: number;
  about: Point;
  shift: Point;
}

/** Lines that are drawn progressively from their starts; the rest of their group appears with their ends. */
export interface Trace {
  group: string;
  trace: true;
}

export type Motion = Move | Trace;

export interface Frame {
  panels: Panel[];
  readouts: Readout[];
  handles: Handle[];
  description: string;
  note: string;
  disabled: string[];
  motions: Motion[];
  controls: Values;
  python: string;
  detail: number;
  files?: Record<string, string> | null;
}

/** How far a long answer has come: in replayed actions, or in reading a file. */
export interface Progress {
  replayed?: number;
  of?: number;
  reads?: string;
}

/** The last waiting question is replaced by a new one with the same `merge`. */
export interface Question {
  record: FigureRecord;
  merge: string | null;
}

/** Who asks a figure for a record, for the parts that stop when another one does. left: nobody; the shown one stays. */
export type Asker = "" | "control" | "hover" | "key" | "left" | "play" | "predict" | "run";

/** A figure's events for its parts; the last three carry words for its status line and its announcer. */
export type FigureEvents = {
  /** a new record has been requested */
  asked: [by: Asker];
  /** a frame is shown */
  frame: [frame: Frame];
  /** something that the status line shows has changed */
  state: [];
  /** the figure has entered or left the viewport */
  seen: [];
  /** the figure is drawn at another size */
  scaled: [];
  say: [message: string];
  offer: [label: string, value: string];
  announce: [message: string];
};

export interface Row {
  name: string;
  label: string;
  mark: string;
  values: (number | null)[];
  texts: string[];
}
export interface Column {
  name: string;
  label: string;
  unit: string;
}
export interface JobPanel {
  name: string;
  svg: string;
  width: number;
}
export interface JobResult {
  caption: string;
  heading: string;
  columns: Column[];
  rows: Row[];
  panels: JobPanel[];
  csv: string;
  python: string;
}
export interface JobQuestion {
  figure: string;
  record: FigureRecord;
  name: string;
  does: "parts" | "begin" | "go on" | "stop" | "result";
  part?: string;
  outcomes?: Record<string, unknown>;
}
export interface Slice {
  fraction: number;
  words: string;
  done: boolean;
  outcome: unknown;
}

export interface RuntimeFile {
  name: string;
  size: number;
  sha256: string;
}

interface Line extends EventTarget {
  readonly saveData?: boolean;
  readonly type?: string;
  readonly effectiveType?: string;
}

interface Found {
  at: string;
  page: string;
  heading: string;
  text: string;
  terms: string[];
}
interface Index {
  addAll(sections: object[]): void;
  search(words: string, options?: object): Found[];
}

declare global {
  /** The page's only global (main.js). */
  var Ladder: Readonly<Record<string, unknown>>;
  /** Milliseconds that override `limits.start`; set by tests. */
  var LADDER_PATIENCE: number | undefined;
  /** The width of the widest panel in each class, in nominal px: the build fills the numbers in (panel_classes.py). */
  const __PANEL_SMALL__: number;
  const __PANEL_THIRD__: number;
  const __PANEL_HALF__: number;
  var MiniSearch: new (options: object) => Index;
  interface Navigator {
    /** Missing in some browsers. */
    readonly connection?: Line;
  }
}
