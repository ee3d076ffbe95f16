"""A cloud made smaller before it is registered: a slab of it, fewer points, and how far apart its points lie."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers import nearest, validate
from solvers.arrays import FloatArray, IntArray

FINEST = 2**15  # cells along the longest side, so that three numbers of cells fit one of 63 bits


def slab(points: ArrayLike, low: float, high: float) -> FloatArray:
    """Of points (n, 3) those whose z lies within [low, high]. Seen from above: (k, 2), k from 0 to n, their x and y.

    Raises ValueError for what is no cloud of 3-D points.
    """
    p = validate.cloud(points, "points", 3)
    return np.ascontiguousarray(p[(p[:, 2] >= low) & (p[:, 2] <= high), :2])


def thinned(points: ArrayLike, most: int) -> FloatArray:
    """At most `most` points that stand for the points (n, d), d = 2 or 3: the centroids of the smallest cubic cells of
    which no more are occupied, in the order of the cells. A cloud that is small enough is returned as it is.

    Raises ValueError for what is no cloud, and for `most` below 1.
    """
    p = validate.cloud(points, "points")
    validate.count(most, "most", 1)
    if len(p) <= most:
        return p
    few, many = 1, 2
    while many < FINEST and len(np.unique(_cells(p, many))) <= most:
        few, many = many, 2 * many
    while many - few > 1:
        middle = (few + many) // 2
        if len(np.unique(_cells(p, middle))) <= most:
            few = middle
        else:
            many = middle
    _, cell, count = np.unique(_cells(p, few), return_inverse=True, return_counts=True)
    # Summed about one corner: coordinates of a national grid keep their last digits.
    corner = p.min(axis=0)
    sums = [np.bincount(cell, column - start, len(count)) for column, start in zip(p.T, corner, strict=True)]
    centroids: FloatArray = np.stack(sums, axis=1) / count[:, None] + corner
    return centroids


def spacing(points: ArrayLike) -> float:
    """The median distance, world units, of the points (n, d) to their nearest other place; 0 where there is but one."""
    places = np.unique(validate.cloud(points, "points"), axis=0)
    if len(places) < 2:
        return 0.0
    _, squares = nearest.build(places[None]).nearest_k(places[None], 2)
    return float(np.median(np.sqrt(squares[0, :, 1])))


def _cells(points: FloatArray, count: int) -> IntArray:
    """The number of the cell (n,) of each point, with `count` cells along the cloud's longest side."""
    low = points.min(axis=0)
    side = float((points.max(axis=0) - low).max())
    part = (points - low) / side * count if side > 0.0 else np.zeros_like(points)
    cell = np.minimum(np.floor(part), count - 1).astype(np.int64)
    number = np.zeros(len(points), dtype=np.int64)
    for axis in range(points.shape[1]):
        number = number * count + cell[:, axis]
    return number
