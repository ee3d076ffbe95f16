"""Poses that come round again: a run whose step is a function of its pose alone, and which
does not come to rest, goes through the same few poses for ever.

Later poses are compared with one anchor, an earlier place of the moved points, which is
renewed at the steps 1, 2, 4, 8 … (Brent 1980, An improved Monte Carlo factorization
algorithm). A round of n poses that is entered after w steps is found by step 2 max(w, n) + n.
"""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray, IntArray

AGAIN = "the same few poses come round again and again"
"""Why such a run has stalled."""


def motion(a: FloatArray, b: FloatArray, weights: FloatArray | None = None) -> FloatArray:
    """Root mean square distance between rows of (b, m, d), (b,); with weights (b, m), of those that have one."""
    if weights is None or (used := weights > 0.0).all():
        squares = np.square(b - a).reshape(len(a), -1).sum(axis=1)
        return np.asarray(np.sqrt(squares / a.shape[1]))
    squares = np.square(np.where(used[..., None], b - a, 0.0)).reshape(len(a), -1).sum(axis=1)
    return np.asarray(np.sqrt(squares / np.maximum(used.sum(axis=1), 1)))


def anchor(taken: IntArray, moved: FloatArray, before: FloatArray) -> FloatArray:
    """The points (b, m, d) to compare later ones with: `moved` in the problems that have
    taken (b,) 1, 2, 4, 8 … steps, else the anchor `before`.
    """
    renew = (taken & (taken - 1)) == 0
    return np.where(renew[:, None, None], moved, before)
