"""The figure `which-method`: four questions, and the path up the ladder that their answers light."""
