"""The figure `ransac`: registration with corrupted pairs."""
