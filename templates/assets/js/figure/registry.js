// The page's figures.

/** @import { Figure } from "./figure.js" */

/**
 * Figure id → its controller.
 * @type {Map<string, Figure>}
 */
export const figures = new Map();
