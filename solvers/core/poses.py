"""Joining several poses into one batch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers.core.arrays import FloatArray
from solvers.core.kinds import of_kind, several
from solvers.core.pose import Pose


def stacked(poses: Sequence[Pose]) -> Pose:
    """Stack poses of one shape along a new leading axis.

    Parameters
    ----------
    poses : sequence of Pose of shape (...)
        At least one, all of one shape and dimension.

    Returns
    -------
    Pose
        The batch, of shape (k, ...).

    Raises
    ------
    ValueError
        If `poses` is not a sequence of poses, is empty, or they differ in shape or
        dimension.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.posegraph import stacked
    >>> stacked([Pose.identity(), Pose.from_angle(0.5, (1.0, 2.0))]).t
    array([[0., 0.],
           [1., 2.]])
    """
    members = _poses(poses)
    shapes = [p.R.shape for p in members]
    if len(set(shapes)) > 1:
        k = next(k for k, shape in enumerate(shapes) if shape != shapes[0])
        raise ValueError(f"poses: {_differ(members, k)}; they must be alike")
    return Pose.trusted(*(np.stack(part) for part in _parts(members)))


def concatenated(parts: Sequence[Pose]) -> Pose:
    """Concatenate batches of poses along their first axis.

    Parameters
    ----------
    parts : sequence of Pose of shape (n, ...)
        At least one; they may differ only in n, which may be 0.

    Returns
    -------
    Pose
        All poses of the parts, as one batch.

    Raises
    ------
    ValueError
        If `parts` is not a sequence of poses or is empty, if one is a single pose, or
        if they differ in more than n.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.posegraph import concatenated
    >>> concatenated([Pose.identity(batch=(1,)), Pose.from_angle([0.1, 0.2])]).angle
    array([0. , 0.1, 0.2])
    """
    batches = _poses(parts, "parts")
    for k, pose in enumerate(batches):
        if not pose.batch:
            raise ValueError(f"parts: number {k} is a single pose; stacked joins single poses")
        if pose.R.shape[1:] != batches[0].R.shape[1:]:
            raise ValueError(f"parts: {_differ(batches, k)}; they may differ in the first axis alone")
    return Pose.trusted(*(np.concatenate(part) for part in _parts(batches)))


def _poses(values: Sequence[Pose], name: str = "poses") -> tuple[Pose, ...]:
    members = several(values, name, "poses")
    if not members:
        raise ValueError(f"{name}: is empty; at least one pose is needed")
    return tuple(of_kind(pose, Pose, name) for pose in members)


def _parts(poses: Sequence[Pose]) -> tuple[list[FloatArray], list[FloatArray], list[FloatArray]]:
    return [p.R for p in poses], [p.t for p in poses], [np.asarray(p.scale) for p in poses]


def _differ(poses: Sequence[Pose], k: int) -> str:
    first, second = (f"{p.batch} in {p.dim} dimensions" for p in (poses[0], poses[k]))
    return f"number 0 is of shape {first}, number {k} of {second}"
