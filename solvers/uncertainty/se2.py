"""Small motions of the plane: the exponential map of SE(2), its inverse, and the adjoint.

A twist is (angle, x, y): radians and world units, in this order everywhere in `solvers.uncertainty`. `exp` moves with
constant angular and linear velocity for one unit of time, so a twist with an angle follows an arc.

Sources: Barfoot & Furgale 2014, Associating uncertainty with three-dimensional poses
for use in estimation problems (perturbations through the exponential map); Long et al.
2012, The banana distribution is Gaussian (the planar formulas).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.kinds import of_kind
from solvers.core.numbers import finite, numbers
from solvers.core.pose import Pose


def exp(twist: ArrayLike) -> Pose:
    """The motion that a twist generates.

    Parameters
    ----------
    twist : array_like of shape (..., 3)
        Angle in radians, then x and y in world units.

    Returns
    -------
    Pose
        The motions, of shape (...).

    Raises
    ------
    ValueError
        If the twists are not finite numbers of shape (..., 3).

    Examples
    --------
    A quarter turn along an arc of radius 1:

    >>> import numpy as np
    >>> from solvers.uncertainty import exp
    >>> exp([np.pi / 2, np.pi / 2, 0.0])
    Pose(angle=90°, t=(1, 1), scale=1)
    """
    xi = finite(numbers(twist, "twist"), "twist")
    if xi.shape[-1:] != (3,):
        raise ValueError(f"twist: expected shape (..., 3), got {xi.shape}")
    angle, x, y = xi[..., 0], xi[..., 1], xi[..., 2]
    ahead = np.sinc(angle / np.pi)
    aside = 0.5 * angle * np.square(np.sinc(0.5 * angle / np.pi))
    with np.errstate(under="ignore"):  # a tiny angle's share of a shift is zero, even if the caller has numpy raise
        shift = np.stack([ahead * x - aside * y, aside * x + ahead * y], axis=-1)
    return Pose.from_angle(angle, shift)


def log(pose: Pose) -> FloatArray:
    """The shortest twist that generates a motion.

    Parameters
    ----------
    pose : Pose
        Rigid motions of the plane, of shape (...).

    Returns
    -------
    ndarray of shape (..., 3)
        Angle in [−π, π], then x and y in world units.

    Raises
    ------
    ValueError
        If `pose` is not a Pose, not rigid or not of the plane.

    Examples
    --------
    >>> from solvers.uncertainty import exp, log
    >>> log(exp([0.3, 1.0, -2.0])).round(6)
    array([ 0.3,  1. , -2. ])
    """
    angle = np.asarray(rigid(pose).angle)
    half = 0.5 * angle
    along = np.cos(half) / np.sinc(half / np.pi)
    x, y = pose.t[..., 0], pose.t[..., 1]
    return np.stack([angle, along * x + half * y, along * y - half * x], axis=-1)


def adjoint(pose: Pose) -> FloatArray:
    """The matrix that takes a twist from one side of a pose to the other.

    `T ∘ exp(ξ) = exp(Ad(T) ξ) ∘ T`: a small motion in source coordinates, expressed in
    target coordinates.

    Parameters
    ----------
    pose : Pose
        Rigid motions T of the plane, of shape (...).

    Returns
    -------
    ndarray of shape (..., 3, 3)
        Over (angle, x, y).

    Raises
    ------
    ValueError
        If `pose` is not a Pose, not rigid or not of the plane.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.uncertainty import adjoint
    >>> adjoint(Pose.from_angle(np.pi / 2, (2.0, 0.0))) @ [0.1, 0.0, 0.0]
    array([ 0.1,  0. , -0.2])
    """
    matrix = np.zeros((*rigid(pose).batch, 3, 3))
    matrix[..., 0, 0] = 1.0
    matrix[..., 1:, 1:] = pose.R
    matrix[..., 1, 0], matrix[..., 2, 0] = pose.t[..., 1], -pose.t[..., 0]
    return matrix


def shifted(centre: FloatArray) -> FloatArray:
    """The adjoint of the shift that puts `centre` (..., 2) at the origin, (..., 3, 3): it takes a twist about the
    frame's origin to one about `centre`.
    """
    return adjoint(Pose.trusted(np.eye(2), -np.asarray(centre)))


def place(point: ArrayLike) -> FloatArray:
    """`point` as the coordinates (2,) of a point of the plane; else a ValueError."""
    p = finite(numbers(point, "point"), "point")
    if p.shape != (2,):
        raise ValueError(f"point: expected shape (2,), got {p.shape}")
    return p


def triples(values: ArrayLike, name: str) -> FloatArray:
    """`values` as rows of three finite numbers, (n, 3); else a ValueError."""
    rows = finite(numbers(values, name), name)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"{name}: expected shape (n, 3), got {rows.shape}")
    return rows


def rigid(pose: Pose) -> Pose:
    """`pose` if it is a rigid motion of the plane; else a ValueError."""
    validate.pose(of_kind(pose, Pose, "pose"), 2, "pose", "a twist is planar")
    return validate.unscaled(pose, "pose", "a twist leads to a rigid motion, of scale 1")
