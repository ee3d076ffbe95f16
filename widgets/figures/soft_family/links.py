"""The shares that a soft method distributes between two clouds, as threads, circles and crosses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.methods.soft import cpd
from solvers.methods.soft.shares import filterreg_shares, gmmreg_overlaps
from widgets.drawing.picture import Array, Mark, Points, Role, Segments, View

LEVELS = 6


@dataclass(frozen=True, eq=False)
class Links:
    """shares: (m, n), moving points in rows. side: the cloud of the mixture's components. clutter: the clutter's share
    of each observation, moving or fixed; empty if the method has no shares. partners: the effective number of partners
    per observation, on average.
    """

    shares: Array
    side: Role
    clutter: Array
    partners: float


def links(method: str, state: Any) -> Links:
    """The links in a state of one problem."""
    if method == "gmmreg":
        K = gmmreg_overlaps(state)
        return Links(K, "pair", np.zeros(0), float("nan"))
    if method == "filterreg":
        P = filterreg_shares(state)
        return Links(P, "target", 1.0 - state.weights[0], _partners(P))
    P = cpd.responsibilities(state)
    return Links(P, "source", 1.0 - state.row[0], _partners(P.T))


def _partners(P: Array) -> float:
    """The mean over rows of exp(entropy), with the clutter's share as one more entry: 1 if every row is decided."""
    whole = np.column_stack([P, np.maximum(1.0 - P.sum(axis=1), 0.0)])
    entropy = -(whole * np.log(np.maximum(whole, 1e-300))).sum(axis=1)
    return float(np.exp(entropy).mean())


def threads(moved: Array, fixed: Array, result: Links) -> Segments:
    """One thread per pair, from the moved (m, 2) to the fixed points (n, 2), in six weights: above 1/2, 1/4 … 1/64.

    Overlaps that add up to more than one at a point are divided by their sum: wide ones would hide the clouds.
    """
    shares = result.shares
    if result.side == "pair":
        shares = shares / np.maximum(shares.sum(axis=1, keepdims=True), 1.0)
    level = np.floor(np.log2(np.maximum(shares, 1e-9)) + 1e-6) + LEVELS + 1.0
    i, j = np.nonzero(level > 0.0)
    return Segments(moved[i], fixed[j], result.side, weight=np.minimum(level[i, j], LEVELS) / LEVELS)


def circles(centres: Array, sigma: float, role: Role, view: View) -> Points:
    """A circle of radius σ around each component."""
    return Points(centres, role, "ring", radius=sigma * view.scale, weight=np.full(len(centres), 0.3))


def crosses(points: Array, share: Array) -> Points:
    """A cross on each observation, as strong as the clutter's share of it."""
    return Points(points, "outlier", "cross", radius=5.5, weight=share)


def targets(moved: Array, state: Any) -> tuple[Mark, ...]:
    """FilterReg's soft targets, each as strong as its weight, with a line from the point that it attracts."""
    weight, to = state.weights[0], state.targets[0]
    return (
        Segments(moved, to, "accent", weight=weight),
        Points(to, "accent", "diamond", radius=4.0, weight=weight),
    )
