"""NDT's map: one Gaussian per cell."""

from solvers.methods.ndt.floor import FLOOR, floored, inverse
from solvers.methods.ndt.ndt_map import (
    LARGEST_TABLE,
    LEAST_POINTS,
    LEAST_VARIANCE,
    NO_CELLS,
    ONE_PLACE,
    SHIFTS,
    TOO_FEW,
    TOO_SMALL,
    NdtMap,
    build,
    check_size,
    default_size,
)

__all__ = [
    "FLOOR",
    "LARGEST_TABLE",
    "LEAST_POINTS",
    "LEAST_VARIANCE",
    "NO_CELLS",
    "ONE_PLACE",
    "SHIFTS",
    "TOO_FEW",
    "TOO_SMALL",
    "NdtMap",
    "build",
    "check_size",
    "default_size",
    "floored",
    "inverse",
]
