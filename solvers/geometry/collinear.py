"""Collinear pairs: the poses that fit them equally well.

Collinear points leave the rotation about their line free. With p̃ᵢ = aᵢ u about the
centroid, `H = Σ p̃ᵢ q̃ᵢᵀ = u hᵀ` has rank one, and the objective of `fit_rigid` depends on
R by `hᵀ R u` alone: every rotation that takes u to v = h/‖h‖ is an optimum, even if the
partners are noisy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.extent import ROUNDING
from solvers.core.numbers import finite, numbers
from solvers.core.pose import Pose

_NEAR = 1e-7  # as a fraction of the points' spread: points nearer to the line are on it, as in the fit of pairs


def poses_about_line(source: ArrayLike, target: ArrayLike, angle: ArrayLike = 0.0) -> Pose:
    """The optimal poses of collinear pairs in 3-D, one for each value of the free angle.

    Parameters
    ----------
    source : array_like of shape (n, 3)
        Points on a line, in world units.
    target : array_like of shape (n, 3)
        Their partners, row by row, which noise may have moved off a line.
    angle : array_like of shape (...), default 0.0
        The rotation about the target's line in radians, anticlockwise when looking back
        along it, from the point farthest from the first point towards the first; 0 is
        the smallest rotation that lays one line on the other.

    Returns
    -------
    Pose
        Poses of the shape of `angle`, all with the same minimal sum of squares.

    Raises
    ------
    ValueError
        If the clouds are not matched rows of 3-D points, the source points do not lie
        on a line or are all equal, the partners do not determine the line's direction,
        or an angle is not finite.

    References
    ----------
    .. [1] S. Umeyama, "Least-squares estimation of transformation parameters between
       two point patterns", 1991: the trace that is maximised, here of rank one.
       doi:10.1109/34.88573

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.collinear import poses_about_line
    >>> line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]])
    >>> upright = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 3.0]])
    >>> poses = poses_about_line(line, upright, np.radians([0.0, 90.0, 180.0]))
    >>> np.abs(poses.apply(line) - upright).max().round(12)
    np.float64(0.0)
    >>> poses.apply([[0.0, 1.0, 0.0]])[:, 0].round(6) + 0.0
    array([[ 0.,  1.,  0.],
           [-1.,  0.,  0.],
           [ 0., -1.,  0.]])
    """
    p, q = validate.matched(validate.cloud(source, "source", 3), validate.cloud(target, "target", 3))
    if p.ndim != 2:
        raise ValueError(f"source: expected one cloud of shape (n, 3), got {p.shape}")
    turn = finite(numbers(angle, "angle"), "angle")
    middle, centre = p.mean(axis=0), q.mean(axis=0)
    along, apart = _of_size_one(p - middle), _of_size_one(q - centre)
    _, spread, axes = np.linalg.svd(along)
    # Far from the origin the points themselves are rounded.
    unit = np.ldexp(1.0, np.frexp(np.abs(p - middle).max(initial=0.0))[1])
    rounding = ROUNDING * np.sqrt(len(p)) * float(np.abs(p).max(initial=0.0) / unit)
    if spread[0] <= rounding or (len(spread) > 1 and spread[1] > max(_NEAR * spread[0], rounding)):
        raise ValueError("source: expected different points in a line")
    ahead = along[np.argmax(np.linalg.norm(along - along[0], axis=1))] - along[0]
    u = axes[0] * np.sign(axes[0] @ ahead)  # a singular vector's own sign depends on the machine
    h = (along @ u) @ apart
    length = float(np.linalg.norm(h))
    if length <= 1e-9 * spread[0] * float(np.linalg.norm(apart)):
        raise ValueError("target: the partners say nothing of the line's direction")
    v = h / length
    least = Pose.from_rotvec(_least_turn(u, v)).R
    spun = Pose.from_rotvec(turn[..., None] * v).R
    R = spun @ least
    return Pose.trusted(R, centre - R @ middle)


def _of_size_one(points: FloatArray) -> FloatArray:
    """The points divided by a power of two, so that none of their products overflows or underflows."""
    scaled: FloatArray = np.ldexp(points, -np.frexp(np.abs(points).max(initial=0.0))[1])
    return scaled


def _least_turn(u: FloatArray, v: FloatArray) -> FloatArray:
    """The rotation vector of the smallest rotation that takes the unit vector u to v."""
    across = np.cross(u, v)
    sine = float(np.linalg.norm(across))
    if sine < 1e-300:
        across = np.cross(u, np.eye(3)[np.argmin(np.abs(u))])  # any perpendicular axis will do
    across = across - (across @ u) * u  # for opposite directions the product is mostly rounding
    turn: FloatArray = np.arctan2(sine, float(u @ v)) * across / np.linalg.norm(across)
    return turn
