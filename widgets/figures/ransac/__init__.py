"""The figure `ransac`: corrupted pairs."""
