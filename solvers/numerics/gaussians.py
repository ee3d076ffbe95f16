"""Sums of Gaussian kernels between two clouds, in blocks: the basis of every soft method.

With `K_ij = exp(−‖a_i − b_j‖² / 2σ²)` for rows a_i and columns b_j,

- `sums` gives for each row `Σ_j K_ij v_j`, whatever the columns' values v_j (`powers`:
  1, b_j, b_j b_jᵀ for moments);
- `shares` divides each row by its sum plus a constant c and adds up the columns: the
  expectation step of a mixture with components b_j and observations a_i,
  `P_ij = K_ij / (Σ_k K_ik + c)`.

Exponents are cut off at −500: numbers below 1e-217 are negligible beside those of near
points, and those below 1e-308, which floats hold with fewer digits, slow to compute
with. No temporary holds more than `BLOCK` numbers, or one row if that is longer; the
whole matrix never exists. Distances are sums of squared differences, not
`‖a‖² + ‖b‖² − 2 a·b`, whose error grows with the square of the clouds' extent over σ:
so the blocks affect the answers only through the order of the sums.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import FloatArray

BLOCK = 2**15
"""The most numbers in a temporary (256 kB, which stays in a processor's cache), unless one row is longer."""

_TINY = float(np.finfo(np.float64).tiny)
_FAR = 500.0  # where negative exponents are cut off; exp(−500) is 7e-218
_LOW = 1e-190  # a row's sum below it may consist of cut-off terms, and is recomputed relative to its largest term


@dataclass(frozen=True, eq=False)
class Shares:
    """The sums of `P_ij = K_ij / (Σ_k K_ik + c)`, rows a_i (n of them), columns b_j (m
    of them).

    row (b, n): Σ_j P_ij, at most 1. moments (b, 1 + d, m): Σ_i P_ij and Σ_i P_ij a_i.
    scatter (b,): Σ_ij P_ij ‖a_i − b_j‖². log_sum (b,): Σ_i log(Σ_k K_ik + c).
    """

    row: FloatArray
    moments: FloatArray
    scatter: FloatArray
    log_sum: FloatArray


def blocks(b: int, rows: int, columns: int, limit: int | None = None) -> Iterator[tuple[slice, slice]]:
    """Slices of problems and rows to process together, so that problems × rows × columns
    stays within `limit` (default `BLOCK`): several whole problems, or some rows of one, at
    least one row.
    """
    most = BLOCK if limit is None else limit
    together = max(1, most // (rows * columns))
    size = rows if together > 1 else max(1, min(rows, most // columns))
    for first in range(0, b, together):
        for row in range(0, rows, size):
            yield slice(first, min(first + together, b)), slice(row, min(row + size, rows))


class _Kernel:
    """The kernel between rows (b, r, d) and columns (b, c, d), block by block in two
    buffers that it keeps.

    Differences come from matrix products, `[a, 1] · [1, −b]`, in which only the difference
    itself is rounded, since the products are exact; this is quicker than broadcasting.
    """

    def __init__(self, rows: FloatArray, columns: FloatArray, sigma: FloatArray, limit: int | None = None) -> None:
        b, r, d = rows.shape
        c = columns.shape[1]
        self.left, self.right = np.ones((b, d, r, 2)), np.ones((b, d, 2, c))
        self.left[..., 0] = rows.swapaxes(1, 2)
        np.negative(columns.swapaxes(1, 2), out=self.right[:, :, 1])
        # The square of a width below 1e-154 underflows: this keeps the factor finite, and
        # the weight of a distance of 0 at 1.
        self.factor = (-0.5 / np.maximum(np.square(sigma), _TINY))[:, None, None]
        self.blocks = list(blocks(b, r, c, limit))
        group, part = self.blocks[0]
        shape = (min(b, group.stop), min(r, part.stop), c)
        self.buffers = tuple(np.empty(shape) for _ in range(2))

    def block(self, group: slice, part: slice) -> tuple[FloatArray, FloatArray]:
        """Squared distances and kernel of a block, both (g, r, c); the next call
        overwrites them.
        """
        left, right = self.left[group, :, part], self.right[group]
        squares, kernel = (x[: left.shape[0], : left.shape[2]] for x in self.buffers)
        np.matmul(left[:, 0], right[:, 0], out=squares)
        np.multiply(squares, squares, out=squares)
        for k in range(1, left.shape[1]):
            np.matmul(left[:, k], right[:, k], out=kernel)
            np.multiply(kernel, kernel, out=kernel)
            np.add(squares, kernel, out=squares)
        np.multiply(squares, self.factor[group], out=kernel)
        if kernel.min() < -_FAR:  # the check costs less than half of a needless cut-off
            np.maximum(kernel, -_FAR, out=kernel)
        np.exp(kernel, out=kernel)
        return squares, kernel


def powers(points: FloatArray, order: int = 1) -> FloatArray:
    """The values 1 and b_j of the points (b, n, d): (b, n, 1 + d); with order 2 also
    b_j b_jᵀ, row by row: (b, n, 1 + d + d²).
    """
    b, n, d = points.shape
    out = np.ones((b, n, 1 + d + (d * d if order == 2 else 0)))
    out[..., 1 : d + 1] = points
    if order == 2:
        out[..., d + 1 :] = (points[..., :, None] * points[..., None, :]).reshape(b, n, d * d)
    return out


def sums(rows: FloatArray, columns: FloatArray, sigma: FloatArray, values: FloatArray) -> FloatArray:
    """`Σ_j K_ij v_j`, (b, m, v), of the values (b, n, v) at the columns (b, n, d), seen
    from the rows (b, m, d), with widths sigma (b,) > 0.

    A row that no column reaches has a sum of about 1e-217, never zero: see the module's
    docstring.
    """
    out = np.empty((*rows.shape[:2], values.shape[2]))
    with np.errstate(over="ignore", under="ignore"):
        kernel = _Kernel(rows, columns, sigma)
        for group, part in kernel.blocks:
            np.matmul(kernel.block(group, part)[1], values[group], out=out[group, part])
    return out


def shares(rows: FloatArray, columns: FloatArray, sigma: FloatArray, c: FloatArray, limit: int | None = None) -> Shares:
    """The sums of the normalised kernel, for rows (b, n, d), columns (b, m, d), widths
    sigma (b,) > 0, constants c (b,) ≥ 0. With c = 0 every row has the sum 1, however
    far away it lies. limit: the size of a temporary (default `BLOCK`).
    """
    b, n, d = rows.shape
    m = columns.shape[1]
    ones, zero = np.ones(m), np.zeros((1, 1))
    row, log_sum, scatter = np.empty((b, n)), np.zeros(b), np.zeros(b)
    moments = np.zeros((b, 1 + d, m))
    values = np.ones((b, 1 + d, n))
    values[:, 1:] = rows.swapaxes(1, 2)
    with np.errstate(over="ignore", under="ignore"):
        kernel = _Kernel(rows, columns, sigma, limit)
        for group, part in kernel.blocks:
            D, K = kernel.block(group, part)
            total = K @ ones
            constant, shift = c[group, None], zero
            if total.min() < _LOW:
                constant, shift = _rescue(D, K, total, constant, kernel.factor[group])
            whole = total + constant
            share = 1.0 / whole
            row[group, part] = total * share
            log_sum[group] += (np.log(whole) + shift).sum(axis=-1)
            scatter[group] += np.vecdot(np.vecdot(D, K), share)
            moments[group] += (values[group, :, part] * share[:, None]) @ K
    return Shares(row, moments, scatter, log_sum)


def share_matrix(rows: FloatArray, columns: FloatArray, sigma: float, c: float) -> FloatArray:
    """The whole matrix P (n, m) whose sums `shares` gives, for one problem: rows (n, d),
    columns (m, d).
    """
    with np.errstate(over="ignore", under="ignore", divide="ignore"):
        steps = rows[:, None, :] - columns[None, :, :]
        exponents = np.maximum(np.einsum("nmd,nmd->nm", steps, steps) * (-0.5 / sigma**2), -1e300)
        constant = np.log(np.float64(c))
        top = np.maximum(exponents.max(axis=1), constant)
        K = np.exp(exponents - top[:, None])
        P: FloatArray = K / (K.sum(axis=1) + np.exp(constant - top))[:, None]
    return P


def _rescue(
    D: FloatArray, K: FloatArray, total: FloatArray, constant: FloatArray, factor: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Recompute rows (g, r) that are too far away for their sum to be accurate, relative to
    their largest term, a kernel's or c. Kernel and sum are changed in place; c on the same
    scale (g, r) and that term's logarithm, 0 for other rows, are returned.
    """
    low = (total < _LOW) & (constant < _LOW)
    # Beyond float64 all distances are equally far.
    exponents = np.maximum(np.where(low[..., None], D * factor, 0.0), -1e300)
    with np.errstate(divide="ignore"):
        logarithm = np.log(constant)
    shift = np.where(low, np.maximum(exponents.max(axis=-1), logarithm), 0.0)
    K[low] = np.exp(np.maximum(exponents - shift[..., None], -_FAR))[low]
    total[low] = K[low].sum(axis=-1)
    return np.where(low, np.exp(logarithm - shift), constant), shift
