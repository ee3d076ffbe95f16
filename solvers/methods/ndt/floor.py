"""Covariances of cells with the small eigenvalue raised to a floor, so that those of points on a line have inverses."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray
from solvers.geometry.spectral import symmetric_eigen

FLOOR = 1e-3
"""The smallest eigenvalue of a cell's covariance is raised to this fraction of the largest."""
SMALLEST = 1e-300
"""An eigenvalue below this counts as zero: it has no inverse in float64."""


def inverse(covariance: FloatArray, least: FloatArray | float = 0.0) -> tuple[FloatArray, BoolArray]:
    """The inverses of covariances after flooring the small eigenvalue.

    Parameters
    ----------
    covariance : ndarray of shape (..., 2, 2)
        In u².
    least : float or ndarray of shape (...), default 0.0
        The least value of the large eigenvalue, in u².

    Returns
    -------
    inverses : ndarray of shape (..., 2, 2)
        The identity where the large eigenvalue is less, or zero.
    wide : ndarray of bool, shape (...)
        Whether the covariance was inverted.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import inverse
    >>> inverses, wide = inverse(np.diag([0.0, 4.0]))
    >>> inverses.diagonal().round(6), wide
    (array([250.  ,   0.25]), np.True_)
    """
    values, vectors, wide = _floored(covariance, least)
    return (vectors / values[..., None, :]) @ vectors.swapaxes(-1, -2), wide


def floored(covariance: FloatArray) -> FloatArray:
    """Covariances whose small eigenvalue is raised to at least `FLOOR` times the large one.

    Parameters
    ----------
    covariance : ndarray of shape (..., 2, 2)
        In u².

    Returns
    -------
    ndarray of shape (..., 2, 2)
        The identity where there is no variance.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.ndt_map import floored
    >>> floored(np.diag([0.0, 4.0])).diagonal().round(6)
    array([0.004, 4.   ])
    """
    values, vectors, _ = _floored(covariance)
    return np.asarray((vectors * values[..., None, :]) @ vectors.swapaxes(-1, -2))


def _floored(covariance: FloatArray, least: FloatArray | float = 0.0) -> tuple[FloatArray, FloatArray, BoolArray]:
    values, vectors = symmetric_eigen(covariance)
    high = values[..., 1]
    wide = np.asarray(high >= np.maximum(least, SMALLEST)) & np.isfinite(high)
    return np.where(wide[..., None], np.maximum(values, FLOOR * high[..., None]), 1.0), vectors, wide
