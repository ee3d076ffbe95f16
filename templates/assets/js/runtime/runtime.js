// The page's side of its one worker: starting, asking for frames one at a time, noticing when it fails or falls silent.
/** @import { FigureRecord, Frame, Progress, RuntimeFile, RuntimeState, Slice } from "../base/types.js" */

import { messageOf } from "../base/dom.js";
import { emitter } from "../base/emitter.js";
import { limits } from "../base/limits.js";
import { store } from "../base/store.js";

/**
 * A question to the worker. finer: it only betters what is shown. replay: it goes on with what was begun. given: what its
 * record names. data: a reader's bytes. going: told what a long answer is at, it says whether that is still wanted.
 * @typedef {{ type: "frame" | "job" | "give", id: number, figure?: string, finer?: boolean, replay?: boolean,
 *   request: string, data?: Uint8Array, given?: string[], going: (progress: Progress) => boolean,
 *   resolve: (answer: any) => void, reject: (error: Error) => void }} Question
 */
/** @typedef {{ name: string, request: string, data: Uint8Array }} Brought */
/** @typedef {{ key: string, words: string }} Told  on what a reader brought */
/** @typedef {Error & { stopped?: boolean }} Stopped */

/** @type {ReturnType<typeof emitter<{ change: [], lack: [] }>>} lack: a file that came to be needed did not load */
const { on, emit } = emitter();
const page = document.documentElement;
const { runtime: folder = "", runtimeFiles, runtimeBytes, worker: script = "" } = document.body.dataset;
/** @type {RuntimeFile[]} */
const files = JSON.parse(runtimeFiles || "[]");
const ENGINE = "ladder-engine"; // the hash of the engine that came up here last
const engine = files.find(({ name }) => name.endsWith(".wasm"))?.sha256;
const LATE = 2000; // ms by which a timer is late only where the page did not run

const MOST_BROUGHT = 16;

/** @type {Worker | null} */
let worker = null;
let launcher = ""; // the address it is started from
let last = 0; // id of the latest question
/** @type {Question | null} */
let asked = null; // the question the worker has
/** @type {Question[]} */
let queue = []; // the others, in the order they came
/** @type {Pick<Question, "resolve" | "reject">[]} */
let heaps = []; // who asked for the memory's size
/** @type {ReturnType<typeof setTimeout> | undefined} */
let patience;
/**
 * What readers brought, by Python's fingerprint of it, the latest used last; and what of it the worker has.
 * @type {Map<string, Brought>}
 */
const brought = new Map();
/** @type {Set<string>} */
let held = new Set();

export const runtime = {
  /** file: the page was opened from disk, where browsers allow no worker */
  state: /** @type {RuntimeState} */ (""),
  total: Number(runtimeBytes) || files.reduce((sum, { size }) => sum + size, 0),
  loaded: 0,
  stage: "",
  message: "",
  /** it was live once and died, so that starting anew is what helps */
  stopped: false,
  /** the figure that the reader has a hand on: its questions go first */
  touched: /** @type {string | null} */ (null),
  on,
  start: () => begin(false),
  restart,
  frame,
  job,
  give,
  /** @param {string} key */
  holds: (key) => brought.has(key),
  heap,
  kill: () => worker?.terminate(),
  get urls() {
    return [script, ...files.map(({ name }) => folder + name)].map((url) => new URL(url, document.baseURI).href);
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
 * The worker's script by way of a blob: a worker made of that has its page's policy, whereas one made of a file has what
 * the host sends along with the file, which is nothing on hosts that send no headers.
 */
function launch() {
  const code = `import ${JSON.stringify(new URL(script, document.baseURI).href)};`;
  return URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
}

/**
 * Starts once; what failed is started again by `restart` only.
 * @param {boolean} careful
 */
function begin(careful) {
  if (runtime.state !== "idle") return;
  runtime.loaded = 0;
  runtime.stage = "";
  try {
    worker = new Worker((launcher ||= launch()), { type: "module" });
  } catch (error) {
    become("failed", `Python could not start: ${messageOf(error)}`);
    return;
  }
  worker.onmessage = ({ data }) => heard[data.type]?.(data);
  worker.onerror = (event) => {
    event.preventDefault();
    const missing = `${script.split("/").at(-1)} could not be loaded`;
    die(event.message ? `Python stopped: ${event.message}` : missing);
  };
  worker.onmessageerror = () => die("Python sent an unreadable message");
  const known = store.get(ENGINE) === engine;
  const address = new URL(folder, document.baseURI).href;
  worker.postMessage({ type: "start", runtime: address, files, again: careful, known });
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

/** Takes the worker away; what it was asked is the askers' to keep, but what was to be read waits for the next one. */
function drop() {
  clearTimeout(patience);
  worker?.terminate();
  worker = null;
  const waits = queue.filter(({ type }) => type === "give");
  const lost = [...(asked ? [asked] : []), ...queue.filter((each) => !waits.includes(each)), ...heaps];
  asked = null;
  queue = waits;
  heaps = [];
  held = new Set();
  for (const { reject } of lost) reject(stopped("Python stopped"));
}

/** @param {string} message */
function die(message) {
  runtime.stopped ||= runtime.state === "live";
  become("failed", message);
  drop();
}

/** A start is alive as long as it tells something; one that does not is left running, but the reader is asked. */
function wait() {
  const limit = globalThis.LADDER_PATIENCE ?? limits.start;
  const seconds = Math.max(1, Math.round(limit / 1000));
  lasting(limit, wait, () => become("failed", `Python has made no progress for ${seconds} s`));
}

function told() {
  if (runtime.state === "failed" && worker) become("loading"); // it was only given up on
  if (runtime.state !== "loading") return;
  wait();
  emit("change");
}

/** @type {Record<string, (message: any) => void>} */
const heard = {
  progress({ loaded, total }) {
    runtime.loaded = loaded;
    runtime.total = total;
    told();
  },
  stage({ stage }) {
    runtime.stage = stage;
    told();
  },
  ready() {
    clearTimeout(patience);
    runtime.stopped = false;
    store.set(ENGINE, engine);
    become("live");
    next();
  },
  failed({ message, detail }) {
    if (detail) console.info(detail);
    die(message);
  },
  frame: ({ id, frame: drawn }) => answered(id, (question) => drew(question, JSON.parse(drawn))),
  job: ({ id, slice }) => answered(id, ({ resolve }) => resolve(JSON.parse(slice))),
  give: ({ id, told }) => answered(id, ({ resolve }) => resolve(JSON.parse(told))),
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
  if (asked?.id !== id) return;
  clearTimeout(patience);
  const question = asked;
  asked = null;
  settle(question);
  next();
}

/** @type {(why: string) => Stopped} */
const stopped = (why) => Object.assign(new Error(why), { stopped: true });

/**
 * A frame; or how far its replay has come, which goes on after what else is asked, unless nobody waits for it.
 * @param {Question} question
 * @param {Frame | Progress} answer
 */
function drew(question, answer) {
  if (!("replayed" in answer)) return question.resolve(answer);
  const { figure, finer, going } = question;
  const passed = finer && queue.some((each) => each.figure === figure && each.type === "frame");
  if (passed || !going(answer)) question.reject(stopped("Given up"));
  else queue.push({ ...question, replay: true });
}

/** The touched figure's question first, else the oldest; then slices of work, then what makes a picture finer. */
function next() {
  if (asked || !queue.length || runtime.state !== "live") return;
  /** @param {Question} question */
  const rank = ({ finer, replay, type }) => (finer ? 2 : replay || type === "job" ? 1 : 0);
  const least = Math.min(...queue.map(rank));
  const among = queue.filter((each) => rank(each) === least);
  const first = among.find(({ figure }) => figure === runtime.touched) ?? among[0];
  const key = lacking(first);
  if (key && !first.going({ reads: brought.get(key)?.name })) {
    queue = queue.filter((each) => each !== first);
    first.reject(stopped("Given up"));
    return next();
  }
  asked = key ? reading(key, first) : first;
  queue = queue.filter((each) => each !== asked);
  worker?.postMessage({ type: asked.type, id: asked.id, request: asked.request, data: asked.data });
  listen(asked);
}

/**
 * What a record names is the last to be forgotten; a worker that was started anew lacks it.
 * @param {Question} question
 */
function lacking({ given = [] }) {
  const named = given.filter((key) => brought.has(key));
  for (const key of named) keep(key, /** @type {Brought} */ (brought.get(key)));
  return named.find((key) => !held.has(key));
}

/**
 * Has the worker read something once more, before the question that is about it.
 * @param {string} key
 * @param {Question} question
 * @returns {Question}
 */
function reading(key, question) {
  /** @param {Error} error */
  const reject = (error) => {
    queue = queue.filter((each) => each !== question);
    question.reject(error);
  };
  const { request, data } = /** @type {Brought} */ (brought.get(key));
  return { type: "give", id: ++last, request, data, going: always, resolve: () => held.add(key), reject };
}

const always = () => true;

/**
 * @param {string} key
 * @param {Brought} thing
 */
function keep(key, thing) {
  brought.delete(key);
  brought.set(key, thing);
}

/** @param {Question} question */
function listen(question) {
  const limit = question.type === "give" ? limits.reading : question.replay ? limits.replay : limits.frame;
  const seconds = Math.round(limit / 1000);
  lasting(limit, () => listen(question), () => die(`Python has not answered for ${seconds} s`));
}

/**
 * Silence counts only while the page is seen and awake: browsers slow hidden pages down, and a page that comes back
 * (from the history, from a lid that was shut) finds its timers due before the worker could say anything.
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
 * The frame of a record; asked before Python is up, it comes when it is.
 * `detail`, from 0: how coarse a drawing will do; without it the finest comes. `finer`: it only betters what is shown,
 * and is dropped when the figure asks anything else before its turn has come.
 * `going` is told what a long answer is at, { replayed, of } in actions or { reads: a file's name }; a replay is given
 * up where it returns false.
 * Rejects with the Python error, with `lacks: true` where a file of Python's did not load, or with `stopped: true` where
 * the worker died or the replay was given up.
 * @param {{ figure: string, record: FigureRecord, detail?: number, finer?: boolean,
 *   going?: (progress: Progress) => boolean }} wanted
 * @returns {Promise<Frame>}
 */
function frame({ figure, record, detail, finer = false, going = always }) {
  return new Promise((resolve, reject) => {
    const idle = queue.filter((each) => each.finer && each.figure === figure);
    queue = queue.filter((each) => !idle.includes(each));
    for (const each of idle) each.reject(stopped("Asked anew"));
    const request = JSON.stringify({ figure, record, detail, slices: true });
    const given = Object.values(record.given ?? {});
    queue.push({ type: "frame", id: ++last, figure, finer, going, request, given, resolve, reject });
    next();
  });
}

/**
 * A slice of a job: `does` is "begin", "go on" or "stop". Whatever a reader does comes first, so that a job that is
 * asked for a slice at a time never makes anybody wait for longer than one takes. Rejects as `frame` does.
 * @param {{ figure: string, record: FigureRecord, name: string, does: "begin" | "go on" | "stop" }} wanted
 * @returns {Promise<Slice>}
 */
function job({ figure, record, name, does }) {
  return new Promise((resolve, reject) => {
    const request = JSON.stringify({ figure, record, job: name, do: does });
    queue.push({ type: "job", id: ++last, figure, request, going: always, resolve, reject });
    next();
  });
}

/**
 * Hands Python what a reader brought: a Uint8Array. Resolves to its fingerprint `key`, which a record's `given` names it
 * by, and `words` on what it is; rejects with what is wrong with it. It goes to this page's worker and nowhere else.
 * @param {{ figure: string, widget: string, name: string, data: Uint8Array }} thing
 * @returns {Promise<Told>}
 */
function give({ figure, widget, name, data }) {
  const request = JSON.stringify({ widget, name });
  const answer = new Promise((/** @type {(told: Told) => void} */ resolve, reject) => {
    queue.push({ type: "give", id: ++last, figure, request, data, going: always, resolve, reject });
    next();
  });
  return answer.then((told) => {
    held.add(told.key);
    keep(told.key, { name, request, data });
    for (const key of [...brought.keys()].slice(0, -MOST_BROUGHT)) {
      brought.delete(key);
      held.delete(key);
      worker?.postMessage({ type: "forget", key });
    }
    return told;
  });
}

/**
 * Bytes of the worker's memory. Rejects where there is no worker, or it goes before it has answered.
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
