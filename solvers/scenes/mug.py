"""A mug in 3-D, seen twice: a wall, a floor and a handle, by formula.

It stands upright in the target's coordinates, with its middle at the origin and its
handle along x. Without the handle it is a surface of revolution, which looks the same
after any turn about its axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.brief import brief
from solvers.core.pose import Pose
from solvers.scenes.polyline import lengths, places

RADIUS = 0.9
"""Radius of the wall and the floor, u."""
HEIGHT = 2.0
GRIP = (0.75, 0.6)
"""How far the handle's middle line reaches from the wall, and half its height, u: half an ellipse."""
TUBE = 0.11
"""Radius of the handle's tube, u."""
TRUTH = Pose.from_rotvec(np.radians(65.0) * np.array([2.0, -1.0, 2.0]) / 3.0, (0.5, -0.4, 0.3))
AXIS = np.array([2.0, 1.0, -2.0]) / 3.0
"""The axis that `mug_start` turns about."""
AXIS.flags.writeable = False


def _at(degrees: float, height: float) -> tuple[float, float, float]:
    """A place on the wall, at an angle from the handle."""
    turn = np.radians(degrees)
    return RADIUS * float(np.cos(turn)), RADIUS * float(np.sin(turn)), height


PAIRS: Mapping[str, FloatArray] = MappingProxyType(
    {
        "line": np.array([_at(-70.0, -0.85), _at(-70.0, 0.15), _at(-70.0, 0.85)]),
        "four": np.array([(RADIUS + GRIP[0] + TUBE, 0.0, 0.0), _at(110.0, 1.0), _at(-130.0, 1.0), _at(-80.0, -1.0)]),
    }
)
"""Places on the mug that `mug_pairs` pairs: three in a line up its wall; four that are not coplanar."""
for _places in PAIRS.values():
    _places.flags.writeable = False


@dataclass(frozen=True, eq=False)
class Mug:
    """Two clouds of the mug.

    Attributes
    ----------
    seed : int
        The seed of the random numbers.
    source : ndarray of shape (m, 3)
        The cloud to move, in world units.
    target : ndarray of shape (n, 3)
        The fixed cloud.
    truth : Pose
        The pose that maps source to target coordinates.
    outline : tuple of ndarrays of shape (k, 3)
        Lines of the mug in the source's coordinates: its rim, its foot, and the middle
        of its handle if it has one.

    Examples
    --------
    >>> from solvers.mug_scene import mug
    >>> scene = mug(overlap=0.5)
    >>> scene.source.shape, scene.target.shape, len(scene.outline)
    ((228, 3), (223, 3), 3)
    """

    seed: int
    source: FloatArray
    target: FloatArray
    truth: Pose
    outline: tuple[FloatArray, ...]

    __repr__ = brief


def mug(
    seed: int = 40, *, points: int = 320, noise: float = 0.02, overlap: float = 1.0, handle: bool = True
) -> Mug:
    """A mug sampled twice, independently; no point has a partner.

    More noise stretches the same draw, and less overlap takes points away: those left
    stay where they were.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    points : int, default 320
        Points of a cloud that sees all of the mug, 20 or more; shared out by area.
    noise : float, default 0.02
        σ of each coordinate of both clouds, in u.
    overlap : float, default 1.0
        The fraction of a cloud's view around the axis that the other sees as well, 0 to
        1. Together they see all of the mug; the handle lies where both look.
    handle : bool, default True
        Whether it has a handle.

    Returns
    -------
    Mug
        The two clouds and the truth, `TRUTH`.

    Raises
    ------
    ValueError
        If the seed or the noise is negative, the count or the overlap out of its range,
        or `handle` not True or False.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import register
    >>> from solvers.metrics import rre
    >>> from solvers.mug_scene import mug, mug_start
    >>> scene = mug()
    >>> start = mug_start(30.0, 0.3)
    >>> result = register(scene.source, scene.target, "point-to-plane", start=start)
    >>> result.status.label, bool(np.degrees(rre(result.pose, scene.truth)) < 1.0)
    ('converged', True)
    """
    validate.count(points, "points", 20)
    sigma = validate.number(noise, "noise", 0.0)
    share = validate.number(overlap, "overlap", 0.0, 1.0)
    handle = validate.flag(handle, "handle")
    rng = np.random.default_rng(validate.count(seed, "seed"))
    half = np.pi / (2.0 - share)  # half the angle that a cloud sees; both together see the whole turn
    clouds = []
    for middle in (np.pi - half, half - np.pi):
        cloud = _surface(rng, points, handle)
        unit = rng.standard_normal(cloud.shape)
        off = np.angle(np.exp(1j * (np.arctan2(cloud[:, 1], cloud[:, 0]) - middle)))
        clouds.append((cloud + sigma * unit)[np.abs(off) <= half + 1e-12])
    back = TRUTH.inverse()
    return Mug(seed, back.apply(clouds[0]), clouds[1], TRUTH, tuple(back.apply(line) for line in _lines(handle)))


def mug_pairs(name: str = "line", *, seed: int = 40, noise: float = 0.0) -> Mug:
    """A few places on the mug whose partners are known: row i with row i.

    Parameters
    ----------
    name : str, default "line"
        "line": three in a line up the wall. "four": four that are not coplanar.
    seed : int, default 40
        The seed of the noise.
    noise : float, default 0.0
        σ of each coordinate of the target, in u.

    Returns
    -------
    Mug
        The paired clouds and the truth, `TRUTH`.

    Raises
    ------
    ValueError
        If the name is unknown, or the seed or the noise negative.

    Examples
    --------
    >>> from solvers import register
    >>> from solvers.mug_scene import mug_pairs
    >>> pairs = mug_pairs("line")
    >>> result = register(pairs.source, pairs.target, "kabsch")
    >>> result.status.label, result.reason
    ('degenerate', 'the source points are collinear: the rotation about their line is free')
    """
    validate.one_of(name, tuple(PAIRS), "name")
    sigma = validate.number(noise, "noise", 0.0)
    rng = np.random.default_rng(validate.count(seed, "seed"))
    places, back = PAIRS[name], TRUTH.inverse()
    target = places + sigma * rng.standard_normal(places.shape)
    return Mug(seed, back.apply(places), target, TRUTH, tuple(back.apply(line) for line in _lines(True)))


def mug_start(degrees: float = 40.0, offset: float = 0.4) -> Pose:
    """A start near the truth: the mug turned about its middle, then moved.

    Parameters
    ----------
    degrees : float, default 40.0
        The rotation's angle, about `AXIS`.
    offset : float, default 0.4
        How far the middle lies from its true place, in u.

    Returns
    -------
    Pose
        The start.

    Raises
    ------
    ValueError
        If a number is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.metrics import rre
    >>> from solvers.mug_scene import TRUTH, mug_start
    >>> np.degrees(rre(mug_start(40.0), TRUTH)).round(6)
    np.float64(40.0)
    """
    turn = np.radians(validate.number(degrees, "degrees"))
    aside = validate.number(offset, "offset") * np.array([-2.0, 2.0, 1.0]) / 3.0
    return Pose.from_rotvec(turn * AXIS, aside).compose(TRUTH)


def _arc() -> FloatArray:
    """The middle line of the handle, (121, 3), from its upper end to its lower."""
    turn = np.linspace(0.5 * np.pi, -0.5 * np.pi, 121)
    return np.column_stack([RADIUS + GRIP[0] * np.cos(turn), np.zeros(121), GRIP[1] * np.sin(turn)])


def _lines(handle: bool) -> tuple[FloatArray, ...]:
    """Rim, foot and handle, in the mug's own coordinates."""
    turn = np.linspace(0.0, 2.0 * np.pi, 49)
    ring = RADIUS * np.column_stack([np.cos(turn), np.sin(turn)])
    circles = [np.column_stack([ring, np.full(49, z)]) for z in (0.5 * HEIGHT, -0.5 * HEIGHT)]
    return (*circles, _arc()[::6]) if handle else tuple(circles)


def _surface(rng: np.random.Generator, points: int, handle: bool) -> FloatArray:
    """Places spread evenly over the mug, (points, 3).

    Each part is a spiral whose next place lies a golden angle on, with a random beginning
    and a jitter of a fraction of the distance between neighbours.
    """
    arc = _arc()
    length = lengths(arc)[-1]
    areas = np.array([2.0 * np.pi * RADIUS * HEIGHT, np.pi * RADIUS**2, 2.0 * np.pi * TUBE * length * handle])
    ends = np.round(np.cumsum(areas) / areas.sum() * points).astype(np.int64)
    wall, floor, grip = np.diff(ends, prepend=0).tolist()

    def spiral(count: int) -> tuple[FloatArray, FloatArray]:
        """Fractions of the part's extent, and angles."""
        step = rng.uniform(0.0, 1.0, (2, count))
        turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count) + rng.uniform(0.0, 2.0 * np.pi) + 0.2 * step[1]
        return (np.arange(count) + step[0]) / max(count, 1), turn

    height, turn = spiral(wall)
    sides = np.column_stack([RADIUS * np.cos(turn), RADIUS * np.sin(turn), HEIGHT * (height - 0.5)])
    part, turn = spiral(floor)
    reach = RADIUS * np.sqrt(part)
    below = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), np.full(floor, -0.5 * HEIGHT)])
    part, turn = spiral(grip)
    middle = places(arc, part * length)
    outward = (middle - [RADIUS, 0.0, 0.0]) / np.square([GRIP[0], 1.0, GRIP[1]])  # the ellipse's normal
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-300)
    tube = middle + TUBE * (np.cos(turn)[:, None] * outward + np.sin(turn)[:, None] * [0.0, 1.0, 0.0])
    return np.concatenate([sides, below, tube])
