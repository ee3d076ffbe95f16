"""Known and proposed pairs: Kabsch, RANSAC, congruent sets."""
