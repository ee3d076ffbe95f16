// The namespace of the page's scripts, and what all of them use. They carry and never draw: pictures come from Python.
(() => {
  "use strict";

  /** Milliseconds; a test may shorten them. `window.LADDER_PATIENCE` stands in for `start` where it is set. */
  const patience = { start: 25000, frame: 10000, replay: 30000, reading: 60000, slow: 1000 };
  const limits = { ...patience, run: 125, motion: 420, rest: 60, pause: 300, gap: 1000 };

  /** Listens, and returns the disposer. */
  function on(target, type, handler, options) {
    target.addEventListener(type, handler, options);
    return () => target.removeEventListener(type, handler, options);
  }

  /** An element with attributes (null and false are left out) and children (nodes or text). */
  function make(tag, attributes = {}, ...children) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : value);
    }
    element.append(...children);
    return element;
  }

  /** Does a thing by itself: an error in it is reported, and what comes after it goes on. */
  function apart(does) {
    try {
      return does();
    } catch (error) {
      reportError(error);
      return undefined;
    }
  }

  /** Sets text only where it differs, so that nothing is laid out or announced for no reason. */
  function text(element, value) {
    if (element && element.textContent !== value) element.textContent = value;
  }

  /** localStorage as JSON; where it is forbidden or full, nothing is kept and nothing fails: `set` says so. */
  const store = {
    get(key) {
      try {
        return JSON.parse(localStorage.getItem(key) ?? "null");
      } catch {
        return null;
      }
    },
    set(key, value) {
      try {
        localStorage.setItem(key, JSON.stringify(value));
        return true;
      } catch {
        return false;
      }
    },
  };

  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const calm = () => still.matches;

  /** Once the page has loaded and the browser has nothing better to do. (Safari has no word for it.) */
  function idle(then) {
    const wait = () => (globalThis.requestIdleCallback ?? ((go) => setTimeout(go, 200)))(then, { timeout: 2000 });
    if (document.readyState === "complete") wait();
    else addEventListener("load", wait, { once: true });
  }

  /** A minimal announcer: `on(type, fn)` returns the disposer, `emit(type, …)` calls. */
  function emitter() {
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

  let marks = 0;
  /** A performance mark for whoever measures; swept now and then, so that a long visit does not gather them. */
  function mark(name, detail, startTime = performance.now()) {
    if (++marks % 1000 === 0) ["ladder:input", "ladder:swap", "ladder:finer"].forEach((each) => performance.clearMarks(each));
    performance.mark(name, { detail, startTime });
  }

  /** Puts text on the clipboard; resolves to whether that went well. */
  async function copy(value) {
    try {
      await navigator.clipboard.writeText(value);
      return true;
    } catch {
      return false;
    }
  }

  /** Hands the reader a file. */
  function save(name, data, type = "text/plain") {
    const url = URL.createObjectURL(new Blob([data], { type }));
    const link = make("a", { href: url, download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 60_000);
  }

  /** What a file of a figure is called: the page's name, the figure's, and what is in it. */
  const fileName = (id, ending) => `${location.pathname.split("/").at(-1).replace(/\.html$/, "") || "index"}-${id}${ending}`;

  /** Figure id → its controller. */
  const figures = new Map();

  globalThis.Ladder = { limits, on, make, apart, text, store, calm, idle, emitter, mark, copy, save, fileName, figures };
})();
