"""The score of distribution-to-distribution NDT: cells on both sides, each source cell
against every target cell.

A source cell has mean m_i and covariance S_i, a target cell μ_j and Σ_j. At a pose with
rotation R,

    q_ij = T m_i − μ_j,   C_ij = R S_i Rᵀ + Σ_j,   s_ij = exp(−½ q_ijᵀ C_ij⁻¹ q_ij),   f = −Σ s_ij.

The turn moves the means and turns the covariances. With J the quarter turn, ℓ the lever
of the moved mean about the pivot, `a = J ℓ`, `A = R S Rᵀ`, `A' = J A − A J`,
`A'' = J A' − A' J`, `u = C⁻¹ q` and `w = a − A' u`, the halves of the derivatives of
`e = qᵀ C⁻¹ q` are

    ½ e_t = u,             ½ e_φ = uᵀ a − ½ uᵀ A' u,
    ½ e_tt = C⁻¹,          ½ e_tφ = C⁻¹ w,             ½ e_φφ = wᵀ C⁻¹ w − uᵀ ℓ − ½ uᵀ A'' u,

and `∂_a f = Σ s ½e_a`, `∂_a ∂_b f = Σ s (½e_ab − ½e_a ½e_b)`. No cell is looked up, so f is smooth, without jumps.
Pairs whose term must lie below 1e-16, by the bound `e ≥ ‖q‖² / (tr S + tr Σ)`, are left out.

The source's cells are cut in its own coordinates, on one grid. Where both clouds are cut alike, the cells of one wall
match in many ways along it. Terms are weighted neither by point counts nor by the number of cells.

Source: Stoyanov, Magnusson, Andreasson & Lilienthal 2012, Fast and accurate scan registration through minimization of
the distance between compact 3D NDT representations (the objective). Its two scaling constants, d₁ and d₂ of
`ndt.mixture`, are used if a share of outliers is given: `s_ij = −d₁ exp(−½ d₂ q_ijᵀ C_ij⁻¹ q_ij)`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray, IntArray
from solvers.core.pose import Pose
from solvers.methods.ndt.floor import floored
from solvers.methods.ndt.mixture import constants
from solvers.methods.ndt.ndt_map import NdtMap
from solvers.methods.ndt.score import Score

NEGLIGIBLE = 74.0
"""An exponent e beyond this makes a term below 1e-16."""


def evaluate(
    source: NdtMap,
    target: NdtMap,
    pose: Pose,
    pivot: FloatArray,
    which: IntArray | None = None,
    width: int | None = None,
    outliers: float | None = None,
) -> Score:
    """The score of the poses (k,) with its derivatives about the pivots (k, 2); which: (k,) the clouds they belong to
    (None: each its own). In the result, `values` (k, 1, C) holds the sum of each source cell's terms and `cells` (k,
    1, C) the index of the target cell of its largest term, −1 where it has none. width: C, at least the source's own
    number of cells, which None takes. outliers: the share of the uniform part; None leaves it out.
    """
    gain, sharpness = constants(outliers)
    k = len(pose)
    which = np.arange(k) if which is None else which
    width = source.mean.shape[1] if width is None else width
    S, Q = floored(source.covariance)[which], floored(target.covariance)[which]
    mu = target.mean[which]
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        x, y = _means(pose, source.mean[which])
        close = _close(x, y, S, Q, mu, pose, sharpness)
        close &= source.kept[which][:, :, None] & target.kept[which][:, None, :]
        b, i, j = np.nonzero(close)
        x, y = x[b, i], y[b, i]
        alpha, beta, gamma = (part[b, i] for part in _turned(pose, S))
        q, lever = (x - mu[b, j, 0], y - mu[b, j, 1]), (x - pivot[b, 0], y - pivot[b, 1])
        e = _exponents(q, lever, (alpha, beta, gamma), Q[b, j])
        terms = gain * np.exp(-0.5 * sharpness * e.value)
        first, second = e.first, e.second
        if outliers is not None:  # every derivative of the exponent carries this factor
            first = tuple(sharpness * half for half in first)
            second = {axes: sharpness * half for axes, half in second.items()}

        def total(v: FloatArray) -> FloatArray:
            # For empty input, bincount returns integers.
            return np.asarray(np.bincount(b, weights=terms * v, minlength=k), dtype=np.float64)

        gradient = np.stack([total(half) for half in first], axis=1)
        hessian = np.empty((k, 3, 3))
        for (m, n), half in second.items():
            hessian[:, m, n] = hessian[:, n, m] = total(half - first[m] * first[n])
    values = np.zeros((k, 1, width))
    values[:, 0] = np.bincount(b * width + i, weights=terms, minlength=k * width).reshape(k, width)
    best = np.full((k, 1, width), -1, dtype=np.int64)
    best[:, 0, : close.shape[1]] = _best(close, terms)
    return Score(total(np.ones_like(terms)), gradient, hessian, best, values)


def _means(pose: Pose, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The coordinates x and y, (k, C) each, of the means (k, C, 2) moved by the poses (k,)."""
    R, s, t = pose.R, np.asarray(pose.scale), pose.t
    # Coordinate by coordinate, so that rounding is the same as for a single problem.
    rotated = [R[:, c, 0, None] * mean[..., 0] + R[:, c, 1, None] * mean[..., 1] for c in (0, 1)]
    return s[:, None] * rotated[0] + t[:, 0, None], s[:, None] * rotated[1] + t[:, 1, None]


def _close(
    x: FloatArray, y: FloatArray, S: FloatArray, Q: FloatArray, mu: FloatArray, pose: Pose, sharpness: float
) -> BoolArray:
    """Which pairs of source cells, at (x, y), (k, C) each, and target cells may have a term that counts, (k, C, D)."""
    near = np.square(x[:, :, None] - mu[:, None, :, 0]) + np.square(y[:, :, None] - mu[:, None, :, 1])
    reach = np.square(np.asarray(pose.scale))[:, None] * (S[..., 0, 0] + S[..., 1, 1])
    wide = reach[:, :, None] + (Q[..., 0, 0] + Q[..., 1, 1])[:, None, :]
    return np.asarray(near <= NEGLIGIBLE / sharpness * wide)


def _turned(pose: Pose, S: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A = s² R S Rᵀ = [[α, β], [β, γ]] of every source cell's covariance (k, C, 2, 2): α, β and γ, (k, C) each."""
    c00, c01, c11 = S[..., 0, 0], S[..., 0, 1], S[..., 1, 1]
    r00, r01, r10, r11 = (pose.R[:, m, n, None] for m in (0, 1) for n in (0, 1))
    ss = np.square(np.asarray(pose.scale))[:, None]
    alpha = ss * (r00 * (r00 * c00 + r01 * c01) + r01 * (r00 * c01 + r01 * c11))
    beta = ss * (r10 * (r00 * c00 + r01 * c01) + r11 * (r00 * c01 + r01 * c11))
    gamma = ss * (r10 * (r10 * c00 + r11 * c01) + r11 * (r10 * c01 + r11 * c11))
    return alpha, beta, gamma


@dataclass(frozen=True, eq=False)
class _Exponents:
    """The exponents e of pairs of cells, (p,), with the halves of their derivatives, (p,) each: `first` by x, y and φ,
    `second` by two of these, keyed by their indices (m, n), m ≤ n.
    """

    value: FloatArray
    first: tuple[FloatArray, ...]
    second: dict[tuple[int, int], FloatArray]


def _exponents(
    q: tuple[FloatArray, FloatArray],
    lever: tuple[FloatArray, FloatArray],
    covariance: tuple[FloatArray, FloatArray, FloatArray],
    Q: FloatArray,
) -> _Exponents:
    """The formulas above for pairs of cells (p,). q: from the target's mean to the moved one; lever: from the pivot to
    the moved one; covariance: α, β and γ of the source's, turned; Q: (p, 2, 2) the target's.
    """
    (q0, q1), (lx, ly), (alpha, beta, gamma) = q, lever, covariance
    d00, d01, d11 = alpha + Q[:, 0, 0], beta + Q[:, 0, 1], gamma + Q[:, 1, 1]
    # Divide by the trace first: the determinant of a huge covariance overflows float64.
    trace = d00 + d11
    d00, d01, d11 = d00 / trace, d01 / trace, d11 / trace
    det = (d00 * d11 - np.square(d01)) * trace
    p00, p01, p11 = d11 / det, -d01 / det, d00 / det
    u0, u1 = p00 * q0 + p01 * q1, p01 * q0 + p11 * q1
    # A' = [[−2β, α − γ], [α − γ, 2β]], A'' = [[−2δ, −4β], [−4β, 2δ]], δ = α − γ
    delta = alpha - gamma
    w0, w1 = -ly + 2.0 * beta * u0 - delta * u1, lx - delta * u0 - 2.0 * beta * u1
    v0, v1 = p00 * w0 + p01 * w1, p01 * w0 + p11 * w1
    uphi = u1 * lx - u0 * ly - (beta * (np.square(u1) - np.square(u0)) + delta * u0 * u1)
    bend = delta * (np.square(u1) - np.square(u0)) - 4.0 * beta * u0 * u1
    phi2 = w0 * v0 + w1 * v1 - (u0 * lx + u1 * ly) - bend
    second = {(0, 0): p00, (1, 1): p11, (0, 1): p01, (0, 2): v0, (1, 2): v1, (2, 2): phi2}
    return _Exponents(q0 * u0 + q1 * u1, (u0, u1, uphi), second)


def _best(close: BoolArray, terms: FloatArray) -> IntArray:
    """The target cell of each source cell's largest term, −1 where it has none, (k, C). terms: of the pairs in
    `close`.
    """
    most = np.zeros(close.shape)
    most[close] = terms
    return np.where(close.any(axis=2), most.argmax(axis=2), -1)
