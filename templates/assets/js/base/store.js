// The browser's storage, for the page's own data.

/**
 * Reads and writes a storage as JSON. A forbidden or full storage keeps nothing but never throws; `set` returns whether
 * the value was stored.
 * @param {() => Storage} storage
 */
const jsonStore = (storage) => ({
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

export const store = jsonStore(() => localStorage);
/** Until the tab is closed. */
export const session = jsonStore(() => sessionStorage);
