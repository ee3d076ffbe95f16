"""The methods for a reader's own clouds, and what the length scale and the share mean to each of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from widgets.engine.controls import Value

OPEN = 40.0  # spacings: the slider's maximum, which turns the gate off


@dataclass(frozen=True)
class Own:
    """One method. label: its name as shown. length: what the length scale means to it, or ""; spacings: the scale's
    usual size, in spacings of the target. share: what the share without a partner means to it, or "". options(length,
    share, area): the solver's options, from world units, a fraction and the area that the target fills, squared world
    units. points: the initial limit of points per cloud: a network's steps are slow."""

    label: str
    length: str
    spacings: float
    share: str
    options: Callable[[float, float, float], dict[str, Any]]
    points: float = 400.0

    @property
    def opens(self) -> bool:
        """Whether its length may be infinite."""
        return self.length in ("", "gate")

    def brings(self) -> dict[str, Value]:
        """The slider values that choosing the method sets."""
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
    "kiss-threshold-icp": Own("KISS threshold", "first σ", 10.0, "",
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
"""The methods by name, in the order of the ladder except for ICP, which comes first."""


def options(method: str, length: float, share: float, area: float) -> dict[str, Any]:
    """The options of a method for a length scale (world units; infinite for no gate), a share in [0, 1) and the
    target's area, squared world units."""
    return OWN[method].options(length, share, area)
