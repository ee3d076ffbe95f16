"""Robust weights: how much a pair counts, given its distance r and a threshold in the
same unit.

Iteratively reweighted least squares with the weight `w(r) = ρ'(r) / r` minimises
`Σ ρ(r)` for fixed pairs:

    huber    w = 1 (r ≤ k), k/r beyond            ρ = r²/2, k r − k²/2 beyond: bounded influence, unbounded loss
    tukey    w = (1 − (r/k)²)² (r ≤ k), 0 beyond  ρ = k²/6 (1 − (1 − (r/k)²)³), k²/6 beyond: bounded loss
    welsch   w = exp(−r² / 2k²)                   ρ = k² (1 − exp(−r² / 2k²)): bounded loss
    geman-mcclure   w = 1 / (1 + (r/k)²)²         ρ = r²/2 / (1 + (r/k)²): bounded loss

The threshold is `k = tuning · s`, with s the scale of the distances due to noise.
Distances and threshold are in one unit, never squared on one side only:
`w(λ r; λ k) = w(r; k)`. The tuning constants give 95 % efficiency on Gaussian residuals
*with a known sign*; pair distances have none, and the scale s from their median is a
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
from solvers.core.kinds import shown
from solvers.core.numbers import numbers
from solvers.numerics.fits import typical_radius

KERNELS = ("none", "huber", "tukey", "welsch", "geman-mcclure")
TUNING: Mapping[str, float] = MappingProxyType(
    {"none": np.inf, "huber": 1.345, "tukey": 4.685, "welsch": 2.985 / np.sqrt(2.0), "geman-mcclure": 3.787}
)
"""The usual constants, for a threshold of `TUNING[kernel] · s`: each is 95 % efficient on Gaussian residuals."""

FLOOR = 3e-4
"""The smallest scale taken from data, as a fraction of the target's RMS radius, so that perfect pairs do not make all
others worthless: 0.001 u in the rooms here, whose radius is some 3.4 u."""
_LEAST = 1e-100


def least_scale(target: FloatArray) -> FloatArray:
    """`FLOOR` times the RMS radius of target clouds.

    It is a length of the scene itself, so that the weights do not depend on the unit.
    The radius ignores points more than 20 times as far out as the median point.

    Parameters
    ----------
    target : ndarray of shape (b, n, d)
        The clouds, in world units.

    Returns
    -------
    ndarray of shape (b,)
        World units. Equal points count as having a radius of 1.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.robust import least_scale
    >>> least_scale(np.array([[[20.0, 0.0], [-20.0, 0.0]]])).round(6)
    array([0.006])
    """
    return FLOOR * typical_radius(target)


def mad_scale(
    distances: FloatArray, among: BoolArray | None = None, floor: FloatArray | float = _LEAST
) -> FloatArray:
    """The scale of the distances due to noise: `s = max(1.4826 · median(r), floor)`.

    The median absolute deviation about zero, where a perfect pair lies. About the
    median itself the scale would be smaller at a far start, and a redescending weight
    would reject some pairs there.

    Parameters
    ----------
    distances : ndarray of shape (b, m)
        Pair distances r, in world units.
    among : ndarray of bool, shape (b, m), optional
        The pairs that count. None is all.
    floor : float or ndarray of shape (b,), default 1e-100
        The least scale, and the scale if no pair counts. `least_scale` of the targets
        makes it follow their unit.

    Returns
    -------
    ndarray of shape (b,)
        World units.

    Raises
    ------
    ValueError
        If `distances` is not an array of numbers, one per pair.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.robust import mad_scale
    >>> mad_scale(np.array([[0.1, 0.1, 0.2, 9.0]])).round(4)
    array([0.2224])
    """
    distances = _rows(distances)
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
    """The weights w(r; k) of pair distances.

    A distance of zero has weight 1, an infinite one weight 0, except that "none" gives
    every pair weight 1.

    Parameters
    ----------
    kernel : str
        A name in `KERNELS`.
    distances : ndarray of shape (..., m)
        Pair distances r, in world units.
    threshold : float or ndarray of shape (...)
        k, positive, in the same unit.

    Returns
    -------
    ndarray of shape (..., m)
        In [0, 1].

    Raises
    ------
    ValueError
        If there is no such kernel, or a threshold is not positive and finite.

    References
    ----------
    .. [1] P. W. Holland, R. E. Welsch, "Robust regression using iteratively reweighted
       least-squares", 1977.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.robust import weights
    >>> weights("huber", np.array([0.0, 0.5, 1.0, 2.0, np.inf]), 1.0)
    array([1. , 1. , 1. , 0.5, 0. ])
    """
    validate.one_of(kernel, KERNELS, "kernel")
    distances = numbers(distances, "distances")
    return run_weights(kernel, distances, _usable(kernel, threshold))


def run_weights(kernel: str, distances: FloatArray, threshold: FloatArray) -> FloatArray:
    """`weights` within a run, unchecked: a step may overflow, and then only its own problem is stopped."""
    if kernel == "none":
        return np.ones_like(distances)
    with np.errstate(under="ignore", over="ignore"):
        x = distances / threshold[..., None]
        if kernel == "huber":
            return 1.0 / np.maximum(x, 1.0)
        if kernel == "tukey":
            return np.square(1.0 - np.square(np.minimum(x, 1.0)))
        if kernel == "geman-mcclure":
            return 1.0 / np.square(1.0 + np.square(x))
        return np.exp(-0.5 * np.square(x))


def loss(kernel: str, distances: FloatArray, threshold: FloatArray | float) -> FloatArray:
    """The losses ρ(r; k) of pair distances, whose derivatives are `w(r; k) r`.

    Parameters
    ----------
    kernel : str
        A name in `KERNELS`. "none" is r²/2.
    distances : ndarray of shape (..., m)
        Pair distances r, in world units.
    threshold : float or ndarray of shape (...)
        k, positive, in the same unit.

    Returns
    -------
    ndarray of shape (..., m)
        Squared world units.

    Raises
    ------
    ValueError
        If there is no such kernel, or a threshold is not positive and finite.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.robust import loss
    >>> loss("huber", np.array([0.0, 1.0, 2.0]), 1.0)
    array([0. , 0.5, 1.5])
    """
    validate.one_of(kernel, KERNELS, "kernel")
    distances = numbers(distances, "distances")
    return run_loss(kernel, distances, _usable(kernel, threshold))


def run_loss(kernel: str, distances: FloatArray, threshold: FloatArray) -> FloatArray:
    """`loss` within a run, unchecked like `run_weights`."""
    with np.errstate(under="ignore", over="ignore", invalid="ignore", divide="ignore"):
        if kernel == "none":
            return 0.5 * np.square(distances)
        k = threshold[..., None]
        x = distances / k
        if kernel == "huber":
            inner = np.minimum(x, 1.0)
            return np.square(k) * (0.5 * np.square(inner) + (x - inner))
        # Written without a difference from 1, in which a distance far below the threshold would be lost.
        if kernel == "tukey":
            y = np.square(np.minimum(x, 1.0))
            return np.square(k) / 6.0 * (y * (3.0 - y * (3.0 - y)))
        if kernel == "geman-mcclure":
            return 0.5 * np.square(k) / (1.0 + 1.0 / np.square(x))
        return -np.square(k) * np.expm1(-0.5 * np.square(x))


def threshold(
    kernel: str,
    distances: FloatArray,
    among: BoolArray | None = None,
    tuning: float | None = None,
    scale: FloatArray | float | None = None,
    floor: FloatArray | float = _LEAST,
) -> FloatArray:
    """The threshold `k = tuning · s` of pair distances.

    Parameters
    ----------
    kernel : str
        A name in `KERNELS`. "none" has the threshold infinity.
    distances : ndarray of shape (b, m)
        Pair distances r, in world units.
    among : ndarray of bool, shape (b, m), optional
        The pairs that s is taken from. None is all.
    tuning : float, optional
        None is `TUNING[kernel]`.
    scale : float or ndarray of shape (b,), optional
        s, in world units. None is `mad_scale` of the distances.
    floor : float or ndarray of shape (b,), default 1e-100
        The least s, if no scale is given.

    Returns
    -------
    ndarray of shape (b,)
        World units.

    Raises
    ------
    ValueError
        If there is no such kernel, or `tuning` or a scale is not positive and finite.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.robust import threshold
    >>> threshold("tukey", np.array([[0.1, 0.2, 9.0]]), scale=0.1).round(4)
    array([0.4685])
    """
    validate.one_of(kernel, KERNELS, "kernel")
    distances = _rows(distances)
    if kernel == "none":
        return np.full(distances.shape[:-1], np.inf)
    c = TUNING[kernel] if tuning is None else validate.number(tuning, "tuning", 1e-100, 1e100)
    if scale is None:
        return c * mad_scale(distances, among, floor)
    return c * np.broadcast_to(_positive(scale, "scale"), distances.shape[:-1])


def check_options(weight: str, tuning: float | None, scale: float | None) -> None:
    """Check a kernel, a tuning constant and a scale.

    Parameters
    ----------
    weight : str
        A name in `KERNELS`.
    tuning : float or None
        A number from 1e-100 to 1e100.
    scale : float or None
        The same.

    Raises
    ------
    ValueError
        If one of them is not valid; the message names it.

    Examples
    --------
    >>> from solvers.robust import check_options
    >>> check_options("huber", 1.345, None)
    """
    validate.one_of(weight, KERNELS, "weight")
    for name, value in (("tuning", tuning), ("scale", scale)):
        if value is not None:
            validate.number(value, name, 1e-100, 1e100)


def _usable(kernel: str, threshold: FloatArray | float) -> FloatArray:
    """The threshold that a kernel uses: infinity for "none", whatever is given."""
    return np.array(np.inf) if kernel == "none" else _positive(threshold, "threshold")


def _rows(distances: FloatArray) -> FloatArray:
    r = numbers(distances, "distances")
    if not r.ndim or not r.shape[-1]:
        raise ValueError(f"distances: expected shape (..., m), at least one per row, got {r.shape}")
    return r


def _positive(values: FloatArray | float, name: str) -> FloatArray:
    k = numbers(values, name)
    if not (np.isfinite(k) & (k > 0.0)).all():
        raise ValueError(f"{name}: expected a positive, finite number, got {shown(values)}")
    return k
