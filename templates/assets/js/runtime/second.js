// A second worker, for parts of a job beside the page's own worker. Nothing depends on it: if it fails or is slow, the
// page's worker does its parts.
/** @import { Slice } from "../base/types.js" */

import { launch } from "./launch.js";
import { runtime } from "./runtime.js";
import { frugal } from "./start.js";

/** @type {ReturnType<typeof begin> | null} */
let second = null; // stays for the next job

/**
 * The second worker, launched unless there is one. Null before the page's own is up, which must not be slowed down, and
 * on a device with one core, where it would only take that one's time.
 */
export function secondWorker() {
  if (runtime.state === "live" && navigator.hardwareConcurrency > 1 && !frugal) second ??= begin();
  return second;
}

/** Launches it. When it fails its promises reject, and the next job gets another. */
function begin() {
  const worker = launch(false);
  /** @type {Map<number, { resolve: (answer: any) => void, reject: (error: Error) => void }>} */
  const waiting = new Map();
  let last = 0;

  function end() {
    second = null;
    worker.terminate();
    for (const { reject } of waiting.values()) reject(new Error("Python stopped"));
  }

  /** @type {(id: number) => Promise<any>} */
  const answer = (id) =>
    new Promise((resolve, reject) => {
      waiting.set(id, { resolve, reject });
    });

  worker.onmessage = ({ data: { type, id = 0, slice = "null" } }) => {
    if (type === "failed" || type === "error") return end();
    if (type !== "ready" && type !== "job") return;
    waiting.get(id)?.resolve(JSON.parse(slice));
    waiting.delete(id);
  };
  worker.onerror = (event) => {
    event.preventDefault();
    end();
  };
  worker.onmessageerror = end;

  const up = answer(0);
  up.catch(() => {}); // nobody may be waiting
  return {
    /** resolves when Python is up */
    up,
    /** @type {(request: object) => Promise<Slice>} */
    job(request) {
      worker.postMessage({ type: "job", id: ++last, request: JSON.stringify(request) });
      return answer(last);
    },
  };
}
