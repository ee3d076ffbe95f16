"""Sizes of clouds, lengths derived from them, and weighted rigid fits of pairs."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray, ReasonArray
from solvers.core.pose import Pose
from solvers.geometry.rigid import closed_form_step

STRAY = 20.0
"""A point more than this many times as far out as the median point is a stray, which default lengths ignore."""


def rms_radius(points: FloatArray) -> FloatArray:
    """Root mean square distance of the points (b, n, d) from their centroid, (b,); 1 if
    they are equal.
    """
    with np.errstate(over="ignore", under="ignore"):
        centred = points - points.mean(axis=1, keepdims=True)
        # Each problem sums a row of its own, so its rounding does not depend on the
        # batch.
        radius = np.sqrt(np.square(centred).reshape(len(points), -1).sum(axis=1) / points.shape[1])
    return np.where(radius > 0.0, radius, 1.0)


def typical_radius(points: FloatArray) -> FloatArray:
    """`rms_radius` of the points without strays, (b,). Default lengths are shares of it, so that one wrong laser return
    does not decide them.
    """
    return weighted_radius(points, typical_weights(points))


def strays(points: FloatArray) -> BoolArray:
    """Which of the points (b, n, d) are strays, (b, n): more than `STRAY` times as far from the coordinates' medians as
    the median point.
    """
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        step = points - np.median(points, axis=1, keepdims=True)
        far = np.sqrt(np.square(step).sum(axis=2))
        most = np.median(far, axis=1, keepdims=True)
        return np.asarray((far > STRAY * most) & (most > 0.0))


def typical_weights(points: FloatArray) -> FloatArray:
    """Weights (b, n): 0 for strays, 1 for all other points."""
    return (~strays(points)).astype(np.float64)


def pair_width(moved: FloatArray, fixed: FloatArray) -> FloatArray:
    """Root mean square difference in a coordinate over all pairs of points (b, m, d) and (b, n, d), without strays,
    (b,): computed from the clouds' means and radii.
    """
    p, q = typical_weights(moved), typical_weights(fixed)
    gap = np.linalg.norm(weighted_centroid(moved, p) - weighted_centroid(fixed, q), axis=1)
    size = np.hypot(np.hypot(gap, weighted_radius(moved, p)), weighted_radius(fixed, q))
    return np.asarray(size / np.sqrt(moved.shape[2]))


def about(moved: FloatArray, target: FloatArray) -> FloatArray:
    """Weights (b, m): 1 for the moved points (b, m, d) about the target (b, n, d), 0 for strays, which lie farther
    from the box of the target without its own strays than that box is long. If all do, none is a stray.
    """
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        inner = np.where(strays(target)[..., None], np.median(target, axis=1, keepdims=True), target)
        low, high = (of(inner, axis=1)[:, None] for of in (np.min, np.max))
        near = np.maximum(low - moved, moved - high).max(axis=2) <= (high - low).max(axis=2)
    return np.where(near.any(axis=1, keepdims=True), near, True).astype(np.float64)


def weighted_centroid(points: FloatArray, weights: FloatArray) -> FloatArray:
    """`Σ w x / Σ w` of the rows (b, m, d) with weights (b, m), (b, d). Rows of zero weight may lie anywhere."""
    share = _relative(weights)
    with np.errstate(over="ignore", under="ignore"):
        return _summed(share, points) / _count(share)


def weighted_radius(points: FloatArray, weights: FloatArray) -> FloatArray:
    """`√(Σ w ‖x − c‖² / Σ w)` about the weighted centroid c, (b,); 1 if it is zero. With equal weights this is
    `rms_radius`.
    """
    share = _relative(weights)
    if (share == 1.0).all():
        return rms_radius(points)
    with np.errstate(over="ignore", under="ignore"):
        step = points - (_summed(share, points) / _count(share))[:, None]
        radius = np.sqrt(_squares(share, step) / _count(share)[:, 0])
    return np.where(radius > 0.0, radius, 1.0)


def rms_motion(step: FloatArray, weights: FloatArray | None = None) -> FloatArray:
    """Root mean square length `√(Σ w ‖step‖² / Σ w)` of the steps (b, m, d) with weights (b, m), (b,); None means equal
    weights.
    """
    share = None if weights is None else _relative(weights)
    if share is None or (share == 1.0).all():
        return np.asarray(np.sqrt(np.square(step).reshape(len(step), -1).sum(axis=1) / step.shape[1]))
    return np.asarray(np.sqrt(_squares(share, step) / _count(share)[:, 0]))


def _relative(weights: FloatArray) -> FloatArray:
    """The weights (b, m) divided by the largest: all 1 if they are equal, so that sums round as without weights."""
    most = weights.max(axis=1, keepdims=True)
    return np.asarray(weights / np.where(most > 0.0, most, 1.0))


def _count(share: FloatArray) -> FloatArray:
    """`Σ w`, (b, 1), never below 1: it is 1 for problems without any weight, whose other sums are zero."""
    return np.asarray(np.maximum(share.sum(axis=1, keepdims=True), 1.0))


def _summed(share: FloatArray, points: FloatArray) -> FloatArray:
    """`Σ w x`, (b, d)."""
    return np.asarray((share[..., None] * np.where(share[..., None] > 0.0, points, 0.0)).sum(axis=1))


def _squares(share: FloatArray, step: FloatArray) -> FloatArray:
    """`Σ w ‖step‖²`, (b,)."""
    terms = share[..., None] * np.square(np.where(share[..., None] > 0.0, step, 0.0))
    return np.asarray(terms.reshape(len(step), -1).sum(axis=1))


def spread_volume(points: FloatArray) -> FloatArray:
    """The area of the square, or volume of the cube, in which evenly spread points have
    the RMS radius r of the points (b, n, d) without strays: `(√(12/d) r)ᵈ`, (b,), uᵈ. It
    does not change with rotation, and points on a line have one too.
    """
    d = points.shape[2]
    with np.errstate(over="ignore", under="ignore"):
        volume: FloatArray = (np.sqrt(12.0 / d) * typical_radius(points)) ** d
    # So that neither it nor a quotient by it overflows or vanishes.
    return np.clip(volume, 1e-300, 1e300)


def clutter_constant(
    weight: float, count: int, volume: FloatArray, dim: int, sigma: FloatArray | float = 1.0
) -> FloatArray:
    """`c = (2πσ²)^{d/2} w N / ((1 − w) V)`, (b,): what clutter of weight w in the volumes V (b,) adds to the sum of
    `exp(−r² / 2σ²)` over the N components of a mixture.
    """
    c = (2.0 * np.pi) ** (0.5 * dim) * sigma**dim * weight * count / ((1.0 - weight) * volume)
    return np.asarray(c)


def lengths(length: float | None, share: float, points: FloatArray) -> FloatArray:
    """A length for each cloud of points (b, n, d), (b,), u: `length`, or if it is None a
    share of the cloud's `typical_radius`, clipped so that its square is a float64.
    """
    if length is not None:
        return np.full(len(points), length, dtype=np.float64)
    return np.clip(share * typical_radius(points), 1e-150, 1e149)


def fit_pairs(
    pose: Pose, source: FloatArray, partners: FloatArray, weights: FloatArray
) -> tuple[Pose, ReasonArray, FloatArray]:
    """The weighted closed-form fit as one step from `pose`: the new pose, reasons,
    condition.

    If the pairs leave the rotation undefined, the current one is kept, only the centroids
    are brought together (the best translation for it), and the reason says why; without
    any weight the pose stays.
    """
    fitted, bad, reason, condition = closed_form_step(source, partners, weights)
    if not bad.any():
        return fitted, reason, condition
    R, t, scale = np.array(fitted.R), np.array(fitted.t), np.array(fitted.scale)
    R[bad], t[bad] = pose.R[bad], pose.t[bad]
    weighted = bad & (weights > 0.0).any(axis=1)
    share = weights[weighted] / weights[weighted].max(axis=1, keepdims=True)
    share /= share.sum(axis=1, keepdims=True)
    mean_p, mean_q = (np.einsum("bm,bmd->bd", share, x[weighted]) for x in (source, partners))
    t[weighted] = mean_q - (R[weighted] @ mean_p[..., None])[..., 0]
    scale[bad & ~weighted] = np.asarray(pose.scale)[bad & ~weighted]
    return Pose.trusted(R, t, scale), reason, condition
