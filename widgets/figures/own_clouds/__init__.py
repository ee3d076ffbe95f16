"""The figure `own-clouds`: the reader's own clouds."""
