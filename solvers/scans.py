"""Two scans of a simulated laser."""

from solvers.scenes.scans import PILLARS, WALLS, TwoScans, ranges, two_scans

__all__ = ["PILLARS", "WALLS", "TwoScans", "ranges", "two_scans"]
