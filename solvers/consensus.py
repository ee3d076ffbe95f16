"""RANSAC, and how many trials it needs."""

from solvers.methods.pairs.ransac import RANSAC, RansacOptions, RansacState, capped_sum, trials

__all__ = ["RANSAC", "RansacOptions", "RansacState", "capped_sum", "trials"]
