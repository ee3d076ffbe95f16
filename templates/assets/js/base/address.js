// What a page's address names: an element, and a figure's state behind it.

const STATE = "s=";

/** @type {(name: string, state: string) => string} */
export const fragmentOf = (name, state) => `#${name}?${STATE}${state}`;

/**
 * The fragment in two: what it names, and the state, where it has one. Some programs pass its marks on encoded.
 * @returns {{ name: string, state: string | null }}
 */
export function fragment() {
  const marks = location.hash.slice(1).replace(/%3F/i, "?").replace(/%3D/i, "=").replace(/%26/i, "&");
  const [name, query = ""] = marks.split("?");
  return { name, state: query.startsWith(STATE) ? query.slice(STATE.length) : null };
}

/** The element that the fragment names; a fragment that cannot be decoded names none. */
export function named() {
  try {
    return document.getElementById(decodeURI(fragment().name));
  } catch {
    return null;
  }
}
