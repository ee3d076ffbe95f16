"""Robust kernels on the χ² of an edge: the weight, in (0, 1], and the loss.

With `x = χ²`, the threshold k and `Φ = k²`, the weight is the loss's derivative ρ'(x):

    huber    w = 1 (x ≤ Φ), k/√x beyond             ρ = x, 2 k √x − Φ beyond
    cauchy   w = 1 / (1 + x/Φ)                      ρ = Φ log(1 + x/Φ)
    dcs      w = min(1, 2Φ / (Φ + x))²              ρ = x (x ≤ Φ), Φ (3x − Φ) / (Φ + x) beyond: at most 3Φ

Sources: Huber 1964, Robust estimation of a location parameter; Agarwal, Tipaldi, Spinello, Stachniss & Burgard 2013,
Robust map optimization using dynamic covariance scaling (the weight is the square of its s; the loss is the one with
that derivative).
"""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray

KERNELS = ("none", "huber", "cauchy", "dcs")
THRESHOLD = 2.8
"""√7.8: of the edges whose information matches their noise, 95 % have a smaller χ (three degrees of freedom)."""


def weights(kernel: str, chi2: FloatArray, threshold: float) -> FloatArray:
    """ρ'(χ²), the factor on an edge's information; an infinite χ² has weight 0, unless
    the kernel is 'none'.
    """
    if kernel == "none":
        return np.ones_like(chi2)
    with np.errstate(over="ignore", under="ignore"):
        x = chi2 / threshold**2
        if kernel == "huber":
            return 1.0 / np.sqrt(np.maximum(x, 1.0))
        if kernel == "cauchy":
            return 1.0 / (1.0 + x)
        return np.square(np.minimum(1.0, 2.0 / (1.0 + x)))


def loss(kernel: str, chi2: FloatArray, threshold: float) -> FloatArray:
    """ρ(χ²); equal to χ² near zero."""
    if kernel == "none":
        return chi2
    phi = threshold**2
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        x = chi2 / phi
        if kernel == "huber":
            return phi * np.where(x <= 1.0, x, 2.0 * np.sqrt(x) - 1.0)
        if kernel == "cauchy":
            return phi * np.log1p(x)
        return phi * np.where(x <= 1.0, x, 3.0 - 4.0 / (1.0 + x))
