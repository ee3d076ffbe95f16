"""Exact nearest neighbours, one index per problem, built once and queried at every step;
gate and trim.

The nearest neighbour of a point p is the row j with the smallest
`d² = Σ_k (p_k − q_jk)²` as float64 computes it, coordinate by coordinate; among equal
ones, the lowest row. Both ways of finding it give exactly this row:

- matrix products, in blocks of at most `BLOCK` numbers: `‖q_j‖² − 2 p·q_j` from one
  product of the centred clouds, exact up to an error bound computed beside it; rows in
  which a second candidate lies within the bound are decided by the definition;
- natively, for a cloud of at least `TREE_FROM` points, a k-d tree (scipy's, if it is
  installed); neighbours whose distances agree to twelve digits are decided by the
  definition.

`Index.follow` queries a tree again only for points whose neighbour may have changed. A
point whose nearest place was d₁ away and the next one d₂ keeps it while it has moved less
than (d₂ − d₁)/2: no other place can be as near.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from solvers.core.brief import brief
from solvers.core.tree import distinct, once

BLOCK = 2**18
"""The most numbers that a temporary of the search holds (2 MB), unless a single row of distances is longer."""

TREE_FROM = 400
"""The number of target points from which a k-d tree is used. Measured with as many queries, for one problem, in 2-D and
3-D: at 150 points the products take 0.7 of the tree's time, at 300 the two are level, at 600 the tree takes 0.7 of the
products' time and at 2000 under 0.3."""

_EPS = float(np.finfo(np.float64).eps)
_TINY = 1e-160  # its square is 2000 times the smallest number above zero: more than squares lose by underflow
_CLOSE = 1e-12  # relative: distances that agree to this may be equal but for the tree's rounding
_SORTED = 2000  # from this many queries on, sorting them pays off
_MANY = 32  # beyond this many neighbours, sorting whole rows is not slower


@dataclass(frozen=True, eq=False)
class Known:
    """Points (b, m, d) as they were when their neighbours were last looked up, the rows (b,
    m) found, and how far (b, m) each may move before it must be looked up again. order (b,
    m) puts points that were near each other at the start next to each other.
    """

    points: FloatArray
    rows: IntArray
    slack: FloatArray
    order: IntArray

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class Index:
    """The target clouds (b, n, d) of b problems, prepared for queries. Made by `build`; it
    can be a constant field of a state. Only `points` and `extent` are used elsewhere.
    """

    points: FloatArray  # (b, n, d)
    centre: FloatArray  # (b, d)
    product: FloatArray  # (b, d + 1, n): −2 q̃ and ‖q̃‖² of the centred points
    radius: FloatArray  # (b,) the largest ‖q̃‖
    extent: FloatArray  # (b,) the largest coordinate as given
    trees: AnyArray | None  # (b,) of _Tree

    __repr__ = brief

    def nearest(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Row and squared distance, both (b, m), of the target point nearest to each of
        `points` (b, m, d).

        If a squared distance overflows it is infinite, and its row 0.
        """
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            if self.trees is None:
                rows = _by_products(self, points)
            else:
                rows = np.stack([t.rows_of(p, 1)[:, 0] for t, p in zip(self.trees, points, strict=True)])
            return self._measured(points, rows)

    def follow(self, points: FloatArray, known: Known | None) -> tuple[IntArray, FloatArray, Known | None]:
        """`nearest` for points (b, m, d) that move from call to call, and the `known` to pass
        to the next call. Pass None to the first; without trees it stays None.
        """
        if self.trees is None:
            return *self.nearest(points), None
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            if known is None:
                order = np.stack([_in_order(p) for p in points])
                known = Known(points, np.zeros(order.shape, dtype=np.int64), np.zeros(order.shape), order)
            # "Not below" rather than "at or above", so that NaN is looked up too.
            stale = ~(np.sqrt(_between(points, known.points)) < known.slack)
            at, rows, slack = np.where(stale[..., None], points, known.points), known.rows.copy(), known.slack.copy()
            for i, tree in enumerate(self.trees):
                queries = known.order[i, stale[i, known.order[i]]]
                nearest, slack[i, queries] = tree.nearest(points[i, queries], 1)
                rows[i, queries] = nearest[:, 0]
            return *self._measured(points, rows), Known(at, rows, slack, known.order)

    def _measured(self, points: FloatArray, rows: IntArray) -> tuple[IntArray, FloatArray]:
        squares = _between(points, picked(self.points, rows))
        overflowed = ~np.isfinite(squares)
        if overflowed.any():
            rows, squares = np.where(overflowed, 0, rows), np.where(overflowed, np.inf, squares)
        return rows, squares

    def nearest_k(self, points: FloatArray, k: int) -> tuple[IntArray, FloatArray]:
        """The k target points nearest to each of `points` (b, m, d), nearest first, the
        lowest row first among equal ones: rows and squared distances, both (b, m, k); k
        is at most n.
        """
        b, m, _ = points.shape
        n = self.points.shape[1]
        if not 1 <= k <= n:
            raise ValueError(f"k: expected 1 to {n} neighbours of {n} points, got {k}")
        rows = np.empty((b, m, k), dtype=np.int64)
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            for i in range(b):
                if self.trees is not None and k < _MANY:
                    rows[i] = self.trees[i].rows_of(points[i], k)
                    continue
                for part in _blocks(m, n):
                    rows[i, part] = _first_k(_squares(points[i, part], self.points[i]), k)
            neighbours = np.take_along_axis(self.points[:, None], rows[..., None], axis=2)
            return rows, _between(points[:, :, None], neighbours)


def build(points: FloatArray, *, tree_from: int | None = None) -> Index:
    """An index of the finite clouds (b, n, d). tree_from: the n from which a k-d tree is
    used if scipy is installed (None: `TREE_FROM`); it affects the time, never the answer.
    """
    return once(partial(_built, tree_from=tree_from), points)


def _built(points: FloatArray, tree_from: int | None) -> Index:
    q = np.ascontiguousarray(points, dtype=np.float64)
    b, n, d = q.shape
    with np.errstate(over="ignore", under="ignore"):
        centre = 0.5 * (q.min(axis=1) + q.max(axis=1))
        centred = q - centre[:, None, :]
        product = np.empty((b, d + 1, n))
        product[:, :d] = -2.0 * centred.swapaxes(1, 2)
        product[:, d] = np.einsum("bnd,bnd->bn", centred, centred)
    radius, extent = np.sqrt(product[:, d].max(axis=1)), np.abs(q).max(axis=(1, 2))
    make = _tree_maker() if n >= (TREE_FROM if tree_from is None else tree_from) else None
    trees = None
    if make is not None:
        trees = np.empty(b, dtype=object)
        for i in range(b):
            # One cloud with many starts may be a batch of equal clouds: one tree is enough.
            trees[i] = trees[i - 1] if i and np.array_equal(q[i], q[i - 1]) else _Tree.of(q[i], make)
    return Index(q, centre, product, radius, extent, trees)


def picked(values: AnyArray, rows: IntArray) -> AnyArray:
    """The values (b, n, …) of each problem at its rows (b, m): (b, m, …). One flat index
    takes an eighth of the time of two.
    """
    own = distinct(values)
    b, n = own.shape[:2]
    flat: AnyArray = own.reshape(b * n, *own.shape[2:])
    return np.asarray(flat.take(rows + n * np.arange(b)[:, None] if b > 1 else rows, axis=0))


def within(squares: FloatArray, gate: FloatArray | float) -> BoolArray:
    """Which pairs, by squared distance (b, m), are at most `gate` apart (world units, one
    number or (b,)); an infinite gate keeps every finite distance.
    """
    with np.errstate(over="ignore"):
        inside: BoolArray = (squares <= np.square(np.asarray(gate))[..., None]) & np.isfinite(squares)
    return inside


def smallest(squares: FloatArray, count: IntArray | int, among: BoolArray | None = None) -> BoolArray:
    """Which of the pairs `among`, (b, m), are the `count` (b,) nearest: the first among
    equal ones, and all if there are too few.
    """
    values = squares if among is None else np.where(among, squares, np.inf)
    order = np.argsort(values, axis=-1, kind="stable")
    mask = np.zeros(squares.shape, dtype=np.bool_)
    np.put_along_axis(mask, order, np.arange(squares.shape[-1]) < np.asarray(count)[..., None], axis=-1)
    return mask if among is None else mask & among


def trimmed(squares: FloatArray, trim: float, among: BoolArray) -> BoolArray:
    """The pairs `among` (b, m) without the farthest fraction `trim`: ⌊trim · count⌋ of
    them are dropped.
    """
    if trim <= 0.0:
        return among
    count = among.sum(axis=-1)
    # A fraction such as 0.3 of 10 is meant to be 3, though the product may fall just
    # below.
    return smallest(squares, count - np.floor(trim * count * (1.0 + 4.0 * _EPS)).astype(np.int64), among)


def _by_products(index: Index, points: FloatArray) -> IntArray:
    b, m, d = points.shape
    n = index.points.shape[1]
    left = np.ones((b, m, d + 1))
    np.subtract(points, index.centre[:, None, :], out=left[..., :d])
    # The score's error: rounding of its products and sums, and of the centred
    # coordinates.
    reach = np.sqrt(np.einsum("bmd,bmd->bm", left[..., :d], left[..., :d])) + index.radius[:, None]
    coarse = np.maximum(np.abs(points).max(axis=-1), index.extent[:, None])
    bound = 8.0 * (d + 2) * _EPS * reach * (reach + coarse) + _TINY**2
    rows = np.empty((b, m), dtype=np.int64)
    together = max(1, BLOCK // (m * n))
    parts = list(_blocks(m, n)) if together == 1 else [slice(0, m)]
    # One pair of buffers for all blocks: fresh memory costs more than the computation
    # in it.
    most = min(together, b) * max(part.stop - part.start for part in parts) * n
    scores, flags = np.empty(most), np.empty(most, dtype=np.bool_)
    for first in range(0, b, together):
        group = slice(first, min(first + together, b))
        for part in parts:
            shape = (group.stop - first, part.stop - part.start, n)
            size = shape[0] * shape[1] * n
            score = np.matmul(left[group, part], index.product[group], out=scores[:size].reshape(shape))
            best = score.argmin(axis=-1)
            limit = np.take_along_axis(score, best[..., None], axis=-1) + bound[group, part, None]
            near = np.less_equal(score, limit, out=flags[:size].reshape(shape))
            # A row without any has a NaN among its scores; the definition decides there,
            # too.
            if np.count_nonzero(near) != best.size:
                unsure = near.sum(axis=-1) != 1
                for i in np.flatnonzero(unsure.any(axis=1)):
                    queries = points[first + i, part][unsure[i]]
                    best[i, unsure[i]] = _squares(queries, index.points[first + i]).argmin(axis=-1)
            rows[group, part] = best
    return rows


@dataclass(frozen=True, eq=False)
class _Tree:
    """A k-d tree of the distinct places of one cloud: a thousand points at one place
    would cost a thousand visits.
    """

    tree: Any
    points: FloatArray  # (n, d) the cloud
    order: IntArray  # (n,) its rows, place by place, ascending at each
    start: IntArray  # (places + 1,) where a place begins in `order`

    @classmethod
    def of(cls, points: FloatArray, make: Any) -> _Tree:
        order = np.lexsort(points.T[::-1]).astype(np.int64)
        ordered = points[order]
        new = np.ones(len(points), dtype=np.bool_)
        new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
        start = np.append(np.flatnonzero(new), len(points)).astype(np.int64)
        return cls(make(ordered[new]), points, order, start)

    def rows_at(self, k: int) -> IntArray:
        """The k lowest rows at each place, (places, ≤ k), −1 where it has fewer."""
        count = np.diff(self.start)
        column = np.arange(min(k, int(count.max())))
        present = column < count[:, None]
        return np.where(present, self.order[np.where(present, self.start[:-1, None] + column, 0)], -1)

    def rows_of(self, queries: FloatArray, k: int) -> IntArray:
        """The rows of the k nearest points, (m, k), for queries in any order."""
        along = _in_order(queries)
        rows = np.empty((len(queries), k), dtype=np.int64)
        rows[along] = self.nearest(queries[along], k)[0]
        return rows

    def nearest(self, queries: FloatArray, k: int) -> tuple[IntArray, FloatArray]:
        """The rows of the k nearest points, (m, k), by the definition, and how far each query
        may move, (m,), before they can change, 0 where that is not known.
        """
        m, rows_at = len(queries), self.rows_at(k)
        places = len(rows_at)
        rows, slack = np.empty((m, k), dtype=np.int64), np.zeros(m)
        left, count = np.arange(m), k + 1
        while left.size and count <= min(places, 2 * _MANY):
            # The k nearest rows are at the k nearest places, or at places as near as
            # the k-th.
            distances, near = self.tree.query(queries[left], count)
            settled = distances[:, k - 1] * (1.0 + _CLOSE) + _TINY < distances[:, -1]
            finished, candidates = left[settled], rows_at[near[settled, :-1]]
            if k == 1 and count == 2:
                rows[finished] = candidates[:, 0, :1]
                # Reduced, so that the two stay apart by more than rounding, wherever the query goes.
                first, second = distances[settled].T
                slack[finished] = 0.5 * (second - first) - _CLOSE * second - 4.0 * _TINY
            else:
                candidates = candidates.reshape(len(finished), (count - 1) * rows_at.shape[1])
                squares = _between(queries[finished, None], self.points[candidates])
                order = np.lexsort((candidates, np.where(candidates < 0, np.inf, squares)), axis=-1)[:, :k]
                rows[finished] = np.take_along_axis(candidates, order, axis=-1)
            left, count = left[~settled], 2 * count
        able = np.sort(rows_at[rows_at >= 0]) if left.size else left
        for part in _blocks(left.size, max(1, able.size)):
            rows[left[part]] = able[_first_k(_squares(queries[left[part]], self.points[able]), k)]
        return rows, slack


def _in_order(points: FloatArray) -> IntArray:
    """An order of the points (m, d) in which to query a tree: successive points that lie
    near each other find its nodes still in the cache. For few points any order will do.
    """
    return _by_cells(points) if len(points) >= _SORTED else np.arange(len(points))


def _by_cells(points: FloatArray) -> IntArray:
    """An order of the points (m, d) that groups them by the cells of a coarse grid."""
    low, high = points.min(axis=0), points.max(axis=0)
    d = points.shape[1]
    side = max(2, int(2.0 ** (15 // d)))
    position = (points - low) * (side / np.where(high > low, high - low, 1.0))
    cells = np.minimum(np.nan_to_num(position), side - 1.0).astype(np.int64)
    key = np.zeros(len(points), dtype=np.uint16)
    for k in range(min(d, 15)):
        key = (key * side + cells[:, k]).astype(np.uint16)
    return np.argsort(key, kind="stable")


def _first_k(squares: FloatArray, k: int) -> IntArray:
    """The columns of the k smallest in each row (m, n), smallest first, the lowest column
    first among equal ones.
    """
    if k > _MANY:
        columns: IntArray = np.argsort(squares, axis=-1, kind="stable")[:, :k]
        return columns
    left = np.minimum(squares, np.finfo(np.float64).max)
    rows = np.empty((len(squares), k), dtype=np.int64)
    for j in range(k):
        rows[:, j] = left.argmin(axis=-1)
        np.put_along_axis(left, rows[:, j : j + 1], np.inf, axis=-1)
    return rows


def _squares(points: FloatArray, target: FloatArray) -> FloatArray:
    """Squared distances (m, n) between all of (m, d) and (n, d), by the definition."""
    return _between(points[:, None, :], target[None, :, :])


def _between(p: FloatArray, q: FloatArray) -> FloatArray:
    """Σ_k (p_k − q_k)², summed in the order of the coordinates, so that the rounding does
    not depend on the shapes.
    """
    total = p[..., 0] - q[..., 0]
    total *= total
    for k in range(1, p.shape[-1]):
        step = p[..., k] - q[..., k]
        step *= step
        total += step
    return total


def _blocks(m: int, n: int) -> Iterator[slice]:
    """Slices of m rows that keep rows × n within the block size."""
    size = max(1, BLOCK // n)
    return (slice(i, min(i + size, m)) for i in range(0, m, size))


def _tree_maker() -> Any:
    """scipy's k-d tree, or None if scipy is not installed."""
    try:
        from scipy.spatial import cKDTree  # type: ignore[import-untyped]
    except ImportError:
        return None
    # Splits in the middle of the longest side: on surfaces, queries take half the time
    # that splits at the median do. Compact nodes cost little, and save a sixth of it there.
    return partial(cKDTree, balanced_tree=False, compact_nodes=True)
