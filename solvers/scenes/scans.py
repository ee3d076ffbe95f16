"""Two scans of one room by a robot at two poses, simulated by casting rays at the walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.brief import brief
from solvers.core.pose import Pose
from solvers.scenes.rooms import ROOM

PILLARS = np.array([(-0.6, -1.95), (1.6, 1.5)])
_SQUARE = 0.3 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
WALLS = (np.vstack([ROOM, ROOM[:1]]), *(pillar + _SQUARE for pillar in PILLARS))
for _wall in (PILLARS, *WALLS):
    _wall.flags.writeable = False


@dataclass(frozen=True, eq=False)
class TwoScans:
    """Two scans of one room, and where they were made.

    Each is in the robot's own coordinates: x ahead, y to the left. No point of one is
    the partner of a point of the other.

    Attributes
    ----------
    source : ndarray of shape (k, 2)
        The first scan, in world units.
    target : ndarray of shape (k, 2)
        The second.
    source_pose : Pose
        From the robot's coordinates to the room's, at the first scan.
    target_pose : Pose
        The same at the second.
    walls : tuple of ndarray, each of shape (n, 2)
        Polylines in room coordinates, each closed: the room and the pillars in it.

    Examples
    --------
    >>> from solvers.scans import two_scans
    >>> scans = two_scans()
    >>> scans.truth.batch, len(scans.walls)
    ((), 3)
    """

    source: FloatArray
    target: FloatArray
    source_pose: Pose
    target_pose: Pose
    walls: tuple[FloatArray, ...]

    __repr__ = brief

    @property
    def truth(self) -> Pose:
        """The pose from source to target coordinates: `T = X_t⁻¹ ∘ X_s`."""
        return self.target_pose.inverse().compose(self.source_pose)


def two_scans(
    *, seed: int = 40, noise: float = 0.03, turn: float = 50.0, distance: float = 2.0, rays: int = 90
) -> TwoScans:
    """Two sweeps of a range scanner in one room, with the robot driving in between.

    The seed decides where in the room it was, which way it drove, where each sweep
    began, and the noise; the other arguments leave these draws alone, so a noise slider
    stretches one draw.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    noise : float, default 0.03
        σ of the measured range, in u.
    turn : float, default 50.0
        The angle of the truth in degrees; the robot turned by its negative.
    distance : float, default 2.0
        How far the robot drove between the sweeps, in u, 0 to 3.5 (which keeps it in
        the room).
    rays : int, default 90
        The number of rays of a sweep over the full circle, at least 3.

    Returns
    -------
    TwoScans
        Both sweeps, `rays` points each, and their poses.

    Raises
    ------
    ValueError
        If the seed or the noise is negative, the turn not a finite number, the distance
        out of its range, or the rays too few.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.scans import two_scans
    >>> scans = two_scans(turn=30.0, rays=60)
    >>> scans.source.shape, np.degrees(scans.truth.angle).round(6)
    ((60, 2), np.float64(30.0))
    """
    sigma = validate.number(noise, "noise", 0.0)
    turn_angle = np.radians(validate.number(turn, "turn"))
    validate.number(distance, "distance", 0.0, 3.5)
    validate.count(rays, "rays", 3)
    rng = np.random.default_rng(validate.count(seed, "seed"))
    begin = np.array([-1.9, -0.7]) + rng.uniform((-0.6, -0.4), (0.6, 0.4))
    course = np.radians(rng.uniform(-15.0, 15.0))
    phases, unit = rng.uniform(size=2), rng.standard_normal((2, rays))

    end = begin + distance * np.array([np.cos(course), np.sin(course)])
    a, b = (np.concatenate(ends) for ends in ([w[:-1] for w in WALLS], [w[1:] for w in WALLS]))
    poses = Pose.from_angle(course, begin), Pose.from_angle(course - turn_angle, end)
    clouds = []
    for pose, phase, draw in zip(poses, phases, unit, strict=True):
        angle = 2.0 * np.pi * (np.arange(rays) + phase) / rays
        ahead = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        lengths = ranges(pose.t, ahead @ pose.R.T, a, b) + sigma * draw
        clouds.append(lengths[:, None] * ahead)
    return TwoScans(clouds[0], clouds[1], *poses, WALLS)


def ranges(origin: FloatArray, directions: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """How far each ray goes until it meets a wall.

    Parameters
    ----------
    origin : ndarray of shape (2,)
        Where the rays begin, in u.
    directions : ndarray of shape (k, 2)
        Their directions, of length 1.
    a : ndarray of shape (n, 2)
        Where the walls begin.
    b : ndarray of shape (n, 2)
        Where they end.

    Returns
    -------
    ndarray of shape (k,)
        World units; infinite where a ray meets none.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.scans import ranges
    >>> wall = np.array([[2.0, -1.0]]), np.array([[2.0, 1.0]])
    >>> ranges(np.zeros(2), np.array([[1.0, 0.0], [-1.0, 0.0]]), *wall)
    array([ 2., inf])
    """
    a, along = a - origin, b - a
    # origin + r d = a + u along: solve for r and u by crossing with `along` and with d.
    across = directions[:, :1] * along[:, 1] - directions[:, 1:] * along[:, 0]
    parallel = np.abs(across) < 1e-12
    safe = np.where(parallel, 1.0, across)
    r = (a[:, 0] * along[:, 1] - a[:, 1] * along[:, 0]) / safe
    u = (a[:, 0] * directions[:, 1:] - a[:, 1] * directions[:, :1]) / safe
    hit = ~parallel & (r > 0.0) & (u > -1e-9) & (u < 1.0 + 1e-9)
    nearest: FloatArray = np.where(hit, r, np.inf).min(axis=1)
    return nearest
