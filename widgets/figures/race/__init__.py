"""The figure `race`: the race."""
