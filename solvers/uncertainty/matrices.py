"""Making covariances from matrices, and one batch of several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.kinds import of_kind
from solvers.core.numbers import finite, numbers
from solvers.core.pose import Pose
from solvers.core.poses import stacked as stacked_poses
from solvers.uncertainty import se2
from solvers.uncertainty.region import Covariance

_FAR = 1e4
_EPS = float(np.finfo(np.float64).eps)


def from_matrix(
    matrix: ArrayLike,
    mean: Pose,
    *,
    centre: ArrayLike = (0.0, 0.0),
    radius: ArrayLike = 1.0,
    frame: str = "target",
    made_by: str = "given",
) -> Covariance:
    """A covariance from its matrix.

    Parameters
    ----------
    matrix : array_like of shape (..., 3, 3)
        Over (angle, x, y), about the frame's origin: symmetric, positive semidefinite.
    mean : Pose
        Rigid motions of the plane, of shape (...).
    centre : array_like of shape (..., 2), default (0.0, 0.0)
        The cloud's centre, in the frame's coordinates.
    radius : array_like of shape (...), default 1.0
        The cloud's RMS radius, world units.
    frame : str, default "target"
        "target" or "source".
    made_by : str, default "given"
        How the matrix was obtained.

    Returns
    -------
    Covariance
        With the directions ordered by falling deviation.

    Raises
    ------
    ValueError
        If the matrix is not finite, not symmetric or not positive semidefinite, the
        mean is not a planar pose, centre or radius are not finite, the radius is not
        positive, or a shape does not fit the mean's.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.uncertainty import from_matrix
    >>> odometry = np.diag([0.05, 0.2, 0.1]) ** 2
    >>> from_matrix(odometry, Pose.identity(), radius=3.0, frame="source").deviations.round(3)
    array([0.2 , 0.15, 0.1 ])
    """
    S = finite(numbers(matrix, "matrix"), "matrix")
    if S.shape[-2:] != (3, 3):
        raise ValueError(f"matrix: expected shape (..., 3, 3), got {S.shape}")
    size = np.abs(S).max(axis=(-2, -1))
    if (np.abs(S - S.swapaxes(-1, -2)).max(axis=(-2, -1)) > 1e-9 * size).any():
        raise ValueError("matrix: it is not symmetric")
    of_kind(mean, Pose, "mean")
    batch = mean.batch
    S = _of_shape(S, (*batch, 3, 3), "matrix")
    c = _of_shape(finite(numbers(centre, "centre"), "centre"), (*batch, 2), "centre")
    r = _of_shape(finite(numbers(radius, "radius"), "radius"), batch, "radius")
    if not (r > 0.0).all():
        raise ValueError(f"radius: must be positive, but the smallest is {r.min():.6g}")
    ones = np.ones_like(r)
    out = np.stack([r, ones, ones], axis=-1)[..., :, None] * se2.shifted(c)
    return from_scaled(out @ S @ out.swapaxes(-1, -2), mean, c, r, frame, made_by)


def _of_shape(a: FloatArray, shape: tuple[int, ...], name: str) -> FloatArray:
    """`a` broadcast to the shape that fits the mean; else a ValueError."""
    try:
        return np.broadcast_to(a, shape)
    except ValueError:
        raise ValueError(f"{name}: expected a shape that fits {shape}, as the mean's, got {a.shape}") from None


def from_scaled(
    scaled: FloatArray, mean: Pose, centre: FloatArray, radius: FloatArray, frame: str, made_by: str,
    free: FloatArray | None = None,
) -> Covariance:  # fmt: skip
    """A covariance from its matrix (..., 3, 3) in (radius · angle, x, y) about the centre.

    free: (..., 3, 3) a column for each free direction, zero for the others; the matrix
    is zero along them.
    """
    if mean.dim != 2:
        raise ValueError("mean: expected rigid motions of the plane")
    mean = validate.unscaled(mean, "mean", "expected rigid motions of the plane, of scale 1")
    scaled = np.broadcast_to(0.5 * (scaled + scaled.swapaxes(-1, -2)), (*mean.batch, 3, 3))
    largest = np.abs(scaled).max(axis=(-2, -1), keepdims=True)
    unit = np.where(largest > 0.0, largest, 1.0)
    relative = scaled / unit
    if free is not None:
        # Free directions get eigenvalues far above the rest, so that they come first.
        relative = relative + _FAR * (free @ free.swapaxes(-1, -2))
    values, vectors = np.linalg.eigh(relative)
    if values.min(initial=0.0) < -1e-6:
        raise ValueError("matrix: it is not positive semidefinite")
    values, vectors = values[..., ::-1], vectors[..., ::-1]
    infinite = values > 0.5 * _FAR if free is not None else np.zeros(values.shape, dtype=np.bool_)
    # Values this small are the rounding error of zero.
    values = np.where(values > 8.0 * _EPS * values.max(axis=-1, keepdims=True), values, 0.0)
    deviations = np.where(infinite, np.inf, np.sqrt(values * unit[..., 0]))
    # The sign of a direction is arbitrary: make its largest component positive.
    at = np.abs(vectors).argmax(axis=-2)[..., None, :]
    vectors = vectors * np.where(np.take_along_axis(vectors, at, axis=-2) < 0.0, -1.0, 1.0)
    return Covariance(mean, deviations, vectors, np.array(centre), np.array(radius), frame, made_by)


def stacked(parts: Sequence[Covariance]) -> Covariance:
    """Covariances of one shape, frame and origin along a new leading axis."""

    def rows(name: str) -> FloatArray:
        return np.stack([getattr(part, name) for part in parts])

    return replace(
        parts[0], mean=stacked_poses([part.mean for part in parts]), deviations=rows("deviations"),
        directions=rows("directions"), centre=rows("centre"), radius=rows("radius"),
    )  # fmt: skip
