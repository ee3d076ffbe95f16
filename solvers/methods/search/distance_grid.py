"""A grid of the distances to a cloud, with coarser cells that list the points that may be nearest.

The distance to a cloud changes by no more than the query point moves. One number per
cell, the distance from its middle, is therefore right to within half the cell's
diagonal anywhere in the cell, and that number less this error is a lower bound. It
costs one look-up, whatever the size of the cloud.

Outside the grid, the nearest cell on its border is used. That is a lower bound, too:
the grid is convex and contains the cloud, so the projection of a point onto it is no
farther from any point of the cloud.

References
----------
.. [1] J. Yang, H. Li, D. Campbell, Y. Jia, "Go-ICP: a globally optimal solution to 3D
   ICP point-set registration", 2016, sec. 5.1 (where a distance transform replaces the
   nearest neighbour, and its error is neglected). doi:10.1109/TPAMI.2015.2513405
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import AnyArray, FloatArray
from solvers.geometry import nearest

WIDE = 5
"""The side of a wide cell, one that lists points, in cells."""
LISTED = 8
"""How many points a wide cell lists."""
MOST = 1200
"""The most cells along either side; if there would be more, the cells grow."""
ROUNDING = 1e-6
"""The relative error that a few float32 roundings may make in a coordinate."""


@dataclass(frozen=True, eq=False)
class DistanceGrid:
    """Distances to one cloud of n points in the plane; made by `build`.

    Attributes
    ----------
    low : ndarray of shape (2,)
        The grid's lower left corner.
    cell : float
        The side of a cell.
    shape : tuple of int
        Cells along x and y.
    distances : ndarray of float32, shape (shape[0] · shape[1],)
        The distance from each cell's middle to the cloud, one row per x.
    error : float
        Half a cell's diagonal.
    listed : ndarray of shape (cells, k, 2)
        The k points nearest to the middle of each wide cell, `WIDE` cells to a side.
    others : ndarray of shape (cells,)
        The distance from there to the nearest point not listed; infinite if all are
        listed.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.methods.search.distance_grid import build
    >>> grid = build(np.array([[0.0, 0.0], [1.0, 0.0]]), cell=0.1, margin=0.5)
    >>> grid.shape
    (20, 10)
    >>> x, y = (np.array([0.5, 0.2]) - grid.low) / grid.cell
    >>> bool(abs(grid.look_up(x, y) - np.hypot(0.5, 0.2)) <= grid.error)
    True
    """

    low: FloatArray
    cell: float
    shape: tuple[int, int]
    distances: AnyArray
    error: float
    listed: FloatArray
    others: FloatArray

    def look_up(self, x: AnyArray, y: AnyArray) -> AnyArray:
        """The distances stored in the cells, float32. x, y: (...) float32, in cells from `low`."""
        i = np.clip(x, 0.0, self.shape[0] - 1.0).astype(np.int32)
        i *= np.int32(self.shape[1])
        i += np.clip(y, 0.0, self.shape[1] - 1.0).astype(np.int32)
        return self.distances.take(i)

    def candidates(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The points listed in the wide cells of `points` (..., 2), (..., k, 2), and a lower bound (...) of the
        distance to all others.
        """
        wide = self.cell * WIDE
        shape = (self.shape[0] // WIDE, self.shape[1] // WIDE)
        at = np.clip((points - self.low) / wide, 0.0, np.array(shape) - 1.0).astype(np.int64)
        row = at[..., 0] * shape[1] + at[..., 1]
        off = points - (self.low + (at + 0.5) * wide)
        return self.listed[row], self.others[row] - np.hypot(off[..., 0], off[..., 1])


def build(points: FloatArray, cell: float, margin: float) -> DistanceGrid:
    """The grid of a cloud.

    Parameters
    ----------
    points : ndarray of shape (n, 2)
        The cloud, in a unit in which neither its size nor `cell` is extreme.
    cell : float
        The side of a cell; enlarged if there would be more than `MOST` along a side.
    margin : float
        How far the grid reaches beyond the cloud.

    Returns
    -------
    DistanceGrid
        Distances and listed points.
    """
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    cell = max(cell, float((high - low).max()) / MOST)
    wide = cell * WIDE
    nx, ny = (max(1, int(np.ceil(side / wide - 1e-9))) for side in high - low)
    x, y = ((np.arange(n) + 0.5) * wide + low[k] for k, n in enumerate((nx, ny)))
    middles = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    k = min(LISTED, len(points))
    index = nearest.build(points[None])
    rows, squares = index.nearest_k(middles[None], min(k + 1, len(points)))
    listed = points[rows[0, :, :k]]
    others = np.sqrt(squares[0, :, k]) if len(points) > k else np.full(len(middles), np.inf)
    step = (np.arange(WIDE) + 0.5 - 0.5 * WIDE) * cell
    distances = np.empty((nx, WIDE, ny, WIDE), dtype=np.float32)
    # Cells are placed relative to the middles of the wide cells: those at the same position in each are done at once.
    for i in range(WIDE):
        for j in range(WIDE):
            dx = middles[:, 0, None] + step[i] - listed[..., 0]
            dy = middles[:, 1, None] + step[j] - listed[..., 1]
            least = np.sqrt((dx * dx + dy * dy).min(axis=1))
            open_ = np.flatnonzero(others - np.hypot(step[i], step[j]) < least)
            if open_.size:  # a point that is not listed may be nearer
                least[open_] = np.sqrt(index.nearest(middles[None, open_] + (step[i], step[j]))[1][0])
            distances[:, i, :, j] = least.reshape(nx, ny)
    error = float(cell * np.sqrt(0.5))
    return DistanceGrid(low, cell, (nx * WIDE, ny * WIDE), distances.reshape(-1), error, listed, others)
