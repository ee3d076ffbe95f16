"""How far an estimate is from the truth, and how well it fits its pairs: two different questions.

Each answer has the shape of the batch; for a batch of none it is a numpy scalar.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers import validate
from solvers.arrays import FloatArray
from solvers.pose import Pose


def rre(pose: Pose, truth: Pose) -> FloatArray:
    """Relative rotation error: the angle of R R*ᵀ in radians, (...), from 0 to π, in 2 or 3 dimensions."""
    relative = Pose(pose.R @ truth.R.swapaxes(-1, -2), np.zeros(pose.dim))
    error: FloatArray = np.abs(relative.angle)
    return error


def rte(pose: Pose, truth: Pose) -> FloatArray:
    """Relative translation error: ‖t − t*‖ in world units, (...). It depends on where the world's origin lies."""
    distance: FloatArray = np.linalg.norm(pose.t - truth.t, axis=-1)
    return distance[()]


def scale_error(pose: Pose, truth: Pose) -> FloatArray:
    """|s / s* − 1|, (...)."""
    error: FloatArray = np.abs(np.asarray(pose.scale) / np.asarray(truth.scale) - 1.0)
    return error[()]


def point_error(pose: Pose, truth: Pose, points: ArrayLike) -> FloatArray:
    """Root mean square distance, (...), between where `pose` and `truth` put the points (..., n, d)."""
    p = validate.cloud(points, "points", pose.dim)
    return _root_mean_square(pose.apply(p) - truth.apply(p), None)


def residuals(pose: Pose, source: ArrayLike, target: ArrayLike) -> FloatArray:
    """The distance left between each moved source row and its target row, (..., n)."""
    p, q = validate.matched(source, target)
    distance: FloatArray = np.linalg.norm(pose.apply(p) - q, axis=-1)
    return distance


def rms(
    pose: Pose, source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None
) -> FloatArray:
    """√(Σ wᵢ rᵢ² / Σ wᵢ) over matched rows, (...): what a fit minimises. Zero where all weights are zero."""
    p, q = validate.matched(source, target)
    w = None if weights is None else validate.weights(weights, p.shape[-2])
    return _root_mean_square(pose.apply(p) - q, w)


def _root_mean_square(offsets: FloatArray, weights: FloatArray | None) -> FloatArray:
    squares = np.einsum("...nd,...nd->...n", offsets, offsets)
    if weights is None:
        weights = np.ones(squares.shape[-1])
    total = weights.sum(axis=-1)
    root: FloatArray = np.sqrt((weights * squares).sum(axis=-1) / np.where(total > 0.0, total, 1.0))
    return root[()]
