"""Two scans of a simulated laser."""

from solvers.scenes.scans import PILLARS, WALLS, Scans, TwoScans, ranges, two_scans

__all__ = ["PILLARS", "WALLS", "Scans", "TwoScans", "ranges", "two_scans"]
