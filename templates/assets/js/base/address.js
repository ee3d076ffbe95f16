// What a page's address names: the element before a state, if there is one.

/** The element that the fragment names; a fragment that cannot be decoded names none. */
export function named() {
  try {
    return document.getElementById(decodeURI(location.hash.slice(1)).split("?")[0]);
  } catch {
    return null;
  }
}
