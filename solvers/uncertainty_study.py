"""Scans simulated again and again at one place, and how often a region contains the truth."""

from solvers.studies.coverage import (
    GATE,
    LEVEL,
    METHODS,
    WAYS,
    CoverageLine,
    Runs,
    coverage,
    ends_of,
    regions,
    runs,
)
from solvers.studies.redrawn import (
    ENDS,
    NO_ECHO,
    PLACES,
    REACH,
    SIDES,
    STANDS,
    Redrawn,
    redrawn,
    starts,
    walls_of,
)

__all__ = [
    "ENDS",
    "GATE",
    "LEVEL",
    "METHODS",
    "NO_ECHO",
    "PLACES",
    "REACH",
    "SIDES",
    "STANDS",
    "WAYS",
    "CoverageLine",
    "Redrawn",
    "Runs",
    "coverage",
    "ends_of",
    "redrawn",
    "regions",
    "runs",
    "starts",
    "walls_of",
]
