"""The list of methods: the one place that knows them all."""

from __future__ import annotations

import copyreg
from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Any, Literal

from solvers.core import validate
from solvers.core.method import Method

# name → module in solvers.methods and constant, in the order of the ladder
_LIST = {
    "kabsch": "pairs.kabsch.KABSCH",
    "similarity": "pairs.kabsch.SIMILARITY",
    "ransac": "pairs.ransac.RANSAC",
    "ransac-congruent": "pairs.congruent.CONGRUENT",
    "graduated-nonconvexity": "pairs.graduated.GRADUATED",
    "icp": "icp.icp.ICP",
    "trimmed-icp": "icp.icp.TRIMMED",
    "capped-icp": "icp.icp.CAPPED",
    "kiss-threshold-icp": "icp.kiss.KISS",
    "fast-robust-icp": "icp.fast_robust.FAST_ROBUST",
    "point-to-plane": "icp.point_to_plane.POINT_TO_PLANE",
    "gicp": "icp.gicp.GICP",
    "ndt": "ndt.ndt.NDT",
    "ndt-d2d": "ndt.d2d.D2D",
    "soft-annealed": "soft.annealed.SOFT",
    "cpd-rigid": "soft.cpd.RIGID",
    "cpd-similarity": "soft.cpd.SIMILARITY",
    "filterreg": "soft.filterreg.FILTERREG",
    "gmmreg": "soft.gmmreg.GMMREG",
    "mmd": "mmd.mmd.MMD",
    "branch-and-bound": "search.branch_and_bound.BRANCH_AND_BOUND",
    "correlative": "search.correlative.CORRELATIVE",
    "flow": "flow.flow.FLOW",
    "flow-from-source": "flow.flow.FLOW_FROM_SOURCE",
    "association-bp": "soft.belief_propagation.ASSOCIATION_BP",
    "hypothesis-mixture": "soft.hypotheses.HYPOTHESIS_MIXTURE",
}

MethodName = Literal[
    "kabsch", "similarity", "ransac", "ransac-congruent", "graduated-nonconvexity", "icp", "trimmed-icp", "capped-icp",
    "kiss-threshold-icp", "fast-robust-icp", "point-to-plane", "gicp", "ndt", "ndt-d2d", "soft-annealed", "cpd-rigid",
    "cpd-similarity", "filterreg", "gmmreg", "mmd", "branch-and-bound", "correlative", "flow", "flow-from-source",
    "association-bp", "hypothesis-mixture",
]  # fmt: skip
"""The names, for editors to complete."""

ALIASES = {
    "umeyama": "similarity",
    "ransac-unpaired": "ransac-congruent",
    "gnc": "graduated-nonconvexity",
    "point-to-point": "icp",
    "tricp": "trimmed-icp",
    "generalized-icp": "gicp",
    "p2d-ndt": "ndt",
    "d2d-ndt": "ndt-d2d",
}
"""The field's other names for the methods: accepted, but not listed."""

_MEANT = {
    **dict.fromkeys(("arun", "horn", "procrustes", "svd"), "kabsch"),
    **dict.fromkeys(("fgr", "teaser", "teaser++"), "graduated-nonconvexity"),
    **dict.fromkeys(("pl-icp", "plicp", "point-to-line"), "point-to-plane"),
    **dict.fromkeys(("bnb", "go-icp", "goicp"), "branch-and-bound"),
    "coherent-point-drift": "cpd",
}
"""Names of other authors' methods, with the nearest here, or a part of it: suggested in the message, not accepted."""


class _Methods(Mapping[str, Method[Any]]):
    """Read-only. A method's module is imported on first access, so that a page pays only
    for what it shows.
    """

    def __getitem__(self, name: str) -> Method[Any]:
        if name not in self:
            raise KeyError(_unknown(name))
        module, constant = _LIST[ALIASES.get(name, name)].rsplit(".", 1)
        method: Method[Any] = getattr(import_module(f"solvers.methods.{module}"), constant)
        return method

    def __contains__(self, name: object) -> bool:
        return name in _LIST or name in ALIASES

    def __repr__(self) -> str:
        width = max(map(len, self))
        return "\n".join(f"{name:{width}}  {self[name].summary}" for name in self)

    def __iter__(self) -> Iterator[str]:
        return iter(_LIST)

    def __len__(self) -> int:
        return len(_LIST)


METHODS: Mapping[str, Method[Any]] = _Methods()
"""Every method by name, in the order of the ladder."""


def method_of(name: object, argument: str = "method") -> Method[Any]:
    """The method of this name; a `Method`, listed or the caller's own, is returned as it is. Raises ValueError for an
    unknown name, and for a method of the caller's own under a listed name: messages about a result go by the name.
    """
    if isinstance(name, str) and name in METHODS:
        return METHODS[name]
    if not isinstance(name, Method):
        raise ValueError(f"{argument}: {_unknown(name)}")
    registered = METHODS.get(name.name, name) if isinstance(name.name, str) else name
    if (registered.start, registered.step, registered.partners) != (name.start, name.step, name.partners):
        raise ValueError(f"{argument}: {name.name!r} is the name of another method; give it one of its own")
    return name


def _recipe(method: Method[Any]) -> Any:
    """How a method is pickled: by its name if it is listed, since its functions may have none; else by its fields."""
    listed = isinstance(method.name, str) and METHODS.get(method.name) is method
    return (method_of, (method.name,)) if listed else method.__reduce_ex__(4)


copyreg.pickle(Method, _recipe)


def rigid_method_of(name: object) -> Method[Any]:
    """As `method_of`, where only rigid motions make sense: raises ValueError for a method that finds a scale."""
    method = method_of(name)
    if method.scaled:
        raise ValueError(f"method: {method.name!r} finds a scale, and a spread is of rigid motions")
    return method


def _unknown(name: object) -> str:
    """The message for an unknown name, which may only need lower case and hyphens."""
    plain = str(name).lower().replace("_", "-")
    plain = _MEANT.get(plain, plain)
    near = f", did you mean {plain!r}?" if plain in METHODS else validate.nearest(plain, [*METHODS, *ALIASES])
    return f"{name!r} is unknown{near}; known: {', '.join(sorted(METHODS))}"
