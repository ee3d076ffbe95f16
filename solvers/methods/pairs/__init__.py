"""Methods on known or proposed pairs: Kabsch, RANSAC, congruent sets, graduated non-convexity."""
