"""Sizes of clouds, and weighted rigid fits of pairs."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray, ReasonArray
from solvers.core.pose import Pose
from solvers.core.status import Status
from solvers.geometry.rigid import fit_planar, fit_rigid


def rms_radius(points: FloatArray) -> FloatArray:
    """Root mean square distance of the points (b, n, d) from their centroid, (b,); 1
    where they are equal.
    """
    with np.errstate(over="ignore", under="ignore"):
        centred = points - points.mean(axis=1, keepdims=True)
        # Each problem sums a row of its own, so its rounding does not depend on the
        # batch.
        radius = np.sqrt(np.square(centred).reshape(len(points), -1).sum(axis=1) / points.shape[1])
    return np.where(radius > 0.0, radius, 1.0)


def fit_pairs(
    pose: Pose, source: FloatArray, partners: FloatArray, weights: FloatArray
) -> tuple[Pose, ReasonArray, FloatArray]:
    """The weighted closed-form fit as one step from `pose`: the new pose, reasons,
    condition.

    Where the pairs leave the rotation undefined the present one is kept and only the
    centroids are brought together (the best translation for it), and the reason says
    why; without any weight the pose stays.
    """
    fit = (fit_planar if source.shape[-1] == 2 else fit_rigid)(source, partners, weights)
    bad = fit.status == Status.DEGENERATE
    if not bad.any():
        return fit.pose, fit.reason, fit.condition
    R, t, scale = np.array(fit.pose.R), np.array(fit.pose.t), np.array(fit.pose.scale)
    R[bad], t[bad] = pose.R[bad], pose.t[bad]
    some = bad & (weights > 0.0).any(axis=1)
    share = weights[some] / weights[some].max(axis=1, keepdims=True)
    share /= share.sum(axis=1, keepdims=True)
    mean_p, mean_q = (np.einsum("bm,bmd->bd", share, x[some]) for x in (source, partners))
    t[some] = mean_q - (R[some] @ mean_p[..., None])[..., 0]
    scale[bad & ~some] = np.asarray(pose.scale)[bad & ~some]
    return Pose(R, t, scale), fit.reason, fit.condition
