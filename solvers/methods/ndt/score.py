"""The NDT score of a pose with its gradient and Hessian in closed form, and the score
of many translations at once.

Over all pairs k of a moved point and the cell it is in, on every grid, with
`q_k = x − μ_k` and `P_k = Σ_k⁻¹`,

    s_k = exp(−½ q_kᵀ P_k q_k),   f = −Σ s_k,
    ∂_a f = Σ s_k q_kᵀ P_k ∂_a q_k,
    ∂_a ∂_b f = Σ s_k [ −(q_kᵀ P_k ∂_a q_k)(q_kᵀ P_k ∂_b q_k) + ∂_b q_kᵀ P_k ∂_a q_k + q_kᵀ P_k ∂_a ∂_b q_k ].

The unknowns are (tx, ty, φ), a turn by φ about a pivot c followed by a shift: with the lever ℓ = x − c,
`∂_φ x = (−ℓ_y, ℓ_x)` and `∂_φ² x = −ℓ`. With the pivot at a pose's t, the derivatives are by the pose's own translation
and angle.

The derivatives hold for fixed cells: where a point changes cells, f jumps. The score has no determinant factors, so it
is not a likelihood, and a sharp cell counts no more than a blurred one.

Sources: Biber & Straßer 2003, The normal distributions transform: a new approach to laser scan matching; Magnusson
2009, The three-dimensional normal-distributions transform, ch. 6. The latter's uniform part for outliers is used if a
share of them is given: `s_k = −d₁ exp(−½ d₂ q_kᵀ P_k q_k)` (`ndt.mixture`). By default it is left out.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from solvers.core.arrays import FloatArray, IntArray
from solvers.core.brief import brief
from solvers.core.numbers import numbers
from solvers.core.tree import distinct
from solvers.methods.ndt.mixture import check_share, constants
from solvers.methods.ndt.ndt_map import NdtMap

BLOCK = 2**18
"""The most point-cell pairs that a score map evaluates at once."""

TOGETHER = 8000
"""The most points times grids that `evaluate` takes at once. An atlas of NDT runs takes 0.8 of the time that it takes
without this limit.
"""


@dataclass(frozen=True, eq=False)
class Score:
    """The score of b poses.

    Attributes
    ----------
    score : ndarray of shape (b,)
        Σ s_k = −f.
    gradient : ndarray of shape (b, 3)
        Of f, by (tx, ty, φ); zero if not requested.
    hessian : ndarray of shape (b, 3, 3)
        Of f; zero if not requested.
    cells : ndarray of int, shape (b, G, m)
        The index of each point's cell on each grid, −1 for none.
    values : ndarray of shape (b, G, m)
        s_k, 0 for none.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import build
    >>> from solvers.ndt_score import evaluate
    >>> cells = build(np.array([[[0.1, 0.1], [0.5, 0.2], [0.9, 0.4]]]), 1.0)
    >>> score = evaluate(cells, cells.mean, np.zeros((1, 2)))
    >>> score.values.round(6).tolist()
    [[[1.0]]]
    """

    score: FloatArray
    gradient: FloatArray
    hessian: FloatArray
    cells: IntArray
    values: FloatArray

    __repr__ = brief


def evaluate(
    cells: NdtMap,
    moved: FloatArray,
    pivot: FloatArray,
    which: IntArray | None = None,
    derivatives: bool = True,
    outliers: float | None = None,
) -> Score:
    """The score of moved points, with its derivatives about a pivot.

    Parameters
    ----------
    cells : NdtMap
        The map, as from `solvers.ndt_map.build`.
    moved : ndarray of shape (k, m, 2)
        k point sets, already moved by their poses, world units.
    pivot : ndarray of shape (k, 2)
        c, the centre of the turn φ.
    which : ndarray of int, shape (k,), optional
        Which cloud's map each point set is scored on. None: one set per cloud, in
        order.
    derivatives : bool, default True
        Whether to compute the gradient and the Hessian.
    outliers : float, optional
        The share of the uniform part, above 0 and below 1. None leaves it out.

    Returns
    -------
    Score
        Of the k sets.

    Raises
    ------
    ValueError
        If `moved`, `pivot` or `which` has another shape, or `outliers` is not a share
        between 0 and 1.

    References
    ----------
    .. [1] P. Biber, W. Straßer, "The normal distributions transform: a new approach to
       laser scan matching", 2003.
    .. [2] M. Magnusson, "The three-dimensional normal-distributions transform",
       doctoral thesis, Örebro University, 2009, ch. 6, eq. 6.8 (the uniform part).

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import build
    >>> from solvers.ndt_score import evaluate
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> cells = build(scene.target[None], 0.8)
    >>> score = evaluate(cells, scene.source[None], np.zeros((1, 2)))
    >>> score.score.round(2), score.hessian.shape
    (array([46.82]), (1, 3, 3))
    """
    check_share(outliers)
    moved, pivot = numbers(moved, "moved"), numbers(pivot, "pivot")
    if moved.ndim != 3 or moved.shape[2] != 2 or not moved.size:
        raise ValueError(f"moved: expected shape (k, m, 2), got {moved.shape}")
    b, m = moved.shape[:2]
    if pivot.shape != (b, 2):
        raise ValueError(f"pivot: expected shape ({b}, 2), got {pivot.shape}")
    which = np.arange(b) if which is None else np.asarray(which)
    if which.shape != (b,):
        raise ValueError(f"which: expected shape ({b},), got {which.shape}")
    size = max(1, TOGETHER // (m * cells.table.shape[1]))
    if b <= size:
        return _evaluate(cells, moved, pivot, which, derivatives, outliers)
    blocks = [slice(i, i + size) for i in range(0, b, size)]
    parts = [_evaluate(cells, moved[s], pivot[s], which[s], derivatives, outliers) for s in blocks]
    return Score(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Score)})


def _evaluate(
    cells: NdtMap, moved: FloatArray, pivot: FloatArray, which: IntArray, derivatives: bool, outliers: float | None
) -> Score:
    b = len(moved)
    rows = cells.lookup(moved, which)
    mean, P = distinct(cells.mean), distinct(cells.precision)
    clouds, most = mean.shape[:2]
    at = np.maximum(rows, 0) + (which % clouds * most)[:, None, None]
    mean, P = mean.reshape(-1, 2), P.reshape(-1, 4)
    gradient, hessian = np.zeros((b, 3)), np.zeros((b, 3, 3))
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        x, y = moved[:, None, :, 0], moved[:, None, :, 1]
        p00, p01, p11 = P[:, 0][at], P[:, 1][at], P[:, 3][at]
        gain, sharpness = constants(outliers)
        if outliers is not None:
            p00, p01, p11 = sharpness * p00, sharpness * p01, sharpness * p11
        q0, q1 = x - mean[:, 0][at], y - mean[:, 1][at]
        u0, u1 = p00 * q0 + p01 * q1, p01 * q0 + p11 * q1
        values = np.where(rows >= 0, np.exp(-0.5 * np.where(rows >= 0, q0 * u0 + q1 * u1, 0.0)), 0.0)
        if outliers is not None:
            values *= gain
        score = values.reshape(b, -1).sum(axis=1)
        if derivatives:
            # A point in no cell may lie anywhere, even where products overflow.
            s, hit = values, rows >= 0
            lx, ly = (np.where(hit, v - pivot[:, None, k, None], 0.0) for k, v in ((0, x), (1, y)))
            u0, u1 = np.where(hit, u0, 0.0), np.where(hit, u1, 0.0)
            # P a, with a = (−ℓ_y, ℓ_x) = ∂_φ x
            a0, a1 = p01 * lx - p00 * ly, p11 * lx - p01 * ly
            uphi = u1 * lx - u0 * ly
            su0, su1, suphi = s * u0, s * u1, s * uphi

            def total(v: FloatArray) -> FloatArray:
                return np.asarray(v.reshape(b, -1).sum(axis=1))

            gradient = np.stack([total(su0), total(su1), total(suphi)], axis=1)
            hessian[:, 0, 0] = total(s * p00 - su0 * u0)
            hessian[:, 0, 1] = hessian[:, 1, 0] = total(s * p01 - su0 * u1)
            hessian[:, 1, 1] = total(s * p11 - su1 * u1)
            hessian[:, 0, 2] = hessian[:, 2, 0] = total(s * a0 - su0 * uphi)
            hessian[:, 1, 2] = hessian[:, 2, 1] = total(s * a1 - su1 * uphi)
            hessian[:, 2, 2] = total(s * (lx * a1 - ly * a0 - u0 * lx - u1 * ly) - suphi * uphi)
    return Score(score, gradient, hessian, rows, values)


def score_map(
    cells: NdtMap, points: FloatArray, x: FloatArray, y: FloatArray, outliers: float | None = None
) -> FloatArray:
    """The score of points turned beforehand, moved by every (x_i, y_j).

    A point's column of cells depends on x alone and its row on y alone, and
    neighbouring translations share them: a cell is looked up once for each run of
    columns and of rows of a point, and only pairs that meet a kept cell are evaluated.
    Rows are independent, so a caller may request a few at a time, or a coarse lattice
    first.

    Parameters
    ----------
    cells : NdtMap
        The map of one cloud.
    points : ndarray of shape (m, 2)
        World units.
    x : ndarray of shape (c,)
        World units.
    y : ndarray of shape (r,)
        World units.
    outliers : float, optional
        As for `evaluate`.

    Returns
    -------
    ndarray of shape (r, c)
        Rows are y.

    Raises
    ------
    ValueError
        If the map is of more than one cloud, `points` is of another shape, `x` or `y`
        not a row of numbers, or `outliers` not a share between 0 and 1.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import build
    >>> from solvers.ndt_score import score_map
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> cells = build(scene.target[None], 0.8)
    >>> x, y = np.array([0.0, 0.5]), np.array([0.0, 0.1])
    >>> score_map(cells, scene.source, x, y).round(1)
    array([[46.8, 29.9],
           [12.6,  1.8]])
    """
    if len(cells.size) != 1:
        raise ValueError(f"cells: expected the map of one cloud, got {len(cells.size)}")
    check_share(outliers)
    points = numbers(points, "points")
    if points.ndim != 2 or points.shape[1] != 2 or not points.size:
        raise ValueError(f"points: expected shape (m, 2), got {points.shape}")
    x, y = numbers(x, "x"), numbers(y, "y")
    for name, row in (("x", x), ("y", y)):
        if row.ndim != 1 or not row.size:
            raise ValueError(f"{name}: expected a row of at least one number, got shape {row.shape}")
    m, nx, ny = len(points), len(x), len(y)
    gain, sharpness = constants(outliers)
    h, mean, P = cells.size[0], cells.mean[0], cells.precision[0] * sharpness
    # With P = LLᵀ, qᵀPq = ‖Lᵀq‖²: two products per pair instead of four.
    l00 = np.sqrt(P[:, 0, 0])
    l10 = P[:, 0, 1] / np.where(l00 > 0.0, l00, 1.0)
    l11 = np.sqrt(np.maximum(P[:, 1, 1] - np.square(l10), 0.0))
    root = np.sqrt(0.5)
    a, c, e = root * l00, root * l10, root * l11
    px, py = points[:, :1] + x, points[:, 1:] + y
    out = np.zeros((ny, nx))
    together = max(1, BLOCK // (m * nx))
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        for g in range(cells.table.shape[1]):
            wide, high = (int(v) for v in cells.shape[0, g])
            origin, first = cells.origin[0, g], cells.first[0, g]
            columns = _runs(np.floor((px - origin[0]) / h) - first[0], wide)
            begin = np.searchsorted(columns.point, np.arange(m + 1))
            for top in range(0, ny, together):
                band = slice(top, top + together)
                rows = _runs(np.floor((py[:, band] - origin[1]) / h) - first[1], high)
                # Every run of rows meets the same point's runs of columns.
                counts = np.diff(begin)[rows.point]
                k = np.repeat(np.arange(len(counts)), counts)
                q = _counted(counts, begin[rows.point])
                cell = cells.table[0, g, columns.cell[q] * high + rows.cell[k]]
                hit = np.flatnonzero(cell >= 0)
                k, q, cell = k[hit], q[hit], cell[hit]
                # One entry per row of a run: compute here all that does not depend on the column.
                j = _counted(rows.length[k], rows.first[k])
                k, q, cell = (np.repeat(v, rows.length[k]) for v in (k, q, cell))
                point, width = rows.point[k], columns.length[q]
                q1 = py[point, top + j] - mean[cell, 1]
                index = _counted(width, point * nx + columns.first[q])
                q0 = px.ravel()[index] - np.repeat(mean[cell, 0], width)
                along = np.repeat(a[cell], width) * q0 + np.repeat(c[cell] * q1, width)
                s = np.exp(-(np.square(along) + np.repeat(np.square(e[cell] * q1), width)))
                bins = index + np.repeat((j - point) * nx, width)
                count = len(out[band]) * nx
                out[band] += np.bincount(bins, weights=s, minlength=count).reshape(-1, nx)
    return out * gain


@dataclass(frozen=True, eq=False)
class _Runs:
    """Runs of neighbouring translations along one axis that leave a point in the same column, or row, of cells: the
    point, the first translation, the number of translations, and the index of the column or row.
    """

    point: IntArray
    first: IntArray
    length: IntArray
    cell: IntArray


def _runs(values: FloatArray, count: int) -> _Runs:
    """The runs of equal numbers from 0 to count − 1 in each row of (m, n)."""
    new = np.ones(values.shape, dtype=np.bool_)
    np.not_equal(values[:, 1:], values[:, :-1], out=new[:, 1:])
    at = np.flatnonzero(new)
    length, cell = np.diff(np.append(at, values.size)), values.ravel()[at]
    inside = (cell >= 0.0) & (cell < count)
    point, first = np.divmod(at[inside], values.shape[1])
    return _Runs(point, first, length[inside], cell[inside].astype(np.int64))


def _counted(counts: IntArray, first: IntArray) -> IntArray:
    """Consecutive numbers, `counts` of them from each `first`, concatenated."""
    return np.arange(counts.sum()) + np.repeat(first + counts - np.cumsum(counts), counts)
