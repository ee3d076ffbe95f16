"""The figure `four`: four kinds of state."""
