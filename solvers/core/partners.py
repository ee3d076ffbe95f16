"""Which target row each source row is paired with."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, IntArray

NONE = -1


def own_rows(used: BoolArray) -> IntArray:
    """The partners in known pairs: i for row i where the pair is used, else `NONE`, (b, m)."""
    return chosen(np.arange(used.shape[1]), used)


def chosen(rows: IntArray, used: BoolArray) -> IntArray:
    """`rows` where used, else `NONE`, (b, m)."""
    return np.where(used, rows, NONE).astype(np.int64)
