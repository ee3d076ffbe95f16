"""Lists of the pairs within a kernel's reach.

The association methods weigh pairs by `ψ_ij = exp(−‖T p_i − q_j‖² / 2σ²)`, and by zero
beyond `reach · σ`: most pairs of two clouds are out of reach and are never listed. The
pairs of all problems are in one list, row by row, so that a pass over them is one numpy
call whatever the batch.

A listed pair takes up to 68 bytes while it is weighed, and at a large σ all pairs are listed:
two clouds of more than 14 million pairs, 0.95 GB, are rejected. A batch takes that much for
each of its problems.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, FloatArray
from solvers.core.method import Problem

MOST = 14_000_000
"""The most pairs, m n, that a problem may have."""

_TINY = float(np.finfo(np.float64).tiny)


@dataclass(frozen=True, eq=False)
class Candidates:
    """The e pairs within reach, of all b problems, ascending by source point, then by
    target point.

    row: (e,) source point, counted through all problems (i + m · problem); column: (e,)
    target point, likewise; both of the machine's index type. squares: (e,) their
    squared distance, world units². starts: (rows + 1,) where each row's pairs begin.
    rows, columns: how many there are, b·m and b·n.
    """

    row: AnyArray
    column: AnyArray
    squares: FloatArray
    starts: AnyArray
    rows: int
    columns: int

    def along(self, values: AnyArray) -> AnyArray:
        """The value (rows,) of each pair's row, (e,): a repeat, which is quicker than a gather."""
        return np.repeat(values, np.diff(self.starts))

    def row_sums(self, values: FloatArray) -> FloatArray:
        """Σ of the values (e,) of each row, (rows,)."""
        total = np.zeros(self.rows)
        has_pairs = self.starts[1:] > self.starts[:-1]
        if has_pairs.any():
            total[has_pairs] = np.add.reduceat(values, self.starts[:-1][has_pairs])
        return total

    def column_sums(self, values: FloatArray) -> FloatArray:
        """Σ of the values (e,) of each column, (columns,)."""
        return np.asarray(np.bincount(self.column, weights=values, minlength=self.columns), dtype=np.float64)


def listed(row: AnyArray, column: AnyArray, squares: FloatArray, rows: int, columns: int) -> Candidates:
    """Candidates from pairs in ascending order of `row`."""
    row, column = row.astype(np.intp, copy=False), column.astype(np.intp, copy=False)
    return Candidates(row, column, squares, _starts(np.bincount(row, minlength=rows)), rows, columns)


def _starts(counts: AnyArray) -> AnyArray:
    """Where each row's pairs begin and the last row's end, from the number of pairs in each row."""
    starts = np.zeros(len(counts) + 1, dtype=np.intp)
    np.cumsum(counts, out=starts[1:])
    return starts


def within_reach(moved: FloatArray, target: FloatArray, reach: FloatArray) -> Candidates:
    """All pairs of `moved` (b, m, d) and `target` (b, n, d) at most `reach` (b,) apart.

    They are screened first, by matrix products or, in the plane and for a short reach,
    by cells; the answer is the same either way.
    """
    b, m, d = moved.shape
    n = target.shape[1]
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        grid = _Cells.of(target, reach) if d == 2 else None
        counts, column = _by_products(moved, target, reach) if grid is None else grid.pairs(moved)
        squares, starts = np.zeros(len(column)), _starts(counts)
        for p, q in zip(moved.reshape(-1, d).T, target.reshape(-1, d).T, strict=True):
            gap = np.repeat(p, counts)
            gap -= np.ascontiguousarray(q).take(column)
            gap *= gap
            squares += gap
        near = np.flatnonzero(squares <= np.repeat(np.square(reach), counts.reshape(b, m).sum(axis=1)))
    row = np.repeat(np.arange(b * m), counts)
    if near.size < row.size:
        row, column, squares = row.take(near), column.take(near), squares.take(near)
        starts = np.searchsorted(near, starts)
    if grid is not None:
        order = np.argsort(row.astype(np.int64) * (b * n) + column, kind="stable")
        row, column, squares = row.take(order), column.take(order), squares.take(order)
    return Candidates(row, column, squares, starts, b * m, b * n)


def _by_products(moved: FloatArray, target: FloatArray, reach: FloatArray) -> tuple[AnyArray, AnyArray]:
    """The pairs within reach, and a few beyond that rounding leaves in doubt: the number in
    each row, and their columns.
    """
    b, m, d = moved.shape
    n = target.shape[1]
    centre = target.mean(axis=1, keepdims=True)
    left, right = np.empty((b, m, d + 1)), np.empty((b, d + 1, n))
    left[..., :d], left[..., d] = moved - centre, 1.0
    right[:, :d] = (target - centre).swapaxes(1, 2)
    own = np.einsum("bmd,bmd->bm", left[..., :d], left[..., :d])
    right[:, d] = np.einsum("bdn,bdn->bn", right[:, :d], right[:, :d])
    right[:, :d] *= -2.0
    bound = np.square(reach)[:, None] - own + 1e-13 * (own + right[:, d].max(axis=1)[:, None]) + 1e-300
    # Problem by problem, so that the screen stays in the processor's cache.
    screen, mask, hits = np.empty((m, n)), np.empty((m, n), dtype=np.bool_), []
    for k in range(b):
        np.matmul(left[k], right[k], out=screen)
        np.less_equal(screen, bound[k, :, None], out=mask)
        hits.append(np.flatnonzero(mask.ravel()) + k * (m * n))
    flat = np.concatenate(hits)
    counts = np.diff(np.searchsorted(flat, n * np.arange(b * m + 1)))
    return counts, flat - np.repeat(n * (np.arange(b * m) - np.arange(b * m) // m), counts)


@dataclass(frozen=True, eq=False)
class _Cells:
    """The target points of each problem, sorted into square cells as wide as its reach,
    with a rim of empty ones.
    """

    low: FloatArray  # (b, 2) where a problem's cells begin
    side: FloatArray  # (b,)
    shape: AnyArray  # (b, 2) cells across and up, without the rim
    first: AnyArray  # (b,) a problem's first cell in the list of all
    starts: AnyArray  # (cells + 1,) where a cell's points begin in `order`
    order: AnyArray  # (b n,) the target points, cell by cell

    @classmethod
    def of(cls, target: FloatArray, reach: FloatArray) -> _Cells | None:
        """The cells of the target points; None if nine would be a large part of them all, or
        if there would be far more of them than points.
        """
        n = target.shape[1]
        low, wide = target.min(axis=1), np.ptp(target, axis=1)
        side = reach * (1.0 + 1e-9)
        across = np.floor(wide / side[:, None]) + 1.0
        count = across.prod(axis=1)
        if not (count <= 16.0 * n + 64.0).all() or (9.0 / count).mean() > 0.25:
            return None
        shape = across.astype(np.intp)
        size = (shape + 2).prod(axis=1)
        first = np.cumsum(size) - size
        cell = np.floor((target - low[:, None]) / side[:, None, None]).astype(np.intp) + 1
        key = (first[:, None] + cell[..., 1] * (shape[:, None, 0] + 2) + cell[..., 0]).ravel()
        order = np.argsort(key, kind="stable")
        starts = np.searchsorted(key[order], np.arange(int(size.sum()) + 1))
        return cls(low, side, shape, first, starts, order)

    def pairs(self, moved: FloatArray) -> tuple[AnyArray, AnyArray]:
        """Each moved point with the target points of the nine cells around it: the number of
        pairs in each row, and their columns.
        """
        top = self.shape[:, None].astype(np.float64) + 1.0
        at = np.floor((moved - self.low[:, None]) / self.side[:, None, None]) + 1.0
        outside = ((at < 0.0) | (at > top)).any(axis=-1)
        cell = np.clip(at, 0.0, top).astype(np.intp)
        left, right = np.maximum(cell[..., 0] - 1, 0), np.minimum(cell[..., 0] + 1, self.shape[:, None, 0] + 1)
        begin, end = (np.empty((*outside.shape, 3), dtype=np.intp) for _ in range(2))
        for k in range(3):
            up = np.clip(cell[..., 1] + (k - 1), 0, self.shape[:, None, 1] + 1)
            line = self.first[:, None] + up * (self.shape[:, None, 0] + 2)
            begin[..., k], end[..., k] = self.starts[line + left], self.starts[line + right + 1]
            # On the rim the line above or below is the same one again, and counts once.
            end[..., k] = np.where(outside | (up != cell[..., 1] + (k - 1)), begin[..., k], end[..., k])
        count = (end - begin).ravel()
        index = np.repeat(begin.ravel() - (np.cumsum(count) - count), count) + np.arange(int(count.sum()))
        return count.reshape(-1, 3).sum(axis=1), self.order.take(index)


def scores(pairs: Candidates, m: int, sigma: FloatArray) -> FloatArray:
    """ψ of the listed pairs, (e,); m source points per problem, sigma (b,)."""
    with np.errstate(over="ignore", under="ignore"):
        # The square of a width below 1e-154 underflows: this keeps the factor finite, and
        # the weight of a distance of 0 at 1.
        factor = np.repeat(-0.5 / np.maximum(np.square(sigma), _TINY), m)
        psi: FloatArray = np.exp(pairs.squares * pairs.along(factor))
    return psi


def few_enough(problem: Problem, method: str) -> None:
    """Raise a ValueError that names the larger cloud if there are more than `MOST` pairs."""
    m, n = problem.source.shape[1], problem.target.shape[1]
    validate.few(m, n, m * n <= MOST, f"{method} takes at most {MOST:,} pairs of them", int(MOST**0.5))
