"""A grid that bounds a capped sum of squared distances from below for many poses at once. RANSAC without pairs screens
its hypotheses with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import FloatArray, IntArray

_CELLS = 256


@dataclass(frozen=True, eq=False)
class CappedGrid:
    """A grid over the target for each problem, whose cells hold the least value that min(r²/ε², 1) can take for a
    point in them.

    values: (b, cells), row by row, padded; the outermost cells hold 1. width: (b,) cells in a row. top: (b, 2) the
    indices of the last column and row. origin: (b, 2) the lower left corner, world units. cell: (b,) the side of a
    cell, world units.
    """

    values: FloatArray
    width: IntArray
    top: FloatArray
    origin: FloatArray
    cell: FloatArray

    @classmethod
    def of(cls, target: FloatArray, reach: FloatArray) -> CappedGrid:
        """The grid of the clouds (b, n, 2) for ε = reach (b,), with cells of ε/4, or larger where a target is wider
        than 64 ε.
        """
        low, high = target.min(axis=1), target.max(axis=1)
        cell = np.maximum(reach / 4.0, (high - low).max(axis=1) / _CELLS)
        origin = low - (reach + 2.0 * cell)[:, None]
        shape = np.floor((high - low + 2.0 * reach[:, None]) / cell[:, None]).astype(np.int64) + 5
        values = np.ones((len(target), int(shape.prod(axis=1).max())))
        around = np.arange(-5, 6)
        position = (target - origin[:, None]) / cell[:, None, None]
        home = np.floor(position)
        # Along each axis, the squared distance from the point to the nearest edge of each of the eleven cells around
        # it.
        gap = np.maximum(np.abs(home[..., None] + around + 0.5 - position[..., None]) - 0.5, 0.0)
        gap *= (cell / reach)[:, None, None, None]
        gap *= gap
        near = gap[:, :, 1, :, None] + gap[:, :, 0, None, :]
        # If the cells are smaller than the coordinates' rounding, a point's own cell may lie outside the grid.
        index = np.clip(home.astype(np.int64)[..., None] + around, 0, (shape - 1)[:, None, :, None])
        flat = index[:, :, 1, :, None] * shape[:, 0, None, None, None] + index[:, :, 0, None, :]
        flat += (np.arange(len(target)) * values.shape[1])[:, None, None, None]
        inside = near < 1.0
        np.minimum.at(values.ravel(), flat[inside], near[inside])
        return cls(values, shape[:, 0], (shape - 1).astype(np.float64), origin, cell)

    def total(self, R: FloatArray, t: FloatArray, points: FloatArray) -> FloatArray:
        """The sum over points (b, m, 2) at each of the poses R (b, k, 2, 2), t (b, k, 2): (b, k)."""
        b, k = t.shape[:2]
        size = self.cell[:, None, None]
        # Columns first, then rows, so that each is one contiguous block.
        turn = (R / size[..., None]).swapaxes(1, 2).reshape(b, 2 * k, 2)
        shift = ((t - self.origin[:, None]) / size).swapaxes(1, 2).reshape(b, 2 * k, 1)
        position = turn @ points.swapaxes(1, 2)
        position += shift
        position = position.reshape(b, 2, k, -1)
        np.clip(position, 0.0, self.top[:, :, None, None], out=position)
        at = position.astype(np.int64)
        cells = at[:, 1] * self.width[:, None, None]
        cells += at[:, 0]
        cells += (np.arange(b) * self.values.shape[1])[:, None, None]
        total: FloatArray = self.values.ravel()[cells].sum(axis=-1)
        return total
