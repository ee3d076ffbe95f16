// Helpers for elements and the browser. The page's scripts place pictures but never draw them: those come from Python.

/** @import { Dispose } from "./types.js" */

/**
 * Adds a listener and returns its disposer.
 * @template {Event} [E=any]
 * @param {EventTarget} target
 * @param {string} type
 * @param {(event: E) => void} handler
 * @param {AddEventListenerOptions} [options]
 * @returns {Dispose}
 */
export function on(target, type, handler, options) {
  const listener = /** @type {EventListener} */ (handler);
  target.addEventListener(type, listener, options);
  return () => target.removeEventListener(type, listener, options);
}

/**
 * An element that the page's templates guarantee; use `querySelector` for one that may be missing.
 * @param {ParentNode} root
 * @param {string} selector
 * @returns {HTMLElement}
 */
export const find = (root, selector) => /** @type {HTMLElement} */ (root.querySelector(selector));

/**
 * `find` for a button.
 * @param {ParentNode} root
 * @param {string} selector
 */
export const findButton = (root, selector) => /** @type {HTMLButtonElement} */ (root.querySelector(selector));

/**
 * The closest element to an event's target that matches, the target included.
 * @param {Event} event
 * @param {string} selector
 * @returns {HTMLElement | null}
 */
export const around = ({ target }, selector) => (target instanceof Element ? target.closest(selector) : null);

export const SVG = "http://www.w3.org/2000/svg";

/**
 * Makes an element with attributes (null and false are left out) and children (nodes or text).
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, string | number | boolean | null>} [attributes]
 * @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(...children);
  return element;
}

/**
 * Runs a function in isolation: an error in it is reported, and the caller goes on.
 * @param {() => void} action
 */
export function apart(action) {
  try {
    action();
  } catch (error) {
    reportError(error);
  }
}

/** @type {WeakMap<Element, string>} */
const written = new WeakMap();

/**
 * Sets text only if it differs, so that nothing is laid out or announced for no reason. Words that the browser has
 * translated since they were written stay translated.
 * @param {Element | null | undefined} element
 * @param {string} value
 */
export function text(element, value) {
  if (!element) return;
  const stays = written.get(element) === value && element.childNodes.length === 1;
  written.set(element, value);
  if (!stays && element.textContent !== value) element.textContent = value;
}

/**
 * The message of a thrown value, for use inside a sentence: browsers end some of theirs with a full stop.
 * @param {unknown} error
 */
export const messageOf = (error) => (error instanceof Error ? error.message : String(error)).replace(/\.$/, "");

const still = matchMedia("(prefers-reduced-motion: reduce)");
export const calm = () => still.matches;

/**
 * Calls back once the page has loaded and the browser is idle. (Safari has no requestIdleCallback.)
 * @param {() => void} callback
 */
export function idle(callback) {
  const wait = () => (globalThis.requestIdleCallback ?? ((go) => setTimeout(go, 200)))(callback, { timeout: 2000 });
  if (document.readyState === "complete") wait();
  else addEventListener("load", wait, { once: true });
}

/**
 * Copies text to the clipboard; resolves to whether that succeeded.
 * @param {string} value
 */
export async function copy(value) {
  try {
    await navigator.clipboard.writeText(value);
    return true;
  } catch {
    return false;
  }
}

/**
 * Saves a file on the reader's device.
 * @param {string} name
 * @param {BlobPart} data
 */
export function save(name, data, type = "text/plain") {
  const url = URL.createObjectURL(new Blob([data], { type }));
  const link = make("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** The page's name, whichever of its addresses the reader came by: /, /index.html or /index. */
export const pageName = () => location.pathname.split("/").at(-1)?.replace(/\.html$/, "") || "index";

/**
 * The name of a figure's file: the page's name, the figure's id and an ending.
 * @param {string} id
 * @param {string} ending
 */
export const fileName = (id, ending) => `${pageName()}-${id}${ending}`;

/**
 * Loads a classic script, which works from disk too. A reader waits for it: it goes before what loads ahead of need.
 * @param {string} src
 * @returns {Promise<void>}
 */
export function loadScript(src) {
  return new Promise((resolve, reject) => {
    const script = make("script", { src, fetchpriority: "high" });
    on(script, "load", () => {
      script.remove(); // in a saved page it would run again, and too early
      resolve();
    });
    on(script, "error", () => reject(new Error(`${src} did not load`)));
    document.head.append(script);
  });
}
