"""The normal distributions transform's map: a grid over the target, and in each of its cells one Gaussian.

A cell of side h with at least three points keeps their mean μ and their maximum-likelihood covariance Σ (divided by
the count). It is dropped when the points lie at one place, `λ_max < 1e-9 h²`; otherwise the small eigenvalue is raised
to at least `0.001 λ_max` and Σ is inverted. One Gaussian loses all other detail: a corner is blurred into an ellipse,
and two walls in one cell become one wall across it.

Points near a cell's border see half a wall. With four grids, the first and those shifted by h/2 in x, in y and in
both, every point is in four cells; that softens the borders but does not remove them.

A point's cell is looked up in a table over the bounding box of the kept cells, at a cost independent of their number.

Source: Biber & Straßer 2003, The normal distributions transform (the cells, the four grids, the eigenvalue floor).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, ReasonArray
from solvers.core.brief import brief
from solvers.core.extent import at_one_place
from solvers.core.kinds import shown
from solvers.core.numbers import finite, numbers
from solvers.core.tree import distinct, once
from solvers.methods.ndt.floor import inverse
from solvers.numerics.fits import typical_radius

LEAST_POINTS = 3
LEAST_VARIANCE = 1e-9
"""A cell's points are at one place if the large eigenvalue is below this fraction of the cell's side squared."""
LEAST_SIZE = 1e-9
"""The default cell size is at least this fraction of the largest coordinate, so that rounding separates no points."""
LARGEST_TABLE = 2**18
"""The most places in the bounding box of one grid's kept cells; with more, the cells are reported as too small."""
SHIFTS = np.array([(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)])
SHIFTS.flags.writeable = False

TOO_FEW = f"fewer than {LEAST_POINTS} points"
ONE_PLACE = "all points at one place"
NO_CELLS = "no cell keeps a Gaussian"
TOO_SMALL = "the cells are too small for the extent"


@dataclass(frozen=True, eq=False)
class NdtMap:
    """The cells of b target clouds on G grids (1 or 4).

    Made by `build`. The cells that hold a point of a cloud are listed grid by grid,
    padded to C, the largest number for any cloud.

    Attributes
    ----------
    size : ndarray of shape (b,)
        h, the side of a cell, world units.
    origin : ndarray of shape (b, G, 2)
        A corner of each grid's cells.
    grid : ndarray of int8, shape (b, C)
        The grid of a cell; −1 where padding.
    corner : ndarray of shape (b, C, 2)
        Its lower left corner.
    count : ndarray of int, shape (b, C)
        The points in it.
    mean : ndarray of shape (b, C, 2)
        μ.
    covariance : ndarray of shape (b, C, 2, 2)
        As measured, before the floor.
    precision : ndarray of shape (b, C, 2, 2)
        The inverse after the floor, zero where dropped.
    kept : ndarray of bool, shape (b, C)
        Whether it keeps its Gaussian.
    dropped : ndarray of object, shape (b, C)
        Why not; empty where kept.
    reason : ndarray of object, shape (b,)
        Why the whole map is unusable; empty where it is usable.
    first : ndarray of shape (b, G, 2)
        The least column and row of the kept cells' bounding box.
    shape : ndarray of shape (b, G, 2)
        Its columns and rows.
    table : ndarray of int32, shape (b, G, L)
        For each place in the box, y running fastest, the number of the cell there, or
        −1.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import build
    >>> cells = build(np.array([[[0.1, 0.1], [0.5, 0.2], [0.9, 0.4], [3.5, 0.5]]]), 1.0)
    >>> cells.lookup(np.array([[[0.3, 0.9], [3.4, 0.4]]]), np.array([0])).tolist()
    [[[0, -1]]]
    """

    size: FloatArray
    origin: FloatArray
    grid: AnyArray
    corner: FloatArray
    count: IntArray
    mean: FloatArray
    covariance: FloatArray
    precision: FloatArray
    kept: BoolArray
    dropped: ReasonArray
    reason: ReasonArray
    first: FloatArray
    shape: FloatArray
    table: AnyArray

    __repr__ = brief

    def lookup(self, points: FloatArray, which: IntArray) -> IntArray:
        """The number of the kept cell that holds each point.

        Parameters
        ----------
        points : ndarray of shape (k, m, 2)
            k point sets, world units.
        which : ndarray of int, shape (k,)
            Which of the b clouds' maps each set is looked up in.

        Returns
        -------
        ndarray of int, shape (k, G, m)
            On each grid; −1 for none.
        """
        table = distinct(self.table)
        clouds, G, length = table.shape
        which = which % clouds
        origin, first, shape = (distinct(a)[which][:, :, None] for a in (self.origin, self.first, self.shape))
        size = self.size[which, None, None]
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            cell = [np.floor((points[:, None, :, k] - origin[..., k]) / size) - first[..., k] for k in (0, 1)]
            nx, ny = shape[..., 0], shape[..., 1]
            inside = (cell[0] >= 0.0) & (cell[0] < nx) & (cell[1] >= 0.0) & (cell[1] < ny)
            flat = np.where(inside, cell[0] * ny + cell[1], 0.0).astype(np.int64)
        base = (which[:, None, None] * G + np.arange(G)[:, None]) * length
        return np.where(inside, table.ravel()[base + flat], np.int64(-1))


def build(points: FloatArray, size: FloatArray | float, *, offset: FloatArray | None = None, grids: int = 1) -> NdtMap:
    """The map of clouds.

    Parameters
    ----------
    points : ndarray of shape (b, n, 2)
        The clouds, in world units.
    size : float or ndarray of shape (b,)
        h, the side of a cell, positive, in world units.
    offset : ndarray of shape (2,), optional
        A corner of the first grid's cells, world units. None is the origin.
    grids : int, default 1
        1, or 4: the first, and those shifted by h/2 in x, in y and in both.

    Returns
    -------
    NdtMap
        The cells of all b clouds.

    Raises
    ------
    ValueError
        If `points` are not planar clouds, a size is not positive, or `offset` or
        `grids` is invalid.

    References
    ----------
    .. [1] P. Biber, W. Straßer, "The normal distributions transform: a new approach to
       laser scan matching", 2003.

    Examples
    --------
    >>> from solvers.ndt_map import build
    >>> from solvers.scenes import room
    >>> cells = build(room("clean").target[None], 0.8)
    >>> cells.mean.shape, cells.kept.sum()
    ((1, 32, 2), np.int64(31))
    """
    if validate.count(grids, "grids") not in (1, 4):
        raise ValueError(f"grids: expected 1 or 4, got {grids!r}")
    points = validate.cloud(points, "points", 2)
    if points.ndim != 3:
        raise ValueError(f"points: expected shape (b, n, 2), got {points.shape}; pass points[None] for one cloud")
    h = numbers(size, "size")
    if h.shape not in ((), (len(points),)):
        raise ValueError(f"size: expected one number, or one for each of {len(points)} clouds, got shape {h.shape}")
    h = np.broadcast_to(h, (len(points),))
    if not (h > 0.0).all():
        raise ValueError(f"size: expected a positive number, got {shown(size)}")
    shift = np.zeros(2) if offset is None else finite(numbers(offset, "offset"), "offset")
    if shift.shape != (2,):
        raise ValueError(f"offset: expected shape (2,), got {shift.shape}")
    if (h == h[:1]).all():
        return once(lambda clouds: _built(clouds, h[: len(clouds)], shift, grids), points)
    return _built(points, h, shift, grids)


def _built(points: FloatArray, size: FloatArray, shift: FloatArray, grids: int) -> NdtMap:
    b, n, _ = points.shape
    h = size.copy()
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        origin = shift + h[:, None, None] * SHIFTS[:grids]
        cells = np.floor((points[:, None] - origin[:, :, None]) / h[:, None, None, None])
        flat, groups = cells.reshape(-1, 2), np.repeat(np.arange(b * grids), n)
        order = np.lexsort((flat[:, 1], flat[:, 0], groups))
        flat, groups = flat[order], groups[order]
        new = np.ones(len(flat), dtype=np.bool_)
        new[1:] = (flat[1:] != flat[:-1]).any(axis=1) | (groups[1:] != groups[:-1])
        starts = np.flatnonzero(new)
        count = np.diff(np.append(starts, len(flat)))
        q = np.broadcast_to(points[:, None], (b, grids, n, 2)).reshape(-1, 2)[order]
        # The mean is taken about a point of the cell: far from the origin no digits are lost.
        about = q[starts]
        centred = q - np.repeat(about, count, axis=0)
        mean = np.add.reduceat(centred, starts) / count[:, None]
        centred = centred - np.repeat(mean, count, axis=0)
        products = np.stack([centred[:, i] * centred[:, j] for i, j in ((0, 0), (0, 1), (1, 1))], axis=1)
        xx, xy, yy = (np.add.reduceat(products, starts) / count[:, None]).T
        covariance = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-1)
        owner = groups[starts] // grids
        precision, wide = inverse(covariance, LEAST_VARIANCE * np.square(h[owner]))
    enough = count >= LEAST_POINTS
    group, cell = groups[starts], flat[starts]
    good, oversized = _indexable(enough & wide, group, cell, b, grids)
    dropped = np.where(enough, np.where(wide, "", ONE_PLACE), TOO_FEW).astype(object)
    dropped[(dropped == "") & ~good] = TOO_SMALL

    number = np.arange(len(owner)) - np.searchsorted(owner, owner)
    most = int(number.max()) + 1

    def padded(values: AnyArray, empty: object) -> AnyArray:
        out = np.full((b, most, *values.shape[1:]), empty, dtype=values.dtype)
        out[owner, number] = values
        return out

    first, shape, table = _table(good, group, cell, number, b, grids)
    reason = np.full(b, "", dtype=object)
    reason[np.bincount(owner[good], minlength=b) == 0] = NO_CELLS
    reason[oversized] = TOO_SMALL
    return NdtMap(
        size=h, origin=origin, grid=padded((group % grids).astype(np.int8), -1),
        corner=padded(np.nan_to_num(origin.reshape(-1, 2)[group] + cell * h[owner][:, None]), 0.0),
        count=padded(count.astype(np.int64), 0), mean=padded(about + mean, 0.0), covariance=padded(covariance, 0.0),
        precision=padded(np.where(good[:, None, None], precision, 0.0), 0.0), kept=padded(good, False),
        dropped=padded(dropped, ""), reason=reason, first=first, shape=shape, table=table,
    )  # fmt: skip


def default_size(points: FloatArray) -> FloatArray:
    """Cell sizes that suit the extent and the density of clouds.

    0.3 of the RMS radius ρ without strays or, for sparse clouds, the length that holds
    three of n points spread along a circle of that radius: `3 · 2πρ/n`.

    Parameters
    ----------
    points : ndarray of shape (b, n, 2)
        The clouds, in world units.

    Returns
    -------
    ndarray of shape (b,)
        World units. 1 where all points are at the origin.

    Examples
    --------
    >>> from solvers.ndt_map import default_size
    >>> from solvers.scenes import room
    >>> default_size(room("clean").target[None]).round(2)
    array([1.])
    """
    with np.errstate(over="ignore", under="ignore"):
        least = LEAST_SIZE * np.abs(points).max(axis=(1, 2))
        radius = np.where(at_one_place(points), 0.0, typical_radius(points))
        size = np.maximum(radius * max(0.3, 6.0 * np.pi / points.shape[1]), least)
        return np.asarray(np.where(size > 0.0, size, 1.0))


def _box(mask: BoolArray, group: IntArray, cell: FloatArray, b: int, grids: int) -> tuple[FloatArray, FloatArray]:
    first, last = np.full((b * grids, 2), np.inf), np.full((b * grids, 2), -np.inf)
    np.minimum.at(first, group[mask], cell[mask])
    np.maximum.at(last, group[mask], cell[mask])
    has_cells = np.isfinite(first)
    return np.where(has_cells, first, 0.0), np.where(has_cells, last - np.where(has_cells, first, 0.0) + 1.0, 0.0)


def _indexable(
    mask: BoolArray, group: IntArray, cell: FloatArray, b: int, grids: int
) -> tuple[BoolArray, BoolArray]:
    """The cells of `mask`, except of clouds whose bounding box is too large for a table, and which clouds those are."""
    with np.errstate(over="ignore", invalid="ignore"):
        _, shape = _box(mask, group, cell, b, grids)
        area = shape[:, 0] * shape[:, 1]
        # Beyond 2⁵³ neighbouring cells share a float64 number.
        far = np.zeros(b * grids)
        np.maximum.at(far, group[mask], np.abs(cell[mask]).max(axis=1))
        oversized = np.asarray((~(area <= LARGEST_TABLE) | ~(far < 2.0**52)).reshape(b, grids).any(axis=1))
    return np.asarray(mask & ~oversized[group // grids]), oversized


def _table(
    mask: BoolArray, group: IntArray, cell: FloatArray, number: IntArray, b: int, grids: int
) -> tuple[FloatArray, FloatArray, AnyArray]:
    first, shape = _box(mask, group, cell, b, grids)
    length = max(1, int((shape[:, 0] * shape[:, 1]).max()))
    table = np.full((b * grids, length), -1, dtype=np.int32)
    at = cell[mask] - first[group[mask]]
    table[group[mask], (at[:, 0] * shape[group[mask], 1] + at[:, 1]).astype(np.int64)] = number[mask]
    return first.reshape(b, grids, 2), shape.reshape(b, grids, 2), table.reshape(b, grids, length)


def check_size(value: object, name: str) -> float:
    """A cell size, checked.

    Parameters
    ----------
    value : object
        A number from 1e-100 to 1e100.
    name : str
        The name in the error message.

    Returns
    -------
    float
        The number.

    Raises
    ------
    ValueError
        If it is not such a number; the message names it.

    Examples
    --------
    >>> from solvers.ndt_map import check_size
    >>> check_size(2, "cell")
    2.0
    """
    return validate.number(value, name, 1e-100, 1e100)
