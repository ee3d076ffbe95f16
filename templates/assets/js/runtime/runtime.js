// The page's side of its worker: starts it, asks it one question at a time, notices when it fails or falls silent.
/** @import { FigureRecord, Frame, JobQuestion, Progress, RuntimeState } from "../base/types.js" */

import { messageOf } from "../base/dom.js";
import { emitter } from "../base/emitter.js";
import { limits } from "../base/limits.js";
import { addresses, files, launch, noteEngine, scriptName } from "./launch.js";

/**
 * A question to the worker. finer: it only refines the picture that is shown. replay: it continues a replay. given: the
 * fingerprints in its record. data: the bytes of a reader's file. going: called with the progress of a long answer,
 * returns whether that is still wanted.
 * @typedef {{ type: "frame" | "job" | "give", id: number, figure?: string, finer?: boolean, replay?: boolean,
 *   request: string, data?: Uint8Array, given?: string[], going: (progress: Progress) => boolean,
 *   resolve: (answer: any) => void, reject: (error: Error) => void }} Question
 */
/** @typedef {{ name: string, request: string, data: Uint8Array }} Brought */
/** @typedef {{ key: string, words: string }} Told  about a reader's file */
/** @typedef {Error & { stopped?: boolean }} Stopped */

/** @type {ReturnType<typeof emitter<{ change: [], lack: [] }>>} lack: a file that Python needs later did not load */
const { on, emit } = emitter();
const page = document.documentElement;
const LATE = 2000; // ms; a timer later than this means that the page was suspended
const LENIENCY = 3; // times as long a worker may take to answer as the one that was given up on before it

const MOST_BROUGHT = 16;

/** @type {Worker | null} */
let worker = null;
let last = 0; // id of the latest question
/** @type {Question | null} */
let current = null; // the question that the worker is answering
/** @type {Question[]} */
let queue = []; // the others, oldest first
/** @type {Pick<Question, "resolve" | "reject">[]} */
let heaps = []; // pending requests for the heap's size
/** @type {ReturnType<typeof setTimeout> | undefined} */
let patience;
let leniency = 1; // grows with each silence: not Python may have been dead but the device slow, and the next one as slow
/**
 * The reader's files by Python's fingerprint, most recently used last; and the fingerprints that the worker has.
 * @type {Map<string, Brought>}
 */
const ownFiles = new Map();
/** @type {Set<string>} */
let workerFiles = new Set();

export const runtime = {
  /** file: the page was opened from disk, where browsers allow no worker */
  state: /** @type {RuntimeState} */ (""),
  total: Number(document.body.dataset.runtimeBytes) || files.reduce((sum, { size }) => sum + size, 0),
  loaded: 0,
  stage: "",
  message: "",
  /** the worker was live and died, so that a restart helps */
  stopped: false,
  /** the figure that the reader last touched: its questions go first */
  touched: /** @type {string | null} */ (null),
  on,
  start: () => begin(false),
  restart,
  frame,
  job,
  give,
  /** @param {string} key */
  holds: (key) => ownFiles.has(key),
  heap,
  kill: () => worker?.terminate(),
  get urls() {
    return addresses();
  },
};

/** @param {RuntimeState} state */
function become(state, message = "") {
  runtime.state = state;
  runtime.message = message;
  page.dataset.runtime = state;
  emit("change");
}

/**
 * Starts the worker once; after a failure only `restart` starts it again.
 * @param {boolean} careful
 */
function begin(careful) {
  if (runtime.state !== "idle") return;
  runtime.stopped = false;
  runtime.loaded = 0;
  runtime.stage = "";
  try {
    worker = launch(careful);
  } catch (error) {
    become("failed", `Python could not start: ${messageOf(error)}`);
    return;
  }
  worker.onmessage = ({ data }) => heard[data.type]?.(data);
  worker.onerror = (event) => {
    event.preventDefault();
    const missing = `${scriptName} could not be loaded`;
    die(event.message ? `Python stopped: ${event.message}` : missing);
  };
  worker.onmessageerror = () => die("Python sent an unreadable message");
  become("loading");
  wait();
}

function restart() {
  if (runtime.state === "file") return;
  drop();
  const careful = !runtime.stopped; // files were at fault, perhaps
  runtime.state = "idle";
  begin(careful);
}

/** Ends the worker and rejects its questions, except for files still waiting to be read: the next worker gets those. */
function drop() {
  clearTimeout(patience);
  worker?.terminate();
  worker = null;
  const waits = queue.filter(({ type }) => type === "give");
  const orphans = [...(current ? [current] : []), ...queue.filter((q) => !waits.includes(q)), ...heaps];
  current = null;
  queue = waits;
  heaps = [];
  workerFiles = new Set();
  for (const { reject } of orphans) reject(stopped("Python stopped"));
}

/** @param {string} message */
function die(message) {
  runtime.stopped = runtime.state === "live";
  become("failed", message);
  drop();
}

/** A start is alive while it reports progress; a silent one is left running, but the reader is offered a restart. */
function wait() {
  const limit = globalThis.LADDER_PATIENCE ?? limits.start;
  const seconds = Math.max(1, Math.round(limit / 1000));
  lasting(limit, wait, () => become("failed", `Python has made no progress for ${seconds} s`));
}

function noteProgress() {
  if (runtime.state === "failed" && worker) become("loading"); // it was slow, not dead
  if (runtime.state !== "loading") return;
  wait();
  emit("change");
}

/** @type {Record<string, (message: any) => void>} */
const heard = {
  progress({ loaded, total }) {
    runtime.loaded = loaded;
    runtime.total = total;
    noteProgress();
  },
  stage({ stage }) {
    runtime.stage = stage;
    noteProgress();
  },
  ready() {
    clearTimeout(patience);
    noteEngine();
    become("live");
    next();
  },
  failed({ message, detail }) {
    if (detail) console.info(detail);
    die(message);
  },
  frame: ({ id, frame: text }) => answered(id, (question) => drew(question, JSON.parse(text))),
  job: ({ id, slice }) => answered(id, ({ resolve }) => resolve(JSON.parse(slice))),
  give: ({ id, told: text }) => answered(id, ({ resolve }) => resolve(JSON.parse(text))),
  error({ id, message, trace, lacks }) {
    console.info(trace);
    answered(id, ({ reject }) => reject(Object.assign(new Error(message), { lacks })));
    if (lacks) emit("lack");
  },
  heap({ bytes }) {
    for (const { resolve } of heaps.splice(0)) resolve(bytes);
  },
};

/**
 * @param {number} id
 * @param {(question: Question) => void} settle
 */
function answered(id, settle) {
  if (current?.id !== id) return;
  clearTimeout(patience);
  const question = current;
  current = null;
  settle(question);
  next();
}

/** @type {(message: string) => Stopped} */
const stopped = (message) => Object.assign(new Error(message), { stopped: true });

/**
 * Resolves a question with its frame. A replay that is not finished goes back to the queue, unless nobody waits for it.
 * @param {Question} question
 * @param {Frame | Progress} answer
 */
function drew(question, answer) {
  if (!("replayed" in answer)) return question.resolve(answer);
  const { figure, finer, going } = question;
  const passed = finer && queue.some((q) => q.figure === figure && q.type === "frame");
  if (passed || !going(answer)) question.reject(stopped("Given up"));
  else queue.push({ ...question, replay: true });
}

/** Asks the next question: frames and files, then replays and jobs, then refinements; the touched figure's first. */
function next() {
  if (current || !queue.length || runtime.state !== "live") return;
  /** @param {Question} question */
  const rank = ({ finer, replay, type }) => (finer ? 2 : replay || type === "job" ? 1 : 0);
  const least = Math.min(...queue.map(rank));
  const among = queue.filter((q) => rank(q) === least);
  const first = among.find(({ figure }) => figure === runtime.touched) ?? among[0];
  const key = lacking(first);
  if (key && !first.going({ reads: ownFiles.get(key)?.name })) {
    queue = queue.filter((q) => q !== first);
    first.reject(stopped("Given up"));
    return next();
  }
  current = key ? reading(key, first) : first;
  queue = queue.filter((q) => q !== current);
  worker?.postMessage({ type: current.type, id: current.id, request: current.request, data: current.data });
  listen(current);
}

/**
 * The first of a question's files that the worker lacks, as a restarted one does. Marks them all as just used, so that
 * they are the last to be forgotten.
 * @param {Question} question
 */
function lacking({ given: keys = [] }) {
  const available = keys.filter((key) => ownFiles.has(key));
  for (const key of available) keep(key, /** @type {Brought} */ (ownFiles.get(key)));
  return available.find((key) => !workerFiles.has(key));
}

/**
 * A question that has the worker read a file again, ahead of the question that needs it.
 * @param {string} key
 * @param {Question} question
 * @returns {Question}
 */
function reading(key, question) {
  /** @param {Error} error */
  const reject = (error) => {
    queue = queue.filter((q) => q !== question);
    question.reject(error);
  };
  const { request, data } = /** @type {Brought} */ (ownFiles.get(key));
  return { type: "give", id: ++last, request, data, going: always, resolve: () => workerFiles.add(key), reject };
}

const always = () => true;

/**
 * @param {string} key
 * @param {Brought} thing
 */
function keep(key, thing) {
  ownFiles.delete(key);
  ownFiles.set(key, thing);
}

/** @param {Question} question */
function listen(question) {
  const isLong = question.replay || question.type === "job"; // a piece of either may take seconds
  const usual = question.type === "give" ? limits.reading : isLong ? limits.replay : limits.frame;
  const limit = leniency * usual;
  const giveUp = () => {
    leniency *= LENIENCY;
    die(`Python has not answered for ${Math.round(limit / 1000)} s`);
  };
  lasting(limit, () => listen(question), giveUp);
}

/**
 * Calls `over` after `limit` ms, or `anew` if the page was hidden or suspended: browsers slow hidden pages down, and a
 * page that comes back (from the history, from a closed lid) finds its timers due before the worker could say anything.
 * @param {number} limit
 * @param {() => void} anew
 * @param {() => void} over
 */
function lasting(limit, anew, over) {
  clearTimeout(patience);
  const due = performance.now() + limit;
  patience = setTimeout(() => (document.hidden || performance.now() > due + LATE ? anew() : over()), limit);
}

/**
 * The frame of a record; if Python is not up yet, it comes once it is.
 * `detail`: level of detail from 0, the coarsest; the finest by default. `finer`: the frame only refines what is shown,
 * and is dropped if the figure asks anything else before its turn comes.
 * `going` is called with the progress of a long answer, { replayed, of } in actions or { reads: a file's name }; the
 * answer is given up if it returns false.
 * Rejects with the Python error, with `lacks: true` if one of Python's files did not load, or with `stopped: true` if
 * the worker died, or the answer was given up or replaced.
 * @param {{ figure: string, record: FigureRecord, detail?: number, finer?: boolean,
 *   going?: (progress: Progress) => boolean }} wanted
 * @returns {Promise<Frame>}
 */
function frame({ figure, record, detail, finer = false, going = always }) {
  return new Promise((resolve, reject) => {
    const idle = queue.filter((q) => q.finer && q.figure === figure);
    queue = queue.filter((q) => !idle.includes(q));
    for (const question of idle) question.reject(stopped("Asked anew"));
    const request = JSON.stringify({ figure, record, detail, slices: true });
    const keys = Object.values(record.given ?? {});
    queue.push({ type: "frame", id: ++last, figure, finer, going, request, given: keys, resolve, reject });
    next();
  });
}

/**
 * Asks about a job, as the host's `job` answers. A reader's own actions come first, so that a job run slice by slice
 * never makes a reader wait for longer than one slice. Rejects as `frame` does.
 * @param {JobQuestion} wanted
 * @returns {Promise<any>}
 */
function job({ figure, record, name, does: phase, part, outcomes }) {
  return new Promise((resolve, reject) => {
    const request = JSON.stringify({ figure, record, job: name, do: phase, part, outcomes });
    queue.push({ type: "job", id: ++last, figure, request, going: always, resolve, reject });
    next();
  });
}

/**
 * Hands Python a reader's file, a Uint8Array. Resolves to its fingerprint `key`, by which a record's `given` refers to
 * it, and a description `words`; rejects with what is wrong with it. It goes to this page's worker and nowhere else.
 * @param {{ figure: string, widget: string, name: string, data: Uint8Array }} thing
 * @returns {Promise<Told>}
 */
function give({ figure, widget, name, data }) {
  const request = JSON.stringify({ widget, name });
  const answer = new Promise((/** @type {(told: Told) => void} */ resolve, reject) => {
    queue.push({ type: "give", id: ++last, figure, request, data, going: always, resolve, reject });
    next();
  });
  return answer.then((file) => {
    workerFiles.add(file.key);
    keep(file.key, { name, request, data });
    for (const key of [...ownFiles.keys()].slice(0, -MOST_BROUGHT)) {
      ownFiles.delete(key);
      workerFiles.delete(key);
      worker?.postMessage({ type: "forget", key });
    }
    return file;
  });
}

/**
 * The size of the worker's memory in bytes. Rejects if there is no worker or it ends before it answers.
 * @returns {Promise<number>}
 */
function heap() {
  if (!worker) return Promise.reject(stopped("Python is not running"));
  worker.postMessage({ type: "heap" });
  return new Promise((resolve, reject) => {
    heaps.push({ resolve, reject });
  });
}

become(location.protocol === "file:" ? "file" : "idle");
