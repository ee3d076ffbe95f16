"""Places along a polyline, by their distance from its beginning."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray


def lengths(line: FloatArray) -> FloatArray:
    """How far along the line (k, d) its corners lie, (k,); the last is its length."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def places(line: FloatArray, along: FloatArray) -> FloatArray:
    """The places (n, d) at the distances `along` (n,) from the beginning of the line (k, d)."""
    corners = lengths(line)
    return np.column_stack([np.interp(along, corners, axis) for axis in line.T])
