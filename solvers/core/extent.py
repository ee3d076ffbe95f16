"""Clouds with no extent, whose rotation is undefined, or with so little that their squared distances underflow."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.method import Problem, S
from solvers.core.status import Status, mark
from solvers.core.tree import changed

LEAST_EXTENT = 1e-130
"""In world units, along the longest axis. If both clouds are narrower, their squared distances lose digits, then
underflow."""
TOO_NARROW = f"both clouds are less than {LEAST_EXTENT:g} u wide: multiply their points, and all lengths, by one number"
ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
"""The fraction of a cloud's largest coordinate that rounding can account for."""
EQUAL = "all {} points are equal: the rotation is undefined"
"""The reason given if all points of the source or of the target coincide."""


def mark_narrow(state: S, problem: Problem) -> S:
    """The state, with problems marked degenerate if both clouds are narrower than `LEAST_EXTENT` but not both single
    points."""
    width = np.maximum(*(np.ptp(points, axis=1).max(axis=-1) for points in (problem.source, problem.target)))
    narrow = (width > 0.0) & (width < LEAST_EXTENT)
    if not narrow.any():
        return state
    # This overrides any status that the method gave them.
    running = np.where(narrow, np.int8(Status.RUNNING), state.status)
    status, reason = mark(running, state.reason, narrow, Status.DEGENERATE, TOO_NARROW)
    return changed(state, status=status, reason=reason)


def mark_points(state: S) -> S:
    """The state, with stopped problems marked degenerate if all points of a cloud coincide: such a cloud looks the same
    after any rotation.
    """
    for name, points in (("source", state.problem.source), ("target", state.problem.target)):
        over = (state.status != Status.RUNNING) & (state.status != Status.DEGENERATE)
        # The first and last points alone clear most clouds, at almost no cost.
        ends = points[:, [0, -1]]
        over &= np.ptp(ends, axis=1).max(axis=-1) <= 2.0 * ROUNDING * np.abs(ends).max(axis=(1, 2))
        if over.any():
            over[over] = at_one_place(points[over])
            running = np.where(over, np.int8(Status.RUNNING), state.status)
            status, reason = mark(running, state.reason, over, Status.DEGENERATE, EQUAL.format(name))
            state = changed(state, status=status, reason=reason)
    return state


def at_one_place(points: FloatArray) -> BoolArray:
    """Whether all points (..., n, d) of a cloud coincide, (...): along no axis are they farther apart than rounding of
    the largest coordinate could put them, so that the answer depends on neither unit nor origin.
    """
    blur = ROUNDING * np.abs(points).max(axis=(-2, -1))
    return np.asarray(np.ptp(points, axis=-2).max(axis=-1) <= blur)
