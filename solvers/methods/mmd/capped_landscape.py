"""The capped nearest-neighbour objective over a grid of translations at a fixed rotation, and the translation-only
paths that descend it.

`(1/M) Σ_i min(min_j ‖x_i + t − y_j‖², τ²)`, M the number of source points, for a source already turned, `x_i = R p_i`.
The target points that can be nearest anywhere within a small square are found once; a query looks only at those.

The paths are gated ICP without its rotation. They move by the mean offset of the pairs within τ, which is a descent
step for the capped objective itself: with the set of pairs fixed, the mean offset is the best translation for their
sum, and pairing again, each point taking the smaller of its distance and τ, lowers the objective further. The surface
is not convex.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.brief import brief
from solvers.core.status import Status, statuses
from solvers.methods.mmd.landscape import Path, axis, course_of, one_cloud, translations

_BLOCK = 2**15


@dataclass(frozen=True, eq=False)
class CappedField:
    """The capped nearest-neighbour objective as a function of the translation.

    Make it by `capped_field`. The plane around the target is divided into squares. By
    the triangle inequality a candidate is no farther from a square's middle than the
    nearest target point is, plus the square's diagonal.

    Attributes
    ----------
    turned : ndarray of shape (m, 2)
        The source, turned beforehand, world units.
    target : ndarray of shape (n, 2)
        The cloud that stays.
    cap : float
        τ, world units.
    corner : ndarray of shape (2,)
        The lower left corner of the squares, world units.
    side : float
        The side of a square, world units.
    shape : tuple of int
        Columns and rows of squares.
    candidates : ndarray of int, shape (squares + 1, k)
        For each square, the target rows that can be nearest to a point in it and within
        the cap, padded with n. The last row is for all points outside the squares,
        which lie beyond the cap of every target point.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.landscape import capped_field
    >>> corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    >>> field = capped_field(corners, corners + 0.25, 1.0)
    >>> field.nearest(np.array([0.25, 9.0]), np.array([0.25, 9.0]))  # a point on a corner, one far away
    (array([0, 3]), array([0., 1.]))
    >>> field.values([0.25, 0.25]).round(6), field.grid([-0.5, 0.25, 1.0], [0.25]).argmin()
    (np.float64(0.0), np.int64(1))
    >>> field.path([0.0, 0.0]).points[-1].round(6)
    array([0.25, 0.25])
    """

    turned: FloatArray
    target: FloatArray
    cap: float
    corner: FloatArray
    side: float
    shape: tuple[int, int]
    candidates: IntArray

    __repr__ = brief

    def nearest(self, x: FloatArray, y: FloatArray) -> tuple[IntArray, FloatArray]:
        """The target row nearest to each point (x, y), and its capped squared distance.

        Parameters
        ----------
        x : ndarray of shape (k,)
            World units.
        y : ndarray of shape (k,)
            World units.

        Returns
        -------
        rows : ndarray of int, shape (k,)
            The lowest of equally near rows; n, the number of target points, where none
            lies within the cap.
        squares : ndarray of shape (k,)
            `min(min_j ‖x − y_j‖², τ²)`, u².
        """
        n = len(self.target)
        with np.errstate(over="ignore", invalid="ignore"):
            column, row = np.floor((x - self.corner[0]) / self.side), np.floor((y - self.corner[1]) / self.side)
            inside = (column >= 0.0) & (column < self.shape[0]) & (row >= 0.0) & (row < self.shape[1])
            cell = np.where(inside, row * self.shape[0] + column, len(self.candidates) - 1).astype(np.int64)
        best, nearest = np.full(len(x), np.square(self.cap)), np.full(len(x), n, dtype=np.int64)
        left = np.arange(len(x))
        qx, qy = np.append(self.target[:, 0], np.inf), np.append(self.target[:, 1], np.inf)
        for k in range(self.candidates.shape[1]):
            # Candidates come before padding: a point without further candidates is done.
            near = self.candidates[cell, k]
            further = np.flatnonzero(near < n)
            if 2 * further.size < near.size:
                left, cell, near, x, y = left[further], cell[further], near[further], x[further], y[further]
                if not left.size:
                    break
            dx, dy = x - qx[near], y - qy[near]
            dx *= dx
            dy *= dy
            dx += dy
            closer = np.flatnonzero((dx < best[left]) | ((dx == best[left]) & (nearest[left] == n) & (near < n)))
            best[left[closer]], nearest[left[closer]] = dx[closer], near[closer]
        return nearest, best

    def values(self, t: ArrayLike) -> FloatArray:
        """The objective at translations.

        Parameters
        ----------
        t : array_like of shape (..., 2)
            World units.

        Returns
        -------
        ndarray of shape (...)
            u².

        Raises
        ------
        ValueError
            If `t` is not finite or not of that shape.
        """
        moves = translations(t, "t")
        flat = moves.reshape(-1, 2)
        total = np.empty(len(flat))
        size = max(1, _BLOCK // len(self.turned))
        for i in range(0, len(flat), size):
            total[i : i + size] = self._pairs(flat[i : i + size])[1].mean(axis=1)
        return total.reshape(moves.shape[:-1])[()]

    def grid(self, xs: ArrayLike, ys: ArrayLike) -> FloatArray:
        """The objective at all (xs[i], ys[j]).

        For a map that builds up progressively, compute a few rows at a time.

        Parameters
        ----------
        xs : array_like of shape (c,)
            World units.
        ys : array_like of shape (r,)
            World units.

        Returns
        -------
        ndarray of shape (r, c)
            u². Rows are y.

        Raises
        ------
        ValueError
            If `xs` or `ys` is not a row, is empty or not finite.
        """
        x, y = axis(xs, "xs"), axis(ys, "ys")
        return self.values(np.stack(np.broadcast_arrays(x[None, :], y[:, None]), axis=-1))

    def path(self, start: ArrayLike, *, max_steps: int = 70, tolerance: float = 1e-6) -> Path:
        """Gated ICP in t from given starts.

        Each step is the mean offset of the pairs within τ. The capped objective never
        rises. A run is degenerate where no pair is within the cap.

        Parameters
        ----------
        start : array_like of shape (..., 2)
            Translations, world units.
        max_steps : int, default 70
            The most steps.
        tolerance : float, default 1e-6
            World units. A run converges when a step is at most so long.

        Returns
        -------
        Path
            The paths, one per start.

        Raises
        ------
        ValueError
            If `start` is not finite or not of that shape, or another argument is
            negative or not finite.
        """
        t = translations(start, "start")
        validate.count(max_steps, "max_steps")
        validate.number(tolerance, "tolerance", 0.0)
        shape, t = t.shape[:-1], t.reshape(-1, 2)
        n, s = len(self.target), len(t)
        status, steps = statuses((s,)), np.zeros(s, dtype=np.int64)
        rows, squares = self._pairs(t)
        value = squares.mean(axis=1)
        course, level = [t], [value]
        active = np.arange(s)
        while active.size and len(course) <= max_steps:
            used = rows < n
            reached = used.any(axis=1)
            status[active[~reached]] = Status.DEGENERATE
            active, used, rows = active[reached], used[reached], rows[reached]
            if not active.size:
                break
            offset = self.target[np.where(used, rows, 0)] - self.turned - t[active, None]
            move = np.where(used[..., None], offset, 0.0).sum(axis=1) / used.sum(axis=1)[:, None]
            t, value = t.copy(), value.copy()
            t[active] += move
            rows, squares = self._pairs(t[active])
            value[active] = squares.mean(axis=1)
            steps[active] += 1
            course.append(t)
            level.append(value)
            still = np.linalg.norm(move, axis=1) <= tolerance
            status[active[still]] = Status.CONVERGED
            active, rows = active[~still], rows[~still]
        return course_of(course, level, steps, status, shape)

    def _pairs(self, t: FloatArray) -> tuple[IntArray, FloatArray]:
        """Nearest rows and capped squares of the cloud at translations t (s, 2), (s, m) each."""
        moved = t[:, None] + self.turned
        rows, squares = self.nearest(moved[..., 0].ravel(), moved[..., 1].ravel())
        return rows.reshape(moved.shape[:-1]), squares.reshape(moved.shape[:-1])


def capped_field(turned: ArrayLike, target: ArrayLike, cap: float, *, squares: int = 2**13) -> CappedField:
    """The capped nearest-neighbour objective over the translations of a rotated source.

    Parameters
    ----------
    turned : array_like of shape (m, 2)
        The source, turned beforehand, in world units.
    target : array_like of shape (n, 2)
        The cloud that stays.
    cap : float
        τ, the distance beyond which a pair's cost stays constant, in world units.
    squares : int, default 8192
        The approximate number of squares. Fewer squares are faster to build but slow
        down each query; the values are the same.

    Returns
    -------
    CappedField
        The objective.

    Raises
    ------
    ValueError
        If `turned` or `target` is not a single cloud of planar points, if the cap is
        not from 1e-100 to 1e100, or if there is less than one square.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.landscape import capped_field
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> field = capped_field(scene.source, scene.target, 0.5)
    >>> field.grid([-1.0, 0.0, 1.0], [0.0, 0.5]).argmin()
    np.int64(1)
    >>> bool(np.linalg.norm(field.path([0.4, -0.3]).points[-1]) < 0.05)
    True
    """
    p, q = one_cloud(turned, "turned"), one_cloud(target, "target")
    tau = validate.number(cap, "cap", 1e-100, 1e100)
    most = validate.count(squares, "squares", 1)
    with np.errstate(over="ignore", under="ignore"):
        low, high = q.min(axis=0), q.max(axis=0)
        reach = min(tau, float((high - low).max()) + tau)
        wide = high - low + 2.0 * reach
        # Squares small enough to have few candidates each, but not too many squares.
        side = max(float(np.sqrt(wide[0] * wide[1] / most)), float(wide.max()) / most)
    columns, rows = (max(1, int(np.ceil(w / side))) for w in wide)
    corner = low - reach
    x, y = corner[0] + (np.arange(columns) + 0.5) * side, corner[1] + (np.arange(rows) + 0.5) * side
    middles = np.stack(np.broadcast_arrays(x[None, :], y[:, None]), axis=-1).reshape(-1, 2)
    half = 0.5 * np.sqrt(2.0) * side * (1.0 + 1e-9)
    blocks: list[IntArray] = []
    size = max(1, 2**18 // len(q))
    for i in range(0, len(middles), size):
        part = middles[i : i + size]
        d = np.sqrt(np.square(part[:, None, 0] - q[:, 0]) + np.square(part[:, None, 1] - q[:, 1]))
        able = (d <= d.min(axis=1, keepdims=True) + 2.0 * half) & (d <= tau + half)
        count = able.sum(axis=1)
        square, row = np.nonzero(able)
        block = np.full((len(part), max(1, int(count.max()))), len(q), dtype=np.int64)
        block[square, np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)] = row
        blocks.append(block)
    candidates = np.full((len(middles) + 1, max(x.shape[1] for x in blocks)), len(q), dtype=np.int64)
    first = 0
    for block in blocks:
        candidates[first : first + len(block), : block.shape[1]] = block
        first += len(block)
    return CappedField(p, q, tau, corner, side, (columns, rows), candidates)
