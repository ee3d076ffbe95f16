"""Weighted moments of pairs, from which the closed-form fits start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray
from solvers.core.extent import ROUNDING

_FAR = 2.0**400
_LEAST = -1000  # the least exponent: 2¹⁰⁰⁰ is still finite


@dataclass(frozen=True, eq=False)
class Moments:
    """Moments of the pairs (..., n, d) with weights (..., n). Clouds and weights are divided
    by powers of two, which rounds nothing, so that no square overflows or underflows; H,
    the spreads and the tolerance are those of the divided clouds.
    """

    exponents: tuple[AnyArray, AnyArray, AnyArray]  # of source, target, weights, each (...)
    mean_p: FloatArray  # (..., d), divided
    mean_q: FloatArray
    p: FloatArray  # (..., n, d), divided and centred
    q: FloatArray
    w: FloatArray  # (..., n), divided
    H: FloatArray  # (..., d, d)
    square_p: FloatArray  # (...) Σ w ‖p̃‖²
    still_p: BoolArray  # (...) the points of positive weight are equal up to rounding
    still_q: BoolArray
    weightless: BoolArray  # (...) no weight is positive
    tolerance: FloatArray  # (...) singular values of H up to this are rounding


def checked(
    source: ArrayLike, target: ArrayLike, weights: ArrayLike | None, dim: int | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The clouds and weights broadcast to one batch shape; raises ValueError if any is not valid."""
    p, q = validate.matched(source, target)
    if dim is not None and p.shape[-1] != dim:
        raise ValueError(f"source: expected {dim} coordinates a point, got {p.shape[-1]}")
    w = validate.weights(weights, p.shape[-2])
    batch = validate.batch_shape(source=p.shape[:-2], target=q.shape[:-2], weights=w.shape[:-1])
    p, q = (np.broadcast_to(x, (*batch, *x.shape[-2:])) for x in (p, q))
    return p, q, np.broadcast_to(w, (*batch, w.shape[-1]))


def moments(p: FloatArray, q: FloatArray, w: FloatArray) -> Moments:
    """The moments of clouds (..., n, d) and weights (..., n) of one batch shape, which are
    not checked here.
    """
    weighted = w > 0.0
    most = w.max(axis=-1)
    ew, factor = _power(most)
    w = w * factor[..., None]
    clouds = np.empty((2, *p.shape))  # np.stack keeps a shared cloud's strides, and its sums then round differently
    clouds[0], clouds[1] = p, q
    clouds, exponents, big = _divided(clouds, weighted)
    total = w.sum(axis=-1)
    safe = np.where(total > 0.0, total, 1.0)
    means = ((w / safe[..., None])[..., None, :] @ clouds)[..., 0, :]
    clouds = _by_column(np.subtract, clouds, means[..., None, :])
    p, q = clouds
    H = _by_column(np.multiply, p, w[..., None]).swapaxes(-1, -2) @ q
    squares = np.einsum("...n,...nd,...nd->...", w, clouds, clouds)

    # Coordinates carry rounding of half a unit in the last place of the largest, so a
    # spread below a few of these counts as none; the same rounding, relative to the
    # spread, is what H cannot resolve.
    spread, blur = np.sqrt(squares / safe), ROUNDING * big
    still = spread <= blur
    blurred = blur / np.where(still, 1.0, spread)
    tolerance = (blurred[0] + blurred[1]) * np.sqrt(squares[0] * squares[1])
    return Moments(
        (exponents[0], exponents[1], ew), means[0], means[1], p, q, w, H, squares[0], still[0], still[1],
        most == 0.0, tolerance,
    )  # fmt: skip


def _divided(x: FloatArray, weighted: BoolArray) -> tuple[FloatArray, AnyArray, FloatArray]:
    """The points (..., n, d) divided by a power of two, its exponent (...), and the largest
    coordinate of points with weight, divided too.
    """
    size = np.abs(x[..., 0])
    for k in range(1, x.shape[-1]):
        size = np.maximum(size, np.abs(x[..., k]))
    big = np.where(weighted, size, 0.0).max(axis=-1)
    # A point without weight must not count, however far away it lies: a near one is
    # cancelled by its zero weight, a far one might overflow first and is set to zero.
    if not (size.max(axis=-1) <= _FAR * big).all():
        x = np.where(weighted[..., None], x, 0.0)
    exponent, factor = _power(big)
    return x * factor[..., None, None], exponent, big * factor


def _power(big: FloatArray) -> tuple[AnyArray, FloatArray]:
    """The exponent e of the power of two above `big`, and 2⁻ᵉ."""
    exponent = np.maximum(np.frexp(big)[1], _LEAST)
    return exponent, np.ldexp(1.0, -exponent)


def _by_column(ufunc: np.ufunc, x: FloatArray, y: FloatArray) -> FloatArray:
    """`ufunc(x, y)`, coordinate by coordinate: in one call numpy's inner loop would run
    over d numbers only.
    """
    out: FloatArray = np.empty(np.broadcast_shapes(x.shape, y.shape))
    for k in range(out.shape[-1]):
        ufunc(x[..., k], y[..., min(k, y.shape[-1] - 1)], out=out[..., k])
    return out


def why(m: Moments, i: tuple[int, ...]) -> str:
    """Why problem i of the batch does not determine its rotation, in words."""
    d = m.p.shape[-1]
    if m.weightless[i]:
        return "all weights are zero"
    for name, still, x in (("source", m.still_p[i], m.p[i]), ("target", m.still_q[i], m.q[i])):
        # The mean of many equal points is rounded, so they may lie apart from it, though not from each other.
        if still or np.ptp(x[m.w[i] > 0.0], axis=0).max() <= ROUNDING:
            return f"all {name} points with weight are equal: the rotation is undefined"
    if d > 2:
        for name, x in (("source", m.p[i]), ("target", m.q[i])):
            spans = np.linalg.svd(np.sqrt(m.w[i])[:, None] * x, compute_uv=False)
            rank = int(np.count_nonzero(spans > 1e-7 * spans[0]))
            if rank == 1:
                return f"the {name} points are collinear: the rotation about their line is free"
            if rank < d - 1:
                return f"the {name} points span {rank} of {d} dimensions: rotations across them are free"
        return "the pairs fit several rotations equally well: the rotation is undefined"
    return "both sums of the planar fit are zero: the angle is undefined"
