"""The noise of measured points: a scanner's, from range and bearing, and any that a caller gives as covariances."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.numbers import finite, numbers


def range_bearing(
    points: ArrayLike, range_sigma: float, bearing_sigma: float = 0.0, origin: ArrayLike = (0.0, 0.0)
) -> FloatArray:
    """The covariances of points measured by a range scanner.

    Parameters
    ----------
    points : array_like of shape (..., n, 2)
        In the scan's coordinates, world units.
    range_sigma : float
        The standard deviation of a range, world units.
    bearing_sigma : float, default 0.0
        That of a bearing, radians.
    origin : array_like of shape (2,), default (0.0, 0.0)
        The scanner's position.

    Returns
    -------
    ndarray of shape (..., n, 2, 2)
        Squared world units: `range_sigma`² along the ray and (range ·
        `bearing_sigma`)² across it.

    Raises
    ------
    ValueError
        If the points are not a planar cloud, the origin not a point of the plane, or a
        deviation is negative.

    Examples
    --------
    >>> from solvers.uncertainty import range_bearing
    >>> range_bearing([[4.0, 0.0]], 0.1, 0.05)[0].round(4)
    array([[0.01, 0.  ],
           [0.  , 0.04]])
    """
    stand = finite(numbers(origin, "origin"), "origin")
    if stand.shape != (2,):
        raise ValueError(f"origin: expected shape (2,), got {stand.shape}")
    ray = validate.cloud(points, "points", 2) - stand
    along = validate.number(range_sigma, "range_sigma", 0.0)
    across = validate.number(bearing_sigma, "bearing_sigma", 0.0)
    far = np.linalg.norm(ray, axis=-1, keepdims=True)
    u = ray / np.where(far > 0.0, far, 1.0)
    n = np.stack([-u[..., 1], u[..., 0]], axis=-1)
    noise: FloatArray = along**2 * _outer(u, u) + np.square(across * far)[..., None] * _outer(n, n)
    return noise


def covariances(noise: ArrayLike, name: str, batch: tuple[int, ...], count: int) -> FloatArray:
    """Covariances (b, count, 2, 2) from the caller's deviations or covariances."""
    a = finite(numbers(noise, name), name)
    if a.shape in ((), (count,)):
        if (a < 0.0).any():
            raise ValueError(f"{name}: a deviation is negative")
        a = np.square(a)[..., None, None] * np.eye(2)
        a = np.broadcast_to(a, (count, 2, 2))
    elif a.shape[-3:] != (count, 2, 2):
        raise ValueError(f"{name}: expected one number, {count}, or {count} covariances, got {a.shape}")
    elif not _semidefinite(a):
        raise ValueError(f"{name}: a covariance is not symmetric and positive semidefinite")
    try:
        whole = np.broadcast_to(a, (*batch, count, 2, 2))
    except ValueError:
        raise ValueError(f"{name}: expected one number, {count}, or {count} covariances, got {a.shape}") from None
    return whole.reshape(-1, count, 2, 2)


def _semidefinite(a: FloatArray) -> bool:
    """Whether all matrices of a, (..., 2, 2), are symmetric and positive semidefinite, up to rounding."""
    little = 1e-9 * np.abs(a).max(axis=(-2, -1))
    symmetric = (np.abs(a - a.swapaxes(-1, -2)).max(axis=(-2, -1)) <= little).all()
    return bool(symmetric and (np.linalg.eigvalsh(a).min(axis=-1) >= -little).all())


def _outer(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[..., :, None] * b[..., None, :]


