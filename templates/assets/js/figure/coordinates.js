// From a pointer's place to the world that a panel shows, and back to the panel.

/**
 * A pointer's place in a panel's world. view: [x0, x1, y0, y1, width, height, left, top, right, bottom], the window
 * of the world and, in nominal px, the panel's size and what is left free around the window.
 */
export function world(rect, view, clientX, clientY) {
  const [x0, x1, y0, y1, width, height, left, top, right, bottom] = view;
  const across = (((clientX - rect.left) / rect.width) * width - left) / (width - left - right);
  const down = (((clientY - rect.top) / rect.height) * height - top) / (height - top - bottom);
  return [x0 + across * (x1 - x0), y1 - down * (y1 - y0)];
}

/** A world place in percent of the panel. */
export function percent(view, [x, y]) {
  const [x0, x1, y0, y1, width, height, left, top, right, bottom] = view;
  const across = left + ((x - x0) / (x1 - x0)) * (width - left - right);
  const down = top + ((y1 - y) / (y1 - y0)) * (height - top - bottom);
  return [(100 * across) / width, (100 * down) / height];
}
