// A second worker, for parts of a job beside the page's own worker. Nothing depends on it: if it fails or is slow, the
// page's worker does its parts.
/** @import { Slice } from "../base/types.js" */

import { launch } from "./launch.js";

/** Launches it. It ends when it fails; then its promises reject. */
export function secondWorker() {
  const worker = launch(false);
  /** @type {Map<number, { resolve: (answer: any) => void, reject: (error: Error) => void }>} */
  const waiting = new Map();
  let last = 0;

  function end() {
    self.ended = true;
    worker.terminate();
    for (const { reject } of waiting.values()) reject(new Error("The second worker has ended"));
    waiting.clear();
  }

  /** @type {(id: number, post?: () => void) => Promise<any>} */
  const answerTo = (id, post = () => {}) =>
    new Promise((resolve, reject) => {
      waiting.set(id, { resolve, reject });
      post();
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

  const self = {
    ended: false,
    /** resolves when Python is up */
    up: answerTo(0),
    /** @type {(request: object) => Promise<Slice>} */
    job: (request) => answerTo(++last, () => worker.postMessage({ type: "job", id: last, request: JSON.stringify(request) })),
  };
  self.up.catch(() => {}); // nobody may be waiting
  return self;
}
