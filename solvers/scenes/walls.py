"""Scenes for residuals that take surfaces into account.

One straight wall, a corridor, a closed room with a notch and a pillar, and a
rectangular hall, which looks the same after half a turn. Drawn like those of
`solvers.scenes`: all random numbers from the scene's own seed, in a fixed order and in
units of one.
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.pose import Pose
from solvers.scenes.polyline import lengths, places
from solvers.scenes.rooms import Scene, scattered

WALL = np.array([(-4.0, -1.4), (4.0, 1.4)])
NDT_ROOM = np.array(
    [
        (-4.6, -2.6), (4.6, -2.6), (4.6, 2.6), (1.4, 2.6), (1.4, 1.4), (-0.4, 1.4), (-0.4, 2.6), (-4.6, 2.6),
        (-4.6, -2.6),
    ]
)  # fmt: skip
PILLAR = np.array([(2.0, -0.9), (2.9, -0.9), (2.9, 0.0), (2.0, 0.0), (2.0, -0.9)])
HALL = np.array([(-4.2, -2.4), (4.2, -2.4), (4.2, 2.4), (-4.2, 2.4), (-4.2, -2.4)])
_ACROSS = 1.2 * np.array([-2.8, 8.0]) / np.hypot(2.8, 8.0)
CORRIDOR = (WALL - _ACROSS, WALL + _ACROSS)
for _outline in (WALL, NDT_ROOM, PILLAR, HALL, *CORRIDOR):
    _outline.flags.writeable = False


def single_wall(*, seed: int = 40, noise: float = 0.02, outliers: float = 0.0) -> Scene:
    """One straight wall, 8.5 u long, and a scan of the middle six tenths of it.

    Only the wall's ends, which the scan does not reach, could tell where along the wall
    it lies. The truth is the identity.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    noise : float, default 0.02
        σ of the isotropic Gaussian noise on both clouds, in u.
    outliers : float, default 0.0
        The fraction of each cloud, 0 to 1, that is put anywhere in a field of 10 × 6.4
        u.

    Returns
    -------
    Scene
        The two scans, not paired.

    Raises
    ------
    ValueError
        If the seed or the noise is negative, or the fraction out of its range.

    Examples
    --------
    The scan comes to rest on the wall, but not in its place along it:

    >>> from solvers import register
    >>> from solvers.metrics import rte
    >>> from solvers.wall_scenes import single_wall
    >>> scene = single_wall()
    >>> p, q = scene.source, scene.target
    >>> result = register(p, q, "point-to-plane", start=scene.start)
    >>> print(f"{result.status}, {rte(result.pose, scene.truth):.1f} u from the truth")
    converged, 1.5 u from the truth
    """
    rng = np.random.default_rng(validate.count(seed, "seed"))
    clouds = [sampled(WALL, 0.15), sampled(WALL, 0.16, 0.2, 0.8)]
    start = Pose.from_angle(np.radians(15.0), (0.9, 1.1))
    return _scene("single-wall", seed, rng, clouds, (WALL,), noise, outliers, start)


def corridor(*, seed: int = 40, noise: float = 0.02, outliers: float = 0.0) -> Scene:
    """Two parallel walls, and a scan of the middle six tenths of each.

    The walls are 8.5 u long and 2.4 u apart, open at both ends. The truth is the
    identity.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    noise : float, default 0.02
        σ of the isotropic Gaussian noise on both clouds, in u.
    outliers : float, default 0.0
        The fraction of each cloud, 0 to 1, that is put anywhere in a field of 10 × 6.4
        u.

    Returns
    -------
    Scene
        The two scans, not paired.

    Raises
    ------
    ValueError
        If the seed or the noise is negative, or the fraction out of its range.

    Examples
    --------
    >>> from solvers.wall_scenes import corridor
    >>> scene = corridor()
    >>> scene.source.shape, scene.target.shape
    ((64, 2), (114, 2))
    """
    rng = np.random.default_rng(validate.count(seed, "seed"))
    clouds = [
        np.vstack([sampled(side, 0.15) for side in CORRIDOR]),
        np.vstack([sampled(side, 0.16, 0.2, 0.8) for side in CORRIDOR]),
    ]
    start = Pose.from_angle(np.radians(10.0), (0.9, 0.1))
    return _scene("corridor", seed, rng, clouds, CORRIDOR, noise, outliers, start)


def ndt_room(*, seed: int = 40, noise: float = 0.03, outliers: float = 0.0) -> Scene:
    """A closed room of 9.2 × 5.2 u with a notch and a pillar.

    All of it is mapped every 0.13 u; a scan every 0.16 u sees seven tenths of the walls
    and all of the pillar. The truth is the identity.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    noise : float, default 0.03
        σ of the isotropic Gaussian noise on both clouds, in u.
    outliers : float, default 0.0
        The fraction of each cloud, 0 to 1, that is put anywhere in a field of 10 × 6.4
        u.

    Returns
    -------
    Scene
        The scan and the map, not paired.

    Raises
    ------
    ValueError
        If the seed or the noise is negative, or the fraction out of its range.

    Examples
    --------
    >>> from solvers.wall_scenes import ndt_room
    >>> scene = ndt_room()
    >>> scene.source.shape, scene.target.shape
    ((160, 2), (269, 2))
    """
    rng = np.random.default_rng(validate.count(seed, "seed"))
    clouds = [
        np.vstack([sampled(NDT_ROOM, 0.13), sampled(PILLAR, 0.13)]),
        np.vstack([sampled(NDT_ROOM, 0.16, 0.05, 0.75), sampled(PILLAR, 0.16)]),
    ]
    start = Pose.from_angle(np.radians(12.0), (0.6, -0.4))
    return _scene("ndt-room", seed, rng, clouds, (NDT_ROOM, PILLAR), noise, outliers, start)


def hall(*, seed: int = 40, noise: float = 0.02, outliers: float = 0.0) -> Scene:
    """A rectangular hall of 8.4 × 4.8 u, and a scan of seven tenths of its outline.

    The hall is scanned every 0.15 u, the part every 0.16 u. Half a turn about the
    origin lays walls on walls as well as the truth, the identity, does.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    noise : float, default 0.02
        σ of the isotropic Gaussian noise on both clouds, in u.
    outliers : float, default 0.0
        The fraction of each cloud, 0 to 1, that is put anywhere in a field of 10 × 6.4
        u.

    Returns
    -------
    Scene
        The two scans, not paired.

    Raises
    ------
    ValueError
        If the seed or the noise is negative, or the fraction out of its range.

    Examples
    --------
    >>> from solvers.wall_scenes import hall
    >>> scene = hall()
    >>> scene.source.shape, scene.target.shape
    ((116, 2), (177, 2))
    """
    rng = np.random.default_rng(validate.count(seed, "seed"))
    clouds = [sampled(HALL, 0.15), sampled(HALL, 0.16, 0.02, 0.72)]
    start = Pose.from_angle(np.radians(45.0), (1.15, 0.85))
    return _scene("hall", seed, rng, clouds, (HALL,), noise, outliers, start)


def sampled(outline: FloatArray, spacing: float, first: float = 0.0, last: float = 1.0) -> FloatArray:
    """Points at equal distances along a polyline.

    Parameters
    ----------
    outline : ndarray of shape (k, 2)
        The polyline's corners, in u.
    spacing : float
        The distance from point to point along it, in u.
    first : float, default 0.0
        Where they begin, as a fraction of the polyline's length.
    last : float, default 1.0
        Where they end.

    Returns
    -------
    ndarray of shape (n, 2)
        The points.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.wall_scenes import sampled
    >>> sampled(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]]), 1.0)
    array([[0., 0.],
           [1., 0.],
           [2., 0.],
           [2., 1.]])
    """
    length = lengths(outline)[-1]
    begin, end = first * length, last * length
    along = begin + spacing * np.arange(np.floor((end - begin) / spacing + 1e-9) + 1.0)
    return places(outline, along)


def _scene(
    name: str,
    seed: int,
    rng: np.random.Generator,
    clouds: list[FloatArray],
    outlines: tuple[FloatArray, ...],
    noise: float,
    outliers: float,
    start: Pose,
) -> Scene:
    sigma = validate.number(noise, "noise", 0.0)
    fraction = validate.number(outliers, "outliers", 0.0, 1.0)
    points, masks = [], []
    for cloud in clouds:
        n = len(cloud)
        unit, order = rng.standard_normal((n, 2)), rng.permutation(n)
        junk = scattered(rng, n)
        wrong = np.zeros(n, dtype=np.bool_)
        wrong[order[: round(fraction * n)]] = True
        points.append(np.where(wrong[:, None], junk, cloud + sigma * unit))
        masks.append(wrong)
    return Scene(
        name, seed, points[1], points[0], Pose.identity(), start, masks[1], masks[0], tuple(o.copy() for o in outlines)
    )
