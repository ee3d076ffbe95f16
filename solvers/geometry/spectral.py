"""Eigenvalues and eigenvectors of small symmetric matrices: in closed form in the plane,
by LAPACK otherwise, with fixed signs.
"""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray


def symmetric_eigen(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (..., d), smallest first, and unit eigenvectors (..., d, d), column k
    for value k, of (..., d, d).

    In each eigenvector the component of largest magnitude (the first among equal ones) is
    positive. A matrix that is not finite gets NaN eigenvalues and the unit vectors. If two
    eigenvalues agree to rounding, their vectors are an arbitrary choice. In the plane
    `θ = ½ atan2(2b, a − c)` is the direction of the larger of
    `½(a + c) ± hypot(½(a − c), b)`, for [[a, b], [b, c]]: the smaller has an error of
    rounding times the larger, as with LAPACK.
    """
    if matrices.shape[-1] == 2:
        a, b, c = matrices[..., 0, 0], matrices[..., 0, 1], matrices[..., 1, 1]
        with np.errstate(over="ignore", under="ignore", invalid="ignore"):
            half, gap = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
            values = np.stack([half - gap, half + gap], axis=-1)
            theta = 0.5 * np.arctan2(2.0 * b, a - c)
        nonfinite = np.asarray(~np.isfinite(values).all(axis=-1))
        cos, sin = np.cos(np.where(nonfinite, 0.5 * np.pi, theta)), np.sin(np.where(nonfinite, 0.5 * np.pi, theta))
        vectors = np.stack([np.stack([-sin, cos], axis=-1), np.stack([cos, sin], axis=-1)], axis=-1)
    else:
        nonfinite = np.asarray(~np.isfinite(matrices).all(axis=(-2, -1)))
        values, vectors = np.linalg.eigh(np.where(nonfinite[..., None, None], np.eye(matrices.shape[-1]), matrices))
    largest = np.abs(vectors).argmax(axis=-2)
    sign = np.sign(np.take_along_axis(vectors, largest[..., None, :], axis=-2))
    return np.where(nonfinite[..., None], np.nan, values), vectors * sign
