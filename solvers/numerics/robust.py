"""Robust weights: how much a pair counts, by its distance r against a threshold in the
same unit.

Iteratively reweighted least squares with the weight `w(r) = ρ'(r) / r` minimises
`Σ ρ(r)` for fixed pairs:

    huber    w = 1 (r ≤ k), k/r beyond            ρ = r²/2, k r − k²/2 beyond: bounded influence, unbounded loss
    tukey    w = (1 − (r/k)²)² (r ≤ k), 0 beyond  ρ = k²/6 (1 − (1 − (r/k)²)³), k²/6 beyond: bounded loss
    welsch   w = exp(−r² / 2k²)                   ρ = k² (1 − exp(−r² / 2k²)): bounded loss
    geman-mcclure   w = 1 / (1 + (r/k)²)²         ρ = r²/2 / (1 + (r/k)²): bounded loss

The threshold is `k = tuning · s`, with s the scale of the distances that are noise.
Distances and threshold are in one unit, never squared on one side only:
`w(λ r; λ k) = w(r; k)`. The tuning constants give 95 % efficiency on Gaussian residuals
*with a known sign*; pair distances are not that, and the scale s from their median is a
heuristic.

Sources: Huber 1964, Robust estimation of a location parameter; Beaton & Tukey 1974, The
fitting of power series; Holland & Welsch 1977, Robust regression using iteratively
reweighted least-squares (constants 1.345, 4.685, 2.985; Welsch's `exp(−(r/c)²)` is the
one above with `k = c s/√2`); Geman & McClure 1985, Bayesian image analysis.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray
from solvers.numerics.fits import rms_radius

KERNELS = ("none", "huber", "tukey", "welsch", "geman-mcclure")
TUNING: Mapping[str, float] = MappingProxyType(
    {"none": np.inf, "huber": 1.345, "tukey": 4.685, "welsch": 2.985 / np.sqrt(2.0), "geman-mcclure": 3.787}
)
"""The usual constants, for a threshold of `TUNING[kernel] · s`: each is 95 % efficient on Gaussian residuals."""

FLOOR = 3e-4
"""The smallest scale taken from data, as a fraction of the target's RMS radius: perfect pairs do not make all others
worthless. 0.001 u in the rooms here, whose radius is some 3.4 u."""
_LEAST = 1e-100


def least_scale(target: FloatArray) -> FloatArray:
    """`FLOOR` times the RMS radius of target clouds (b, n, d), (b,): a length of the
    scene itself, so that another unit changes no weight. Equal points count as having a
    radius of 1.
    """
    return FLOOR * rms_radius(target)


def mad_scale(
    distances: FloatArray, among: BoolArray | None = None, floor: FloatArray | float = _LEAST
) -> FloatArray:
    """`s = max(1.4826 · median(r), floor)` of the pair distances (b, m) that are
    `among`, (b,).

    The median absolute deviation about zero, where a perfect pair lies. About the
    median itself the scale would be smaller at a far start, and a redescending weight
    would reject some pairs there. Without any pair it is `floor`, one length or (b,):
    `least_scale` of the targets, for the scale to follow their unit.
    """
    m = distances.shape[-1]
    if among is None:
        among = np.ones(distances.shape, dtype=np.bool_)
    ordered = np.sort(np.where(among, distances, np.inf), axis=-1)
    count = among.sum(axis=-1)
    low, high = np.maximum(count - 1, 0) // 2, np.minimum(count // 2, m - 1)
    middle = [np.take_along_axis(ordered, k[..., None], axis=-1)[..., 0] for k in (low, high)]
    median = np.where(count > 0, 0.5 * middle[0] + 0.5 * middle[1], 0.0)
    return np.maximum(1.4826 * median, floor)


def weights(kernel: str, distances: FloatArray, threshold: FloatArray | float) -> FloatArray:
    """The weight w(r; k) in [0, 1] of pair distances r (..., m), with thresholds k
    (...) or one; 'none' is all one.

    A distance of zero has weight 1, an infinite one weight 0 (unless the kernel is
    'none'). A threshold is positive.
    """
    if kernel == "none":
        return np.ones_like(distances)
    x, _ = _ratio(distances, threshold)
    with np.errstate(under="ignore", over="ignore"):
        if kernel == "huber":
            return 1.0 / np.maximum(x, 1.0)
        if kernel == "tukey":
            return np.square(1.0 - np.square(np.minimum(x, 1.0)))
        if kernel == "geman-mcclure":
            return 1.0 / np.square(1.0 + np.square(x))
        return np.exp(-0.5 * np.square(x))


def loss(kernel: str, distances: FloatArray, threshold: FloatArray | float) -> FloatArray:
    """The loss ρ(r; k) of pair distances r (..., m), whose derivative is `w(r; k) r`;
    'none' is r²/2.
    """
    with np.errstate(under="ignore", over="ignore", invalid="ignore"):
        if kernel == "none":
            return 0.5 * np.square(distances)
        x, k = _ratio(distances, threshold)
        if kernel == "huber":
            inner = np.minimum(x, 1.0)
            return np.square(k) * (0.5 * np.square(inner) + (x - inner))
        if kernel == "tukey":
            return np.square(k) / 6.0 * (1.0 - (1.0 - np.square(np.minimum(x, 1.0))) ** 3)
        if kernel == "geman-mcclure":
            return 0.5 * np.square(k) * (1.0 - 1.0 / (1.0 + np.square(x)))
        return -np.square(k) * np.expm1(-0.5 * np.square(x))


def threshold(
    kernel: str,
    distances: FloatArray,
    among: BoolArray | None = None,
    tuning: float | None = None,
    scale: FloatArray | float | None = None,
    floor: FloatArray | float = _LEAST,
) -> FloatArray:
    """`k = tuning · s`, (b,), for distances (b, m): s is `scale`, one or (b,), where
    given, else `mad_scale` of the pairs `among`, at least `floor`. Infinite for 'none'.
    """
    if kernel == "none":
        return np.full(distances.shape[:-1], np.inf)
    c = TUNING[kernel] if tuning is None else tuning
    s = mad_scale(distances, among, floor) if scale is None else np.broadcast_to(scale, distances.shape[:-1])
    return c * s


def check_options(weight: str, tuning: float | None, scale: float | None) -> None:
    """Refuse, by a ValueError that names the option, what is not a kernel, tuning constant
    or scale.
    """
    validate.one_of(weight, KERNELS, "weight")
    for name, value in (("tuning", tuning), ("scale", scale)):
        if value is not None:
            validate.number(value, name, 1e-100, 1e100)


def _ratio(distances: FloatArray, threshold: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    k = np.asarray(threshold, dtype=np.float64)[..., None]
    with np.errstate(over="ignore", under="ignore"):
        return distances / k, k
