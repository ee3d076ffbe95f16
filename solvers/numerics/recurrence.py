"""Cycles of poses: a run whose step is a function of its pose alone, and which does not
come to rest, goes through the same few poses for ever.

Later poses are compared with one anchor, an earlier place of the moved points, which is
renewed at the steps 1, 2, 4, 8 … (Brent 1980, An improved Monte Carlo factorization
algorithm). A cycle of n poses that is entered after w steps is found by step 2 max(w, n) + n.
"""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray, IntArray

AGAIN = "the run cycles through the same few poses"
"""The reason given when such a run stalls."""


def anchor(steps: IntArray, moved: FloatArray, before: FloatArray) -> FloatArray:
    """The points (b, m, d) to compare later ones with: `moved` in the problems that have
    taken (b,) 1, 2, 4, 8 … steps, else the anchor `before`.
    """
    renew = (steps & (steps - 1)) == 0
    return np.where(renew[:, None, None], moved, before)
