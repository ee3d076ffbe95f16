"""Two scans of a hall in 3-D: the walls of the planar room, raised to their height, and
the floor between them.

Seen from above, the floor covers the walls; a slice at half the height shows the room alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.brief import brief
from solvers.core.pose import Pose
from solvers.scenes.rooms import room

HEIGHT = 2.6  # u, of the walls
FLOOR = 0.03  # u, σ of the floor's height


@dataclass(frozen=True, eq=False)
class Hall:
    """Two scans of a hall, z upwards.

    Attributes
    ----------
    source : ndarray of shape (m, 3)
        The cloud to move, in world units.
    target : ndarray of shape (n, 3)
        The fixed cloud.
    truth : Pose
        The pose that maps source to target coordinates.

    Examples
    --------
    >>> from solvers.hall import hall
    >>> scans = hall(floor=100)
    >>> scans.source.shape[1], scans.truth.dim
    (3, 3)
    """

    source: FloatArray
    target: FloatArray
    truth: Pose

    __repr__ = brief


def hall(seed: int = 40, floor: int = 250) -> Hall:
    """A hall whose source is turned by −20° about the vertical and moved.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    floor : int, default 250
        The number of floor points in each scan.

    Returns
    -------
    Hall
        The two scans and the truth.

    Raises
    ------
    ValueError
        If the seed or the number of points is not an integer of 0 or more.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.hall import hall
    >>> scans = hall(floor=100)
    >>> scans.source.shape, np.degrees(scans.truth.angle).round(6)
    ((232, 3), np.float64(20.0))
    """
    validate.count(floor, "floor")
    scene, random = room("noise", seed=seed), np.random.default_rng(seed)

    def raised(walls: FloatArray) -> FloatArray:
        below = np.column_stack([random.uniform(walls.min(axis=0), walls.max(axis=0), (floor, 2))])
        heights = [random.uniform(0.0, HEIGHT, len(walls)), random.normal(0.0, FLOOR, floor)]
        return np.column_stack([np.concatenate([walls, below]), np.concatenate(heights)])

    turn = np.eye(3)
    turn[:2, :2] = Pose.from_angle(np.radians(20.0)).R
    truth = Pose.trusted(turn, np.array([0.7, -0.4, 0.0]))
    source, target = raised(scene.truth.apply(scene.source)), raised(scene.target)
    return Hall(truth.inverse().apply(source), target, truth)
