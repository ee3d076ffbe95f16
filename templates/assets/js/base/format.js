// How the page's scripts write numbers and names.

/**
 * Rounds to four decimals, never to −0.
 * @param {number} value
 */
export const four = (value) => Math.round(value * 1e4) / 1e4 + 0;

const NAME = 60;

/**
 * A file's name for use in a sentence: a long one is cut in the middle.
 * @param {string} name
 */
export const called = (name) => (name.length > NAME ? `${name.slice(0, NAME / 2)}…${name.slice(1 - NAME / 2)}` : name);

/** @param {number} bytes */
export const megabytes = (bytes) => (bytes / 1e6).toFixed(1);

/** @type {(value: string, unit: string) => string} */
export const quantity = (value, unit) => (unit && unit !== "°" ? `${value}\u00a0${unit}` : value + unit);

/** @type {(named: { label: string, unit?: string }) => string} */
export const withUnit = ({ label, unit }) => (unit ? `${label} (${unit})` : label);
