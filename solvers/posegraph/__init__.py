"""Pose graphs in the plane: many poses, the relative poses measured between them, and the poses that agree best with
all measurements.

`optimise` is the main entry point; `begin` and `advance` do the same one step at a time.
"""

from solvers.core.edges import Edges
from solvers.core.poses import concatenated, stacked
from solvers.posegraph.covariance import marginals
from solvers.posegraph.errors import chi_squared, jacobians, residuals
from solvers.posegraph.graph import advance, begin, optimise
from solvers.posegraph.kernels import KERNELS, THRESHOLD
from solvers.posegraph.state import GraphResult, GraphRun

__all__ = [
    "KERNELS",
    "THRESHOLD",
    "Edges",
    "GraphResult",
    "GraphRun",
    "advance",
    "begin",
    "chi_squared",
    "concatenated",
    "jacobians",
    "marginals",
    "optimise",
    "residuals",
    "stacked",
]
