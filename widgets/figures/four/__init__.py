"""The figure `four`: four methods, which keep four kinds of state."""
