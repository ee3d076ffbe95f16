"""The list of methods: the one place that knows them all."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any

from solvers.stepper import Method

# name → module and constant, in the order of the ladder
_LIST = {
    "kabsch": "kabsch.KABSCH",
    "similarity": "kabsch.SIMILARITY",
    "ransac": "ransac.RANSAC",
    "ransac-congruent": "congruent.CONGRUENT",
    "icp": "icp.ICP",
    "trimmed-icp": "icp.TRIMMED",
    "capped-icp": "icp.CAPPED",
    "kiss-threshold-icp": "kiss_icp.KISS",
    "fast-robust-icp": "fast_robust_icp.FAST_ROBUST",
    "point-to-plane": "point_to_plane.POINT_TO_PLANE",
    "gicp": "gicp.GICP",
    "ndt": "ndt.NDT",
    "ndt-d2d": "ndt_d2d.D2D",
    "soft-annealed": "soft_annealed.SOFT",
    "cpd-rigid": "cpd.RIGID",
    "cpd-similarity": "cpd.SIMILARITY",
    "filterreg": "filterreg.FILTERREG",
    "gmmreg": "gmmreg.GMMREG",
    "mmd": "mmd.MMD",
    "flow": "flow.FLOW",
    "flow-from-source": "flow.FLOW_FROM_SOURCE",
    "association-bp": "association_bp.ASSOCIATION_BP",
    "hypothesis-mixture": "hypotheses.HYPOTHESIS_MIXTURE",
}


class _Methods(Mapping[str, Method[Any]]):
    """Read-only; a method's module is imported when the method is first asked for: a
    page pays for what it shows.
    """

    def __getitem__(self, name: str) -> Method[Any]:
        module, constant = _LIST[name].split(".")
        method: Method[Any] = getattr(import_module(f"solvers.{module}"), constant)
        return method

    def __contains__(self, name: object) -> bool:
        return name in _LIST

    def __iter__(self) -> Iterator[str]:
        return iter(_LIST)

    def __len__(self) -> int:
        return len(_LIST)


METHODS: Mapping[str, Method[Any]] = _Methods()
"""Every method by name, in the order of the ladder."""
