// What the browser keeps for the page.

/** localStorage as JSON; where it is forbidden or full, nothing is kept and nothing fails: `set` says so. */
export const store = {
  /**
   * @param {string} key
   * @returns {unknown}
   */
  get(key) {
    try {
      return JSON.parse(localStorage.getItem(key) ?? "null");
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
      localStorage.setItem(key, JSON.stringify(value));
      return true;
    } catch {
      return false;
    }
  },
};
