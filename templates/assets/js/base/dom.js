// What the page's scripts do to elements and with the browser. They carry and never draw: pictures come from Python.

/** Listens, and returns the disposer. */
export function on(target, type, handler, options) {
  target.addEventListener(type, handler, options);
  return () => target.removeEventListener(type, handler, options);
}

/** An element with attributes (null and false are left out) and children (nodes or text). */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

/** Does a thing by itself: an error in it is reported, and what comes after it goes on. */
export function apart(does) {
  try {
    return does();
  } catch (error) {
    reportError(error);
    return undefined;
  }
}

/** Sets text only where it differs, so that nothing is laid out or announced for no reason. */
export function text(element, value) {
  if (element && element.textContent !== value) element.textContent = value;
}

const still = matchMedia("(prefers-reduced-motion: reduce)");
export const calm = () => still.matches;

/** Once the page has loaded and the browser has nothing better to do. (Safari has no word for it.) */
export function idle(then) {
  const wait = () => (globalThis.requestIdleCallback ?? ((go) => setTimeout(go, 200)))(then, { timeout: 2000 });
  if (document.readyState === "complete") wait();
  else addEventListener("load", wait, { once: true });
}

/** Puts text on the clipboard; resolves to whether that went well. */
export async function copy(value) {
  try {
    await navigator.clipboard.writeText(value);
    return true;
  } catch {
    return false;
  }
}

/** Hands the reader a file. */
export function save(name, data, type = "text/plain") {
  const url = URL.createObjectURL(new Blob([data], { type }));
  const link = make("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** What a file of a figure is called: the page's name, the figure's, and what is in it. */
export const fileName = (id, ending) => `${location.pathname.split("/").at(-1).replace(/\.html$/, "") || "index"}-${id}${ending}`;
