"""The scene of the walkthrough: two samplings, of 150 points each, of one closed,
fish-like curve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.kinds import shown
from solvers.core.numbers import finite, numbers
from solvers.core.pose import Pose
from solvers.scenes.polyline import lengths, places
from solvers.scenes.rooms import Scene

POINTS = 150
SIDE = 6.0
"""Side, u, of the square field about the origin that clutter is spread over."""
SMALLER = 0.85
"""The moving cloud's relative size if it is smaller."""
START_DEGREES = 60.0
START_SHIFT = (0.7, -0.45)
FISH_SETTINGS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"clean": (0.0, 0.0), "noisy": (0.06, 0.0), "clutter": (0.03, 0.2)}
)
"""Setting → σ of the noise in u, and the fraction of each cloud that is clutter."""

_KNOTS = np.array(
    [
        (2.3, 0.05), (1.6, 0.62), (0.55, 0.95), (0.25, 1.55), (-0.35, 0.9), (-1.05, 0.45), (-1.45, 0.3), (-2.35, 1.15),
        (-2.05, 0.1), (-2.5, -0.75), (-1.5, -0.2), (-0.75, -0.55), (0.1, -0.85), (0.5, -1.3), (0.85, -0.8), (1.6, -0.5),
    ]
)  # fmt: skip


def _smooth(knots: FloatArray) -> FloatArray:
    """The closed Catmull-Rom curve through the knots (k, 2), its first point repeated
    at the end.
    """
    a, b, c, d = (np.roll(knots, shift, axis=0)[:, None] for shift in (1, 0, -1, -2))
    u = np.linspace(0.0, 1.0, 10, endpoint=False)[None, :, None]
    pieces = 2.0 * b + (c - a) * u
    pieces = pieces + (2.0 * a - 5.0 * b + 4.0 * c - d) * u**2
    pieces = 0.5 * (pieces + (3.0 * b - a - 3.0 * c + d) * u**3)
    line = pieces.reshape(-1, 2)
    return np.vstack([line, line[:1]])


def _sampled(line: FloatArray, phase: float) -> FloatArray:
    """`POINTS` places along a closed polyline at equal distances, the first at `phase`
    times that distance from its beginning.
    """
    return places(line, (np.arange(POINTS) + phase) * lengths(line)[-1] / POINTS)


_LINE = _smooth(_KNOTS)
FISH = _LINE - _sampled(_LINE, 0.0).mean(axis=0)
"""The closed curve, (k, 2), with its origin at the mean of the fixed cloud's places on it."""
FISH.flags.writeable = False


def fish(
    name: str = "clean",
    *,
    seed: int = 40,
    noise: float | None = None,
    clutter: float | Sequence[float] | FloatArray | None = None,
    smaller: bool = False,
) -> Scene:
    """A fish seen twice, each time at 150 places at equal distances along its outline.

    The moving cloud's places lie half a distance further along. More noise or clutter
    leaves the other draws unchanged.

    Parameters
    ----------
    name : str, default "clean"
        "clean", "noisy" (σ = 0.06 u) or "clutter" (σ = 0.03 u, and a fifth of each
        cloud lies anywhere in a field of 6 × 6 u).
    seed : int, default 40
        The seed of the random numbers.
    noise : float, optional
        σ on both clouds, in u, before the moving one is made smaller. None is the
        scene's own.
    clutter : float or sequence of two floats, optional
        The fraction, 0 to 1, of both clouds or (moving, fixed). None is the scene's
        own.
    smaller : bool, default False
        Whether the moving cloud is 15 % smaller, about the origin, and the truth has
        the scale 1/0.85; otherwise the truth is the identity.

    Returns
    -------
    Scene
        The two clouds, not paired.

    Raises
    ------
    ValueError
        If the name is unknown, the seed or the noise negative, or a fraction out of its
        range.

    Examples
    --------
    >>> from solvers import register
    >>> from solvers.walk_scenes import fish
    >>> scene = fish(smaller=True)
    >>> result = register(scene.source, scene.target, "cpd-similarity")
    >>> scene.truth.scale.round(2), result.pose.scale.round(2)
    (np.float64(1.18), np.float64(1.18))
    """
    validate.one_of(name, tuple(FISH_SETTINGS), "name")
    own_noise, own_clutter = FISH_SETTINGS[name]
    sigma = own_noise if noise is None else validate.number(noise, "noise", 0.0)
    fractions = validate.one_or_several(own_clutter if clutter is None else clutter, "clutter")
    if len(fractions) > 2:
        raise ValueError(f"clutter: expected a fraction, or two of (moving, fixed), got {shown(clutter)}")
    rng = np.random.default_rng(validate.count(seed, "seed"))
    clouds, masks = [], []
    for fraction, phase in zip((fractions[0], fractions[-1]), (0.5, 0.0), strict=True):
        share = validate.number(fraction, "clutter", 0.0, 1.0)
        unit, order = rng.standard_normal((POINTS, 2)), rng.permutation(POINTS)
        junk = rng.uniform(-0.5 * SIDE, 0.5 * SIDE, (POINTS, 2))
        wrong = order < round(share * POINTS)
        clouds.append(np.where(wrong[:, None], junk, _sampled(FISH, phase) + sigma * unit))
        masks.append(wrong)
    size = SMALLER if smaller else 1.0
    truth = Pose.trusted(np.eye(2), np.zeros(2), 1.0 / size)
    return Scene(name, seed, size * clouds[0], clouds[1], truth, fish_start(), masks[0], masks[1], (size * FISH,))


def fish_start(degrees: float = START_DEGREES, shift: tuple[float, float] = START_SHIFT) -> Pose:
    """The start of the moving cloud of `fish`.

    Parameters
    ----------
    degrees : float, default 60.0
        The angle about the world's origin, anticlockwise.
    shift : tuple of two floats, default (0.7, -0.45)
        The translation after that, in u.

    Returns
    -------
    Pose
        The starting pose.

    Raises
    ------
    ValueError
        If a number is not finite, or the shift not two numbers.

    Examples
    --------
    >>> from solvers.walk_scenes import fish_start
    >>> fish_start(degrees=30.0)
    Pose(angle=30°, t=(0.7, -0.45), scale=1)
    """
    turn, offset = validate.number(degrees, "degrees"), finite(numbers(shift, "shift"), "shift")
    if offset.shape != (2,):
        raise ValueError(f"shift: expected two numbers, got shape {offset.shape}")
    return Pose.from_angle(np.radians(turn), offset)
