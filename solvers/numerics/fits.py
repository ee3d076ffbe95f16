"""Sizes of clouds, lengths that follow from them, and weighted rigid fits of pairs."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray, ReasonArray
from solvers.core.pose import Pose
from solvers.geometry.rigid import closed_form_step


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


def weighted_centroid(points: FloatArray, weights: FloatArray) -> FloatArray:
    """Centroid of the rows (b, m, d) that have a weight (b, m), each counted alike, (b, d): what rows without one do
    not move, wherever they lie.
    """
    used = weights > 0.0
    count = np.maximum(used.sum(axis=1), 1)[:, None]
    with np.errstate(over="ignore", under="ignore"):
        return np.asarray(np.where(used[..., None], points, 0.0).sum(axis=1) / count)


def weighted_radius(points: FloatArray, weights: FloatArray) -> FloatArray:
    """`rms_radius` of the rows that have a weight, (b,)."""
    used = weights > 0.0
    if used.all():
        return rms_radius(points)
    share = np.sqrt(points.shape[1] / np.maximum(used.sum(axis=1), 1))
    kept = np.where(used[..., None], points, weighted_centroid(points, weights)[:, None])
    radius: FloatArray = rms_radius(kept) * share
    return radius


def rms_motion(step: FloatArray, weights: FloatArray) -> FloatArray:
    """Root mean square length of the steps (b, m, d) of the rows that have a weight (b, m), (b,)."""
    used = weights > 0.0
    if used.all():
        return np.asarray(np.sqrt(np.einsum("bmd,bmd->b", step, step) / step.shape[1]))
    step = np.where(used[..., None], step, 0.0)
    return np.asarray(np.sqrt(np.einsum("bmd,bmd->b", step, step) / np.maximum(used.sum(axis=1), 1)))


def spread_volume(points: FloatArray) -> FloatArray:
    """The area of the square, or volume of the cube, in which evenly spread points have
    the RMS radius r of the points (b, n, d): `(√(12/d) r)ᵈ`, (b,), uᵈ. No rotation
    changes it, and points on a line have one too.
    """
    d = points.shape[2]
    with np.errstate(over="ignore", under="ignore"):
        volume: FloatArray = (np.sqrt(12.0 / d) * rms_radius(points)) ** d
    # So that neither it nor what is divided by it leaves the range of numbers.
    return np.clip(volume, 1e-300, 1e300)


def lengths(given: float | None, share: float, points: FloatArray) -> FloatArray:
    """A length for each cloud of points (b, n, d), (b,), u: the one given, or else a
    share of the cloud's RMS radius, within what has a square.
    """
    if given is not None:
        return np.full(len(points), given, dtype=np.float64)
    return np.clip(share * rms_radius(points), 1e-150, 1e149)


def fit_pairs(
    pose: Pose, source: FloatArray, partners: FloatArray, weights: FloatArray
) -> tuple[Pose, ReasonArray, FloatArray]:
    """The weighted closed-form fit as one step from `pose`: the new pose, reasons,
    condition.

    Where the pairs leave the rotation undefined the present one is kept and only the
    centroids are brought together (the best translation for it), and the reason says
    why; without any weight the pose stays.
    """
    fitted, bad, reason, condition = closed_form_step(source, partners, weights)
    if not bad.any():
        return fitted, reason, condition
    R, t, scale = np.array(fitted.R), np.array(fitted.t), np.array(fitted.scale)
    R[bad], t[bad] = pose.R[bad], pose.t[bad]
    some = bad & (weights > 0.0).any(axis=1)
    share = weights[some] / weights[some].max(axis=1, keepdims=True)
    share /= share.sum(axis=1, keepdims=True)
    mean_p, mean_q = (np.einsum("bm,bmd->bd", share, x[some]) for x in (source, partners))
    t[some] = mean_q - (R[some] @ mean_p[..., None])[..., 0]
    scale[bad & ~some] = np.asarray(pose.scale)[bad & ~some]
    return Pose.trusted(R, t, scale), reason, condition
