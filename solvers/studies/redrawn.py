"""Repeated scans of one place from the same two stands, each with different rays and noise.

Three places with a known truth. In the room both end walls are within the scanner's
reach; in the corridor neither is; the hall looks the same after half a turn. `room` with
its end walls moved out becomes the corridor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.brief import brief
from solvers.core.kinds import of_kind
from solvers.core.pose import Pose
from solvers.scenes.scans import ranges

PLACES = ("room", "corridor", "hall")
REACH = 5.0
"""How far the scanner sees, in u."""
ENDS = {"room": 2.6, "corridor": 6.0, "hall": 2.8}
"""The distance of an end wall from the middle, in u."""
SIDES = {"room": 1.6, "corridor": 1.6, "hall": 1.7}
"""The distance of a side wall from the middle, in u."""
_MIDDLE = Pose.from_angle(np.radians([8.0, -6.0]), np.array([(-0.7, -0.25), (0.45, 0.2)]))
_ASIDE = Pose.from_angle(np.radians([8.0, -6.0]), np.array([(-1.5, -0.6), (-0.6, 0.3)]))
STANDS = {"room": _MIDDLE, "corridor": _MIDDLE, "hall": _ASIDE}
"""The poses from which the two scans are made, source and target, in room coordinates; in the hall away from its
middle.
"""
NO_ECHO = 1e3
"""Both coordinates of a target ray without echo, in u: beyond any gate, so lengths that a method would derive from the
target's size must be given.
"""


@dataclass(frozen=True, eq=False)
class Redrawn:
    """k scans from each of two stands.

    Attributes
    ----------
    source : ndarray of shape (k, rays, 2)
        In the robot's coordinates, world units; a ray without echo is at the origin.
    target : ndarray of shape (k, rays, 2)
        The same; a ray without echo is at `NO_ECHO`, where no gate reaches.
    weights : ndarray of shape (k, rays)
        Of the source points: 1 for an echo, 0 for none.
    truth : Pose
        From source to target coordinates, the same for all.
    walls : tuple of ndarray, each of shape (n, 2)
        Polylines in room coordinates.

    Examples
    --------
    >>> from solvers.uncertainty_study import redrawn
    >>> scans = redrawn("room", 3)
    >>> scans.source.shape, scans.weights.min()
    ((3, 90, 2), np.float64(1.0))
    """

    source: FloatArray
    target: FloatArray
    weights: FloatArray
    truth: Pose
    walls: tuple[FloatArray, ...]

    __repr__ = brief


def walls_of(place: str, end: float | None = None) -> tuple[FloatArray, ...]:
    """The walls of a place.

    Parameters
    ----------
    place : str
        "room", "corridor" or "hall".
    end : float, optional
        The distance of each end wall from the middle, in u, 1.5 to 20. None is the
        place's own.

    Returns
    -------
    tuple of ndarray, each of shape (n, 2)
        Closed polylines in room coordinates.

    Raises
    ------
    ValueError
        If there is no such place or the end is out of its range.

    Examples
    --------
    >>> from solvers.uncertainty_study import walls_of
    >>> float(walls_of("room", 4.0)[0].max())
    4.0
    """
    own = ENDS[validate.one_of(place, PLACES, "place")]
    x, y = own if end is None else validate.number(end, "end", 1.5, 20.0), SIDES[place]
    return (np.array([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)]),)


def redrawn(
    place: str = "room", count: int = 200, *, seed: int = 40, end: float | None = None, noise: float = 0.04,
    rays: int = 90,
) -> Redrawn:  # fmt: skip
    """Scan a place repeatedly from the same two stands.

    Each draw turns both fans of rays by random angles and measures ranges with fresh
    noise. The first draws are the same whatever `count` is.

    Parameters
    ----------
    place : str, default "room"
        "room", "corridor" or "hall".
    count : int, default 200
        How many draws.
    seed : int, default 40
        The seed of the random numbers.
    end : float, optional
        As for `walls_of`.
    noise : float, default 0.04
        σ of a range, in u.
    rays : int, default 90
        The number of rays in a scan, at least 12.

    Returns
    -------
    Redrawn
        The scans and the truth.

    Raises
    ------
    ValueError
        If an argument is out of its range.

    Examples
    --------
    >>> from solvers.uncertainty_study import redrawn
    >>> bool((redrawn("corridor", 2).weights == 0.0).any())
    True
    """
    walls = walls_of(place, end)
    k, m = validate.count(count, "count", 1), validate.count(rays, "rays", 12)
    sigma = validate.number(noise, "noise", 0.0)
    rng = np.random.default_rng(validate.count(seed, "seed"))
    phase, unit = np.empty((k, 2)), np.empty((k, 2, m))
    for i in range(k):
        phase[i], unit[i] = rng.uniform(size=2), rng.standard_normal((2, m))
    a, b = (np.concatenate(ends) for ends in ([w[:-1] for w in walls], [w[1:] for w in walls]))
    clouds, echoes = [], []
    for stand in (0, 1):
        angle = 2.0 * np.pi * (np.arange(m) + phase[:, stand, None]) / m
        ahead = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        pose = STANDS[place][stand]
        true = ranges(pose.t, ahead.reshape(-1, 2) @ pose.R.T, a, b).reshape(k, m)
        echo = true < REACH
        lengths = np.where(echo, true, 0.0) + sigma * unit[:, stand]
        clouds.append(lengths[..., None] * ahead)
        echoes.append(echo)
    source = np.where(echoes[0][..., None], clouds[0], 0.0)
    target = np.where(echoes[1][..., None], clouds[1], NO_ECHO)
    truth = STANDS[place][1].inverse().compose(STANDS[place][0])
    return Redrawn(source, target, echoes[0].astype(np.float64), truth, walls)


def starts(truth: Pose, count: int, *, heading: float = 3.0, shift: float = 0.15, seed: int = 40) -> Pose:
    """Random starts near the truth, as an odometer would give them.

    Parameters
    ----------
    truth : Pose
        The pose about which they spread, a single pose of the plane.
    count : int
        How many.
    heading : float, default 3.0
        The standard deviation of the angle, degrees.
    shift : float, default 0.15
        That of each coordinate of the scanner's position, in u.
    seed : int, default 40
        The seed of the random numbers.

    Returns
    -------
    Pose
        Of shape (count,).

    Raises
    ------
    ValueError
        If `truth` is not a single pose of the plane, or a number out of its range.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.uncertainty_study import starts
    >>> starts(Pose.identity(), 4).batch
    (4,)
    """
    of_kind(truth, Pose, "truth")
    if truth.batch:
        raise ValueError(f"truth: expected a single pose, got a batch of shape {truth.batch}")
    validate.pose(truth, 2, "truth", "the starts are of the plane")
    turn, far = validate.number(heading, "heading", 0.0), validate.number(shift, "shift", 0.0)
    rng = np.random.default_rng([validate.count(seed, "seed"), 1])
    unit = rng.standard_normal((validate.count(count, "count", 1), 3))
    motions = Pose.from_angle(np.radians(turn) * unit[:, 0], far * unit[:, 1:])
    return truth.compose(motions)
