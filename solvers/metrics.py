"""How far an estimate is from the truth, and how well it fits its pairs: two different
questions.

Every metric has the shape of the batch; for a single pose it is a numpy scalar.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.kinds import of_kind
from solvers.core.pose import Pose
from solvers.core.rotations import angle


def rre(pose: Pose, truth: Pose) -> FloatArray:
    """Relative rotation error: the angle of `R R*ᵀ`.

    Parameters
    ----------
    pose : Pose
        The estimate, of shape (...).
    truth : Pose
        The true pose, of a shape that broadcasts against it.

    Returns
    -------
    ndarray of shape (...)
        Radians, from 0 to π.

    Raises
    ------
    ValueError
        If `pose` or `truth` is not a Pose, or the poses do not broadcast, or are not
        both of 2 or of 3 dimensions.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.metrics import rre
    >>> estimate = Pose.from_angle(np.radians(170.0))
    >>> truth = Pose.from_angle(np.radians(-170.0))
    >>> np.degrees(rre(estimate, truth)).round(6)
    np.float64(20.0)
    """
    _one_space(pose, truth)
    error: FloatArray = np.abs(angle(pose.R @ truth.R.swapaxes(-1, -2)))
    return error


def rte(pose: Pose, truth: Pose) -> FloatArray:
    """Relative translation error: ‖t − t*‖.

    It depends on where the world's origin lies.

    Parameters
    ----------
    pose : Pose
        The estimate, of shape (...).
    truth : Pose
        The true pose, of a shape that broadcasts against it.

    Returns
    -------
    ndarray of shape (...)
        World units.

    Raises
    ------
    ValueError
        If `pose` or `truth` is not a Pose, or the poses do not broadcast, or are of
        different dimensions.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.metrics import rte
    >>> float(rte(Pose.from_angle(0.0, (3.0, 4.0)), Pose.identity()))
    5.0
    """
    _one_space(pose, truth)
    distance: FloatArray = np.linalg.norm(pose.t - truth.t, axis=-1)
    return distance[()]


def scale_error(pose: Pose, truth: Pose) -> FloatArray:
    """The relative error of the scale: |s / s* − 1|.

    Parameters
    ----------
    pose : Pose
        The estimate, of shape (...).
    truth : Pose
        The true pose, of a shape that broadcasts against it.

    Returns
    -------
    ndarray of shape (...)
        A fraction, 0 for the true scale.

    Raises
    ------
    ValueError
        If `pose` or `truth` is not a Pose, or the poses do not broadcast, or are of
        different dimensions.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.metrics import scale_error
    >>> scale_error(Pose.from_angle(0.0, scale=0.3), Pose.identity()).round(6)
    np.float64(0.7)
    """
    _one_space(pose, truth)
    error: FloatArray = np.abs(np.asarray(pose.scale) / np.asarray(truth.scale) - 1.0)
    return error[()]


def point_error(pose: Pose, truth: Pose, points: ArrayLike) -> FloatArray:
    """Root mean square distance between where two poses put the same points.

    Parameters
    ----------
    pose : Pose
        The estimate, of shape (...).
    truth : Pose
        The true pose, of a shape that broadcasts against it.
    points : array_like of shape (..., n, d)
        The points, in source coordinates.

    Returns
    -------
    ndarray of shape (...)
        World units.

    Raises
    ------
    ValueError
        If `pose` or `truth` is not a Pose, or `points` is not a finite cloud of the
        poses' dimension, or shapes do not broadcast.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.metrics import point_error
    >>> pose = Pose.from_angle(0.0, (0.3, 0.4))
    >>> point_error(pose, Pose.identity(), [[0.0, 0.0], [5.0, 1.0]]).round(6)
    np.float64(0.5)
    """
    _one_space(pose, truth)
    p = validate.cloud(points, "points", pose.dim)
    validate.batch_shape(pose=pose.batch, truth=truth.batch, points=p.shape[:-2])
    return _root_mean_square(pose.apply(p) - truth.apply(p), np.ones(p.shape[-2]))


def residuals(pose: Pose, source: ArrayLike, target: ArrayLike) -> FloatArray:
    """The distance between each moved source row and its target row.

    Parameters
    ----------
    pose : Pose
        The pose, of shape (...).
    source : array_like of shape (..., n, d)
        The points that the pose moves.
    target : array_like of shape (..., n, d)
        Their partners, row by row.

    Returns
    -------
    ndarray of shape (..., n)
        World units.

    Raises
    ------
    ValueError
        If `pose` is not a Pose, or the clouds are not finite, not matched row by row,
        or do not fit the pose.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.metrics import residuals
    >>> residuals(Pose.identity(), [[0.0, 0.0], [1.0, 0.0]], [[0.0, 2.0], [1.0, 0.0]])
    array([2., 0.])
    """
    distance: FloatArray = np.linalg.norm(_residuals(pose, source, target), axis=-1)
    return distance


def rms(
    pose: Pose, source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None
) -> FloatArray:
    """The weighted root mean square residual of matched rows.

    `√(Σ wᵢ rᵢ² / Σ wᵢ)`, where r are the `residuals`: a fit of known pairs minimises
    it. It says how well the pose fits the pairs, and nothing about how close the pose
    is to the truth.

    Parameters
    ----------
    pose : Pose
        The pose, of shape (...).
    source : array_like of shape (..., n, d)
        The points that the pose moves.
    target : array_like of shape (..., n, d)
        Their partners, row by row.
    weights : array_like of shape (..., n), optional
        Weights of the pairs, not negative. None means all ones.

    Returns
    -------
    ndarray of shape (...)
        World units; zero where all weights are zero.

    Raises
    ------
    ValueError
        If `pose` is not a Pose, or the clouds are not finite, not matched row by row,
        or do not fit the pose, or if a weight is negative.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.metrics import rms
    >>> p, q = [[0.0, 0.0], [1.0, 0.0]], [[0.0, 2.0], [1.0, 0.0]]
    >>> rms(Pose.identity(), p, q).round(4)
    np.float64(1.4142)
    >>> float(rms(Pose.identity(), p, q, weights=[0.0, 1.0]))
    0.0
    """
    gaps = _residuals(pose, source, target)
    w = validate.weights(weights, gaps.shape[-2])
    validate.batch_shape(weights=w.shape[:-1], residuals=gaps.shape[:-2])
    return _root_mean_square(gaps, w)


def _residuals(pose: Pose, source: ArrayLike, target: ArrayLike) -> FloatArray:
    """The vector from each target row to its moved source row, (..., n, d)."""
    d = of_kind(pose, Pose, "pose").dim
    p, q = validate.matched(source, target)
    if p.shape[-1] != d:
        raise ValueError(f"pose: moves points in {d} dimensions, the clouds have {p.shape[-1]}")
    validate.batch_shape(pose=pose.batch, source=p.shape[:-2], target=q.shape[:-2])
    return pose.apply(p) - q


def _root_mean_square(offsets: FloatArray, weights: FloatArray) -> FloatArray:
    squares = np.einsum("...nd,...nd->...n", offsets, offsets)
    total = weights.sum(axis=-1)
    root: FloatArray = np.sqrt((weights * squares).sum(axis=-1) / np.where(total > 0.0, total, 1.0))
    return root[()]


def _one_space(pose: Pose, truth: Pose) -> None:
    if of_kind(pose, Pose, "pose").dim != of_kind(truth, Pose, "truth").dim:
        raise ValueError(f"truth: moves points in {truth.dim} dimensions, the pose in {pose.dim}")
    validate.batch_shape(pose=pose.batch, truth=truth.batch)
