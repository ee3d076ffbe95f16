// The fragment of a page's address: the name of an element and, after it, a figure's state.

const STATE = "s=";

/** @type {(name: string, state: string) => string} */
export const fragmentOf = (name, state) => `#${name}?${STATE}${state}`;

/**
 * The fragment's two parts: the name, and the state if it has one. Some programs percent-encode its ?, = and &.
 * @returns {{ name: string, state: string | null }}
 */
export function fragment() {
  const marks = location.hash.slice(1).replace(/%3F/i, "?").replace(/%3D/i, "=").replace(/%26/i, "&");
  const [name, query = ""] = marks.split("?");
  return { name, state: query.startsWith(STATE) ? query.slice(STATE.length) : null };
}

/** The element that the fragment names; null if there is none or the fragment cannot be decoded. */
export function named() {
  try {
    return document.getElementById(decodeURI(fragment().name));
  } catch {
    return null;
  }
}
