"""Reducing a cloud before it is registered, to a slab or to fewer points, and measuring
how far apart its points lie.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.extent import at_one_place
from solvers.geometry import nearest

FINEST = 2**15  # cells along the longest side, so that three cell indices fit in 63 bits


def slab(points: ArrayLike, low: float, high: float) -> FloatArray:
    """A horizontal slice of a 3-D cloud, seen from above.

    Parameters
    ----------
    points : array_like of shape (n, 3)
        The cloud.
    low : float
        The least z, in the cloud's unit; −∞ for no limit.
    high : float
        The largest z; ∞ for no limit.

    Returns
    -------
    ndarray of shape (k, 2)
        x and y of the points whose z lies within [low, high], k from 0 to n.

    Raises
    ------
    ValueError
        If `points` is not one cloud of 3-D points, or a limit is not a number.

    Examples
    --------
    >>> from solvers.thinning import slab
    >>> slab([[0.0, 0.0, 0.1], [1.0, 2.0, 1.5]], 1.0, 2.0)
    array([[1., 2.]])
    """
    p = _single_cloud(points, 3)
    least, most = validate.limit(low, "low"), validate.limit(high, "high")
    return np.ascontiguousarray(p[(p[:, 2] >= least) & (p[:, 2] <= most), :2])


def thinned(points: ArrayLike, most: int) -> FloatArray:
    """Thin a cloud to fewer points that represent it.

    The centroids of the occupied cells of a cubic grid, in the order of the cells.
    Bisection finds how many cells divide the longest side: with this number at most
    `most` cells are occupied, and with one more there would be more (unless it is
    32767, the largest). A finer grid may do as well, since more cells do not always
    mean more occupied ones. A cloud that is small enough is returned as it is.

    Parameters
    ----------
    points : array_like of shape (n, d)
        The cloud, d = 2 or 3.
    most : int
        The most points, at least 1.

    Returns
    -------
    ndarray of shape (k, d)
        At most `most` points.

    Raises
    ------
    ValueError
        If `points` is not one cloud of 2 or 3 dimensions, or `most` not an integer of
        at least 1.

    Examples
    --------
    >>> from solvers.thinning import thinned
    >>> thinned([[0.0, 0.0], [0.2, 0.0], [4.0, 0.0]], 2)
    array([[0.1, 0. ],
           [4. , 0. ]])
    """
    p = _single_cloud(points)
    if p.shape[1] > 3:
        raise ValueError(f"points: expected 2 or 3 coordinates per point, got {p.shape[1]}")
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
    # Summed relative to one corner, so that coordinates of a national grid keep their last digits.
    corner = p.min(axis=0)
    sums = [np.bincount(cell, column - start, len(count)) for column, start in zip(p.T, corner, strict=True)]
    centroids: FloatArray = np.stack(sums, axis=1) / count[:, None] + corner
    return centroids


def spacing(points: ArrayLike) -> float:
    """The median distance from a cloud's points to their nearest neighbours, where equal points count as one.

    Parameters
    ----------
    points : array_like of shape (n, d)
        The cloud, in world units.

    Returns
    -------
    float
        World units; 0 if all points are equal, to rounding.

    Raises
    ------
    ValueError
        If `points` is not one cloud.

    Examples
    --------
    >>> from solvers.thinning import spacing
    >>> spacing([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]])
    1.0
    """
    places = np.unique(_single_cloud(points), axis=0)
    if at_one_place(places):
        return 0.0
    _, squares = nearest.build(places[None]).nearest_k(places[None], 2)
    return float(np.median(np.sqrt(squares[0, :, 1])))


def _single_cloud(points: ArrayLike, dim: int | None = None) -> FloatArray:
    """`points` as one cloud (n, d); raises ValueError for leading axes, which would be taken for points."""
    p = validate.cloud(points, "points", dim)
    if p.ndim != 2:
        raise ValueError(f"points: expected one cloud of shape (n, {dim or 'd'}), got {p.shape}")
    return p


def _cells(points: FloatArray, count: int) -> IntArray:
    """The number of each point's cell, (n,), with `count` cells along the cloud's longest
    side.
    """
    low = points.min(axis=0)
    side = float((points.max(axis=0) - low).max())
    part = (points - low) / side * count if side > 0.0 else np.zeros_like(points)
    cell = np.minimum(np.floor(part), count - 1).astype(np.int64)
    number = np.zeros(len(points), dtype=np.int64)
    for axis in range(points.shape[1]):
        number = number * count + cell[:, axis]
    return number
