// The page's figures.

/** Figure id → its controller. */
export const figures = new Map();
