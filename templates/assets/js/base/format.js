// Numbers and names as the page's scripts write them.

/**
 * To four decimals, and never −0.
 * @param {number} value
 */
export const four = (value) => Math.round(value * 1e4) / 1e4 + 0;

const NAME = 60;

/**
 * A file's name in a sentence: of a long one its two ends.
 * @param {string} name
 */
export const called = (name) => (name.length > NAME ? `${name.slice(0, NAME / 2)}…${name.slice(1 - NAME / 2)}` : name);

/** @param {number} bytes */
export const megabytes = (bytes) => (bytes / 1e6).toFixed(1);

/** @type {(named: { label: string, unit?: string }) => string} */
export const withUnit = ({ label, unit }) => (unit ? `${label} (${unit})` : label);
