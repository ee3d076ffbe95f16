"""Which target row each source row is paired with."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, IntArray

NONE = -1


def own_rows(used: BoolArray) -> IntArray:
    """Of known pairs: row i for row i where it is used, (b, m), else `NONE`."""
    return chosen(np.arange(used.shape[1]), used)


def chosen(rows: IntArray, used: BoolArray) -> IntArray:
    """The rows that are used, (b, m), `NONE` for the others."""
    return np.where(used, rows, NONE).astype(np.int64)
