"""The list of methods: the one place that knows them all."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from solvers import (
    association_bp,
    congruent,
    cpd,
    fast_robust_icp,
    filterreg,
    gicp,
    gmmreg,
    hypotheses,
    icp,
    kabsch,
    kiss_icp,
    mmd,
    ndt,
    ndt_d2d,
    point_to_plane,
    ransac,
    soft_annealed,
)
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
    ndt.NDT,
    ndt_d2d.D2D,
    soft_annealed.SOFT,
    cpd.RIGID,
    cpd.SIMILARITY,
    filterreg.FILTERREG,
    gmmreg.GMMREG,
    mmd.MMD,
    association_bp.ASSOCIATION_BP,
    hypotheses.HYPOTHESIS_MIXTURE,
)

METHODS: Mapping[str, Method[Any]] = MappingProxyType({method.name: method for method in _LIST})
"""Every method by name, in the order of the ladder; read-only."""
