"""The methods that a reader's own clouds can be run through, and what one length and one share mean to each of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from widgets.engine.controls import Value

OPEN = 40.0  # spacings: a gate that is as wide as its slider goes stands open


@dataclass(frozen=True)
class Own:
    """One method. label: its button's. length: what the length scale is to it, or nothing; spacings: its usual size, in
    spacings of the target. share: what the share without a partner is to it, or nothing. options(length, share, area):
    the solver's own, from world units, a fraction and the area that the target fills, squared world units. points: of a
    cloud, at most, to begin with: a step of a network takes its time."""

    label: str
    length: str
    spacings: float
    share: str
    options: Callable[[float, float, float], dict[str, Any]]
    points: float = 400.0

    @property
    def opens(self) -> bool:
        """Whether its length may stand open."""
        return self.length in ("", "gate")

    def brings(self) -> dict[str, Value]:
        """What choosing the method puts the sliders to."""
        return {
            "length": self.spacings,
            "share": 20.0 if self.share in ("trim by count", "clutter") else 0.0,
            "points": self.points,
        }


def _gated(length: float, share: float, area: float) -> dict[str, Any]:
    return {**({} if length == float("inf") else {"gate": length}), **({"trim": share} if share else {})}


def _last(length: float, share: float, area: float) -> dict[str, Any]:
    return {"last": length}


def _clutter(length: float, share: float, area: float) -> dict[str, Any]:
    return {"clutter": share, "volume": area}


def _cells(length: float, share: float, area: float) -> dict[str, Any]:
    return {"cells": (2 * length, length)}


def _one_sample(length: float, share: float, area: float) -> dict[str, Any]:
    return {"samples": 1}


def _none(length: float, share: float, area: float) -> dict[str, Any]:
    return {}


OWN: Mapping[str, Own] = MappingProxyType({
    "icp": Own("ICP", "gate", OPEN, "trim", _gated),
    "trimmed-icp": Own("Trimmed ICP", "", OPEN, "trim by count", lambda _, share, __: {"keep": 1.0 - share}),
    "capped-icp": Own("Capped ICP", "cap", 8.0, "", lambda length, *_: {"cap": length}),
    "kiss-threshold-icp": Own("KISS threshold", "first threshold", 10.0, "",
                              lambda length, *_: {"initial": length, "least": length / 20}),
    "fast-robust-icp": Own("Fast and robust ICP", "", OPEN, "", _none),
    "point-to-plane": Own("Point to plane", "gate", OPEN, "trim", _gated),
    "gicp": Own("GICP", "gate", OPEN, "trim", _gated),
    "ransac-congruent": Own("RANSAC", "inlier distance", 3.0, "",
                            lambda length, *_: {"inlier": length, "tolerance": length, "separation": 6 * length}),
    "correlative": Own("Correlative search", "cell", 2.0, "", lambda length, *_: {"cell": length}),
    "ndt": Own("NDT", "smallest cell", 8.0, "", _cells),
    "ndt-d2d": Own("D2D-NDT", "smallest cell", 8.0, "", _cells),
    "soft-annealed": Own("Soft targets", "last width", 1.0, "", _last),
    "cpd-rigid": Own("Rigid CPD", "", OPEN, "clutter", _clutter),
    "cpd-similarity": Own("CPD with scale", "", OPEN, "clutter", _clutter),
    "filterreg": Own("FilterReg", "", OPEN, "clutter", _clutter),
    "gmmreg": Own("GMMReg", "last width", 1.0, "", _last),
    "mmd": Own("MMD-Reg", "smallest length", 3.0, "",
               lambda length, *_: {"lengths": (8 * length, 4 * length, 2 * length, length)}),
    "association-bp": Own("Association BP", "last width", 1.0, "", _last),
    "hypothesis-mixture": Own("Hypothesis mixture", "last width", 1.0, "", _last),
    "branch-and-bound": Own("Branch and bound", "cap", 3.0, "", lambda length, *_: {"cap": length, "boxes": 512}),
    "flow": Own("Learned flow", "", OPEN, "", _one_sample, points=150.0),
    "flow-from-source": Own("Flow from the source", "", OPEN, "", _one_sample, points=150.0),
})  # fmt: skip
"""Method → what it is here, in the order of the ladder but for ICP, which comes first."""


def options(method: str, length: float, share: float, area: float) -> dict[str, Any]:
    """The options of a method at a length scale (world units, infinite where it stands open), a share in [0, 1) and the
    target's area, squared world units."""
    return OWN[method].options(length, share, area)
