"""RANSAC, and how many trials it needs."""

from solvers.methods.pairs.consensus import capped_sum, trials
from solvers.methods.pairs.ransac import RANSAC, RansacOptions, RansacState

__all__ = ["RANSAC", "RansacOptions", "RansacState", "capped_sum", "trials"]
