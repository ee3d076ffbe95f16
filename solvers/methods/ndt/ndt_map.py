"""The normal distributions transform's map: a grid over the target, and in each of its
cells one Gaussian.

A cell of side h with at least three points keeps their mean μ and their
maximum-likelihood covariance Σ (divided by the count). It is dropped when the points
lie at one place, `λ_max < 1e-9 h²`; else the small eigenvalue is raised to `0.001 λ_max`
and Σ is inverted. One Gaussian forgets what else it saw: a corner is blurred into an
ellipse, a cell that two walls share into one wall across.

Points near a border see half a wall. With four grids, the first and those moved by h/2
in x, in y and in both, every point is in four cells; that softens the borders and does
not remove them.

A point's cell is found by a table over the bounding box of the kept cells, at the same
cost however many there are.

Source: Biber & Straßer 2003, The normal distributions transform: a new approach to
laser scan matching (the cells, the four grids, the floor of the eigenvalue).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, ReasonArray
from solvers.core.tree import distinct, once
from solvers.geometry.spectral import symmetric_eigen

LEAST_POINTS = 3
LEAST_VARIANCE = 1e-9
"""The largest eigenvalue below which a cell's points are at one place, as a fraction of the square of its side."""
LEAST_SIZE = 1e-9
"""The default cell size is at least this fraction of the largest coordinate: rounding parts no points."""
FLOOR = 1e-3
"""The smallest eigenvalue of a cell's covariance is raised to this fraction of the largest."""
SMALLEST = 1e-300
"""An eigenvalue below this is zero: it has no inverse in float64."""
LARGEST_TABLE = 2**18
"""Places in the bounding box of one grid's kept cells, from which the cells are said to be too small."""

SHIFTS = np.array([(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)])
SHIFTS.flags.writeable = False

TOO_FEW = f"fewer than {LEAST_POINTS} points"
ONE_PLACE = "all points at one place"
NO_CELLS = "no cell keeps a Gaussian"
TOO_SMALL = "the cells are too small for the extent"


@dataclass(frozen=True, eq=False)
class NdtMap:
    """The cells of b target clouds on G grids (1 or 4). Make it by `build`.

    size: (b,) h, world units. origin: (b, G, 2) where a corner of grid g's cells lies.
    The cells that hold a point, padded to C of each cloud, grid by grid: grid (b, C),
    −1 where padding; corner (b, C, 2) the lower left; count (b, C); mean (b, C, 2);
    covariance (b, C, 2, 2) as measured, before the floor; precision (b, C, 2, 2) after
    it, zero where dropped; kept (b, C); dropped (b, C) why not, empty where kept.
    reason: (b,) why the map is of no use at all, empty where it is. first, shape: (b,
    G, 2) the bounding box of the kept cells; table: (b, G, L) of its places, row by row
    in x, the number of the cell there or −1.
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

    def lookup(self, points: FloatArray, which: IntArray) -> IntArray:
        """The number of the kept cell that each of the points (k, m, 2) is in, on each
        grid: (k, G, m), −1 for none. which: (k,) the cloud among the b in whose map
        each set of points is looked up.
        """
        table = distinct(self.table)
        clouds, G, length = table.shape
        which = which % clouds
        origin, first, shape = (distinct(a)[which][:, :, None] for a in (self.origin, self.first, self.shape))
        size = self.size[which, None, None]
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            place = [np.floor((points[:, None, :, k] - origin[..., k]) / size) - first[..., k] for k in (0, 1)]
            nx, ny = shape[..., 0], shape[..., 1]
            inside = (place[0] >= 0.0) & (place[0] < nx) & (place[1] >= 0.0) & (place[1] < ny)
            flat = np.where(inside, place[0] * ny + place[1], 0.0).astype(np.int64)
        base = (which[:, None, None] * G + np.arange(G)[:, None]) * length
        return np.where(inside, table.ravel()[base + flat], np.int64(-1))


def build(points: FloatArray, size: FloatArray | float, *, offset: FloatArray | None = None, grids: int = 1) -> NdtMap:
    """The map of the clouds (b, n, 2). size: h in world units, one or (b,), positive;
    offset: (2,) where the first grid's corners lie, world units (None: the origin);
    grids: 1 or 4. Raises ValueError for another number of grids.
    """
    if grids not in (1, 4):
        raise ValueError(f"grids: expected 1 or 4, got {grids!r}")
    h = np.broadcast_to(np.asarray(size, dtype=np.float64), (len(points),))
    shift = np.zeros(2) if offset is None else np.asarray(offset, dtype=np.float64)
    if (h != h[:1]).any():
        return _built(points, h, shift, grids)
    return once(lambda clouds: _built(clouds, h[: len(clouds)], shift, grids), points)


def _built(points: FloatArray, size: FloatArray, shift: FloatArray, grids: int) -> NdtMap:
    b, n, _ = points.shape
    h = size.copy()
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        origin = shift + h[:, None, None] * SHIFTS[:grids]
        place = np.floor((points[:, None] - origin[:, :, None]) / h[:, None, None, None])
        flat, many = place.reshape(-1, 2), np.repeat(np.arange(b * grids), n)
        order = np.lexsort((flat[:, 1], flat[:, 0], many))
        flat, many = flat[order], many[order]
        new = np.ones(len(flat), dtype=np.bool_)
        new[1:] = (flat[1:] != flat[:-1]).any(axis=1) | (many[1:] != many[:-1])
        starts = np.flatnonzero(new)
        count = np.diff(np.append(starts, len(flat)))
        q = np.broadcast_to(points[:, None], (b, grids, n, 2)).reshape(-1, 2)[order]
        # The mean is taken about a point of the cell: far from the origin no digits are
        # lost.
        about = q[starts]
        centred = q - np.repeat(about, count, axis=0)
        mean = np.add.reduceat(centred, starts) / count[:, None]
        centred = centred - np.repeat(mean, count, axis=0)
        products = np.stack([centred[:, i] * centred[:, j] for i, j in ((0, 0), (0, 1), (1, 1))], axis=1)
        xx, xy, yy = (np.add.reduceat(products, starts) / count[:, None]).T
        covariance = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-1)
        owner = many[starts] // grids
        precision, wide = inverse(covariance, LEAST_VARIANCE * np.square(h[owner]))
    enough = count >= LEAST_POINTS
    group, cell = many[starts], flat[starts]
    good, lost = _indexable(enough & wide, group, cell, b, grids)
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
    reason[lost] = TOO_SMALL
    return NdtMap(
        size=h, origin=origin, grid=padded((group % grids).astype(np.int8), -1),
        corner=padded(np.nan_to_num(origin.reshape(-1, 2)[group] + cell * h[owner][:, None]), 0.0),
        count=padded(count.astype(np.int64), 0), mean=padded(about + mean, 0.0), covariance=padded(covariance, 0.0),
        precision=padded(np.where(good[:, None, None], precision, 0.0), 0.0), kept=padded(good, False),
        dropped=padded(dropped, ""), reason=reason, first=first, shape=shape, table=table,
    )  # fmt: skip


def default_size(points: FloatArray) -> FloatArray:
    """A cell size for the clouds (b, n, 2) that goes with their extent and density, (b,).

    0.3 of the RMS radius ρ, or, for sparse clouds, what holds three points of n spread
    over a circle of that radius: `3 · 2πρ/n`. 1 u where all points are at the origin.
    """
    with np.errstate(over="ignore", under="ignore"):
        b, n, _ = points.shape
        squares = np.square(points - points.mean(axis=1, keepdims=True)).reshape(b, -1).sum(axis=1)
        least = LEAST_SIZE * np.abs(points).max(axis=(1, 2))
        size = np.maximum(np.sqrt(squares / n) * max(0.3, 6.0 * np.pi / n), least)
        return np.asarray(np.where(size > 0.0, size, 1.0))


def inverse(covariance: FloatArray, least: FloatArray | float = 0.0) -> tuple[FloatArray, BoolArray]:
    """The inverses (..., 2, 2) after the floor of the small eigenvalue, and where the
    large one is at least `least` (...), and not zero; the identity elsewhere.
    """
    values, vectors, wide = _floored(covariance, least)
    return (vectors / values[..., None, :]) @ vectors.swapaxes(-1, -2), wide


def floored(covariance: FloatArray) -> FloatArray:
    """The covariances (..., 2, 2) after the floor of the small eigenvalue; the identity
    where there is no variance.
    """
    values, vectors, _ = _floored(covariance)
    return np.asarray((vectors * values[..., None, :]) @ vectors.swapaxes(-1, -2))


def _floored(covariance: FloatArray, least: FloatArray | float = 0.0) -> tuple[FloatArray, FloatArray, BoolArray]:
    values, vectors = symmetric_eigen(covariance)
    high = values[..., 1]
    wide = np.asarray(high >= np.maximum(least, SMALLEST)) & np.isfinite(high)
    return np.where(wide[..., None], np.maximum(values, FLOOR * high[..., None]), 1.0), vectors, wide


def _box(
    kept: BoolArray, group: IntArray, cell: FloatArray, b: int, grids: int
) -> tuple[FloatArray, FloatArray]:
    first, last = np.full((b * grids, 2), np.inf), np.full((b * grids, 2), -np.inf)
    np.minimum.at(first, group[kept], cell[kept])
    np.maximum.at(last, group[kept], cell[kept])
    some = np.isfinite(first)
    return np.where(some, first, 0.0), np.where(some, last - np.where(some, first, 0.0) + 1.0, 0.0)


def _indexable(
    kept: BoolArray, group: IntArray, cell: FloatArray, b: int, grids: int
) -> tuple[BoolArray, BoolArray]:
    """The kept cells without those of clouds whose bounding box is too large for a
    table, and these clouds.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        _, shape = _box(kept, group, cell, b, grids)
        area = shape[:, 0] * shape[:, 1]
        # Beyond 2⁵³ neighbouring cells have no numbers of their own.
        far = np.zeros(b * grids)
        np.maximum.at(far, group[kept], np.abs(cell[kept]).max(axis=1))
        lost = np.asarray((~(area <= LARGEST_TABLE) | ~(far < 2.0**52)).reshape(b, grids).any(axis=1))
    return np.asarray(kept & ~lost[group // grids]), lost


def _table(
    kept: BoolArray, group: IntArray, cell: FloatArray, number: IntArray, b: int, grids: int
) -> tuple[FloatArray, FloatArray, AnyArray]:
    first, shape = _box(kept, group, cell, b, grids)
    length = max(1, int((shape[:, 0] * shape[:, 1]).max()))
    table = np.full((b * grids, length), -1, dtype=np.int32)
    at = cell[kept] - first[group[kept]]
    table[group[kept], (at[:, 0] * shape[group[kept], 1] + at[:, 1]).astype(np.int64)] = number[kept]
    return first.reshape(b, grids, 2), shape.reshape(b, grids, 2), table.reshape(b, grids, length)


def check_size(value: object, name: str) -> float:
    """A cell size: a number from 1e-100 to 1e100, or a ValueError that names the
    option.
    """
    return validate.number(value, name, 1e-100, 1e100)
