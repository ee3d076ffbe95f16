"""In space: one mug, seen from anywhere, and what pairs of points determine of its pose."""
