"""Rotation matrices from angles and rotation vectors, NaN where these are NaN, and back."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray


def planar(theta: FloatArray) -> FloatArray:
    """The rotations (..., 2, 2) by angles (...) in radians, anticlockwise."""
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def spatial(rotvec: FloatArray) -> FloatArray:
    """The rotations (..., 3, 3) by rotation vectors (..., 3): Rodrigues' formula, accurate even at angle 0."""
    x, y, z = rotvec[..., 0], rotvec[..., 1], rotvec[..., 2]
    o = np.zeros_like(x)
    rows = [[o, -z, y], [z, o, -x], [-y, x, o]]
    skew = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    with np.errstate(under="ignore"):  # the square of a tiny angle is zero, even if the caller has numpy raise
        theta = np.linalg.norm(rotvec, axis=-1)[..., None, None]
        # sin θ / θ and (1 − cos θ) / θ² = sinc²(θ/2) / 2; numpy's sinc has a π in it.
        first, second = np.sinc(theta / np.pi), 0.5 * np.square(np.sinc(theta / (2.0 * np.pi)))
        turn: FloatArray = np.eye(3) + first * skew + second * (skew @ skew)
    return turn


def angle(R: FloatArray) -> FloatArray:
    """The angles (...) of rotations (..., 2, 2), signed, or (..., 3, 3), in [0, π]: by atan2 of the sine (skew part)
    and the cosine (trace). Raises ValueError for other d.
    """
    if R.shape[-1] == 2:
        turn: FloatArray = np.arctan2(R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1])
        return turn[()]
    if R.shape[-1] != 3:
        raise ValueError(f"angle: defined in 2 and 3 dimensions, not in {R.shape[-1]}")
    skew = np.stack([R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1)
    about: FloatArray = np.arctan2(np.linalg.norm(skew, axis=-1), np.trace(R, axis1=-2, axis2=-1) - 1.0)
    return about[()]


def rotvec(R: FloatArray) -> FloatArray:
    """The rotation vectors (..., 3) of rotations (..., 3, 3), no longer than π: computed from the largest component of
    the unit quaternion, so that nothing is divided by a number near zero. Raises ValueError if d is not 3.
    """
    if R.shape[-1] != 3:
        raise ValueError(f"rotvec: defined in 3 dimensions, not in {R.shape[-1]}")
    a, b, c = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    x, y, z = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    xy, xz, yz = R[..., 0, 1] + R[..., 1, 0], R[..., 0, 2] + R[..., 2, 0], R[..., 1, 2] + R[..., 2, 1]
    # Each row is the quaternion (w, x, y, z) times four times one of its components.
    rows = [
        [1.0 + a + b + c, x, y, z],
        [x, 1.0 + a - b - c, xy, xz],
        [y, xy, 1.0 - a + b - c, yz],
        [z, xz, yz, 1.0 - a - b + c],
    ]
    products = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    largest = products[..., range(4), range(4)].argmax(axis=-1)
    q = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1)
    angle = 2.0 * np.arctan2(sine, q[..., 0])
    turn: FloatArray = q[..., 1:] * np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 0.0)[..., None]
    return turn
