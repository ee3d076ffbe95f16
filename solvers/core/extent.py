"""Clouds of no width, or of next to none: what no method can turn, and what leaves the range of numbers."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.method import Problem, S
from solvers.core.status import Status, mark
from solvers.core.tree import changed

LEAST_EXTENT = 1e-130
"""World units, along an axis. Where both clouds are narrower, squares of their distances lose digits, then vanish."""
TOO_NARROW = f"both clouds are less than {LEAST_EXTENT:g} u wide: multiply their points, and all lengths, by one number"
ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
"""The fraction of a cloud's largest coordinate that rounding can account for."""
EQUAL = "all {} points are equal: the rotation is undefined"
"""The reason of a run whose source or target lies at one place."""


def mark_narrow(state: S, problem: Problem) -> S:
    """The state, degenerate where both clouds are narrower than `LEAST_EXTENT`, and not points."""
    width = np.maximum(*(np.ptp(points, axis=1).max(axis=-1) for points in (problem.source, problem.target)))
    narrow = (width > 0.0) & (width < LEAST_EXTENT)
    if not narrow.any():
        return state
    # What the method said of them is beside the point.
    running = np.where(narrow, np.int8(Status.RUNNING), state.status)
    status, reason = mark(running, state.reason, narrow, Status.DEGENERATE, TOO_NARROW)
    return changed(state, status=status, reason=reason)


def mark_points(state: S) -> S:
    """The state, degenerate where a run has stopped for another reason although a cloud lies at one place: wherever it
    is put, it looks the same after any turn.
    """
    for name, points in (("source", state.problem.source), ("target", state.problem.target)):
        over = (state.status != Status.RUNNING) & (state.status != Status.DEGENERATE)
        # Two points tell most clouds from a place, at no cost.
        ends = points[:, [0, -1]]
        over &= np.ptp(ends, axis=1).max(axis=-1) <= 2.0 * ROUNDING * np.abs(ends).max(axis=(1, 2))
        if over.any():
            over[over] = at_one_place(points[over])
            running = np.where(over, np.int8(Status.RUNNING), state.status)
            status, reason = mark(running, state.reason, over, Status.DEGENERATE, EQUAL.format(name))
            state = changed(state, status=status, reason=reason)
    return state


def at_one_place(points: FloatArray) -> BoolArray:
    """Whether all points (..., n, d) of a cloud lie at one place, (...): along no axis are they farther apart than
    rounding of the largest coordinate can put them, so that neither a unit nor an origin decides.
    """
    blur = ROUNDING * np.abs(points).max(axis=(-2, -1))
    return np.asarray(np.ptp(points, axis=-2).max(axis=-1) <= blur)
