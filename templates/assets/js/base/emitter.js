// The page's own events.

/** @import { Dispose } from "./types.js" */

/**
 * A minimal event emitter: `on(type, fn)` returns the disposer, `emit(type, …)` calls the listeners.
 * @template {Record<string, unknown[]>} Events  name → its listeners' arguments
 */
export function emitter() {
  /** @type {Map<keyof Events, Set<(...values: any[]) => void>>} */
  const heard = new Map();
  return {
    /**
     * @template {keyof Events} Type
     * @param {Type} type
     * @param {(...values: Events[Type]) => void} handler
     * @returns {Dispose}
     */
    on(type, handler) {
      const handlers = heard.get(type) ?? new Set();
      heard.set(type, handlers.add(handler));
      return () => handlers.delete(handler);
    },
    /**
     * @template {keyof Events} Type
     * @param {Type} type
     * @param {Events[Type]} values
     */
    emit(type, ...values) {
      for (const handler of heard.get(type) ?? []) handler(...values);
    },
  };
}
