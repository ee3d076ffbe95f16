"""The list of methods: the one place that knows them all."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from solvers import congruent, cpd, fast_robust_icp, gicp, icp, kabsch, kiss_icp, mmd, point_to_plane, ransac
from solvers.stepper import Method

_LIST: tuple[Method[Any], ...] = (
    kabsch.KABSCH,
    kabsch.SIMILARITY,
    ransac.RANSAC,
    congruent.CONGRUENT,
    icp.ICP,
    icp.TRIMMED,
    icp.CAPPED,
    kiss_icp.KISS,
    fast_robust_icp.FAST_ROBUST,
    point_to_plane.POINT_TO_PLANE,
    gicp.GICP,
    cpd.RIGID,
    cpd.SIMILARITY,
    mmd.MMD,
)

METHODS: Mapping[str, Method[Any]] = MappingProxyType({method.name: method for method in _LIST})
"""Every method by name, in the order of the ladder; read-only."""
