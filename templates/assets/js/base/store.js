// What the browser keeps for the page.

/**
 * A storage as JSON; where it is forbidden or full, nothing is kept and nothing fails: `set` says so.
 * @param {() => Storage} storage
 */
const kept = (storage) => ({
  /**
   * @param {string} key
   * @returns {unknown}
   */
  get(key) {
    try {
      return JSON.parse(storage().getItem(key) ?? "null");
    } catch {
      return null;
    }
  },
  /**
   * @param {string} key
   * @param {unknown} value
   */
  set(key, value) {
    try {
      storage().setItem(key, JSON.stringify(value));
      return true;
    } catch {
      return false;
    }
  },
});

export const store = kept(() => localStorage);
/** Until the tab is closed. */
export const session = kept(() => sessionStorage);
