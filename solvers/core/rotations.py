"""Rotation matrices from angles; of what is not a number they are NaN."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray


def planar(theta: FloatArray) -> FloatArray:
    """The rotations (..., 2, 2) by angles (...) in radians, anticlockwise."""
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def spatial(rotvec: FloatArray) -> FloatArray:
    """The rotations (..., 3, 3) by rotation vectors (..., 3): Rodrigues' formula, accurate at no turn."""
    theta = np.linalg.norm(rotvec, axis=-1)[..., None, None]
    x, y, z = rotvec[..., 0], rotvec[..., 1], rotvec[..., 2]
    o = np.zeros_like(x)
    rows = [[o, -z, y], [z, o, -x], [-y, x, o]]
    skew = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    # sin θ / θ and (1 − cos θ) / θ² = sinc²(θ/2) / 2; numpy's sinc has a π in it.
    first, second = np.sinc(theta / np.pi), 0.5 * np.square(np.sinc(theta / (2.0 * np.pi)))
    turn: FloatArray = np.eye(3) + first * skew + second * (skew @ skew)
    return turn
