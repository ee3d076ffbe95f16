// Events of the page's own.

/** A minimal announcer: `on(type, fn)` returns the disposer, `emit(type, …)` calls. */
export function emitter() {
  const heard = new Map();
  return {
    on(type, handler) {
      if (!heard.has(type)) heard.set(type, new Set());
      heard.get(type).add(handler);
      return () => heard.get(type).delete(handler);
    },
    emit(type, ...values) {
      for (const handler of heard.get(type) ?? []) handler(...values);
    },
  };
}
