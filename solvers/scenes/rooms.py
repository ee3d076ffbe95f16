"""Seeded scenes with a known truth, for the figures to show and the benchmarks to run on.

Each scene draws all its random numbers from its own seed, in a fixed order and in units
of one, before anything is scaled or chosen. So a noise slider stretches one draw
instead of drawing a new one, and one more outlier leaves the others unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, restored
from solvers.core.brief import brief
from solvers.core.pose import Pose
from solvers.scenes.polyline import lengths, places


@dataclass(frozen=True, eq=False)
class Scene:
    """Two planar clouds and the pose between them.

    The arrays are read-only.

    Attributes
    ----------
    name : str
        The scene's name.
    seed : int
        The seed of its random numbers.
    source : ndarray of shape (m, 2)
        The cloud to move, in world units.
    target : ndarray of shape (n, 2)
        The fixed cloud; row i is the partner of source row i if `paired`.
    truth : Pose
        The pose that maps the noiseless source to the target.
    start : Pose
        An instructive starting pose.
    source_outlier : ndarray of bool, shape (m,)
        True where a point was put in a wrong place. In a paired scene a wrong pair is
        marked in both clouds.
    target_outlier : ndarray of bool, shape (n,)
        The same for the target.
    outline : tuple of ndarray, each of shape (k, 2)
        Curves to draw, in source coordinates; a closed one repeats its first point.
    paired : bool
        Whether the clouds are matched row by row.

    Examples
    --------
    >>> from solvers.scenes import kabsch_scene
    >>> scene = kabsch_scene("outliers")
    >>> scene.paired, scene.source.shape, int(scene.source_outlier.sum())
    (True, (13, 2), 3)
    """

    name: str
    seed: int
    source: FloatArray
    target: FloatArray
    truth: Pose
    start: Pose
    source_outlier: BoolArray
    target_outlier: BoolArray
    outline: tuple[FloatArray, ...]
    paired: bool = field(default=False)

    __repr__ = brief
    __setstate__ = restored

    def __post_init__(self) -> None:
        for a in (self.source, self.target, self.source_outlier, self.target_outlier, *self.outline):
            a.flags.writeable = False


KABSCH_SCENES = ("clean", "noisy", "outliers", "would-reflect")
ROOM_SETTINGS = ("clean", "noise", "gradient", "striped", "outliers", "combo")

KABSCH_TRUTH = Pose.from_angle(np.radians(50.0), (2.6, 0.9))
KABSCH_START = Pose.from_angle(np.radians(-25.0), (-3.0, -0.6))

# A bird seen from the side: its mirror image looks the other way, which no rotation
# undoes.
BIRD = np.array(
    [
        (-1.9, 0.2), (-0.9, 0.5), (-0.2, 1.5), (0.5, 1.8), (1.0, 1.4), (1.9, 1.2), (1.05, 0.8),
        (0.9, -0.2), (0.35, -1.0), (0.35, -1.9), (-0.1, -1.9), (-0.3, -1.0), (-1.3, -0.7),
    ]
)  # fmt: skip
BIRD.flags.writeable = False

# A mast, bowed by a few thousandths of its length, and the pennant that it carries:
# only the mast is measured.
_HEIGHT = np.linspace(-2.0, 2.0, 13)
MAST = np.column_stack([0.008 * (1.0 - (_HEIGHT / 2.0) ** 2), _HEIGHT])
MAST.flags.writeable = False
_PENNANT = np.array([(0.0, 2.0), (1.7, 1.45), (0.0, 0.9)])


def kabsch_scene(
    name: str = "clean", *, seed: int = 40, noise: float | None = None, outliers: int | None = None
) -> Scene:
    """Thirteen known pairs in the plane, moved by 50° and (2.6, 0.9) u.

    Parameters
    ----------
    name : str, default "clean"
        "clean" (no noise), "noisy" (σ = 0.12 u), "outliers" (three wrong partners) or
        "would-reflect" (below).
    seed : int, default 40
        The seed of the random numbers.
    noise : float, optional
        σ of the target's isotropic Gaussian noise, in u. None is the scene's own (0.12
        when noisy or would-reflect).
    outliers : int, optional
        How many partners are wrong, 0 to 13; each lies anywhere in a field of 10 × 6.4
        u. None is the scene's own.

    Returns
    -------
    Scene
        Paired, with its truth.

    Raises
    ------
    ValueError
        If the name is unknown, the seed or the noise negative, or the count out of its
        range.

    Notes
    -----
    "would-reflect" measures a bowed mast: a cloud far thinner than its noise. The noise
    across the mast then decides whether the best orthogonal matrix is a rotation or a
    reflection, both equally likely. Of a draw and its mirror image across the mast
    (equally probable), the scene takes the one that leans towards the reflection. A
    test counts: at least 22 of the 25 seeds 40 + 13k reflect at the scene's own noise,
    and none without noise.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import fit_rigid
    >>> from solvers.scenes import kabsch_scene
    >>> scene = kabsch_scene("clean")
    >>> fit = fit_rigid(scene.source, scene.target)
    >>> np.degrees(fit.pose.angle).round(6), fit.pose.t.round(6)
    (np.float64(50.0), array([2.6, 0.9]))
    """
    validate.one_of(name, KABSCH_SCENES, "name")
    own = 0.12 if name in ("noisy", "would-reflect") else 0.0
    sigma = own if noise is None else validate.number(noise, "noise", 0.0)
    wrong = (3 if name == "outliers" else 0) if outliers is None else validate.count(outliers, "outliers")
    shape = MAST if name == "would-reflect" else BIRD
    n = len(shape)
    if wrong > n:
        raise ValueError(f"outliers: there are {n} pairs, but {wrong} are to be wrong")

    rng = np.random.default_rng(validate.count(seed, "seed"))
    unit = rng.standard_normal((n, 2))
    order = rng.permutation(n)
    junk = scattered(rng, n)

    if name == "would-reflect":
        unit = _lean_to_reflection(unit)
    target = KABSCH_TRUTH.apply(shape) + sigma * unit
    outlier = np.zeros(n, dtype=np.bool_)
    outlier[order[:wrong]] = True
    target[outlier] = junk[outlier]
    outline = (shape.copy(), np.vstack([_PENNANT, _PENNANT[:1]])) if name == "would-reflect" else (_closed(shape),)
    return Scene(
        name, seed, shape.copy(), target, KABSCH_TRUTH, KABSCH_START, outlier, outlier.copy(), outline, paired=True
    )


def _lean_to_reflection(unit: FloatArray) -> FloatArray:
    """The draw, or its mirror image across the mast, whichever opposes the mast's bow."""
    across = KABSCH_TRUTH.R[:, 0]
    bow = MAST[:, 0] - MAST[:, 0].mean()
    lean = unit @ across
    return unit - 2.0 * lean[:, None] * across if bow @ lean > 0.0 else unit


ROOM = np.array(
    [(-4.4, -2.5), (4.4, -2.5), (4.4, 0.3), (2.5, 0.3), (2.5, 2.5), (-0.7, 2.5), (-0.7, 1.2), (-4.4, 1.2)]
)
ROOM.flags.writeable = False
ROOM_START_DIRECTION = np.array([0.80413, 0.59436])


def room_start(degrees: float = 45.0, distance: float = 1.43) -> Pose:
    """The room's usual start: turned about the world's origin, then moved.

    Parameters
    ----------
    degrees : float, default 45.0
        The angle, anticlockwise.
    distance : float, default 1.43
        How far it is moved, in u, in the direction (0.80413, 0.59436).

    Returns
    -------
    Pose
        The starting pose.

    Raises
    ------
    ValueError
        If one of them is not a finite number.

    Examples
    --------
    >>> from solvers.scenes import room_start
    >>> room_start(degrees=20.0, distance=1.0)
    Pose(angle=20°, t=(0.80413, 0.59436), scale=1)
    """
    turn, far = validate.number(degrees, "degrees"), validate.number(distance, "distance")
    return Pose.from_angle(np.radians(turn), far * ROOM_START_DIRECTION)


def room(
    setting: str = "clean",
    *,
    seed: int = 40,
    noise: float | None = None,
    outliers: float | None = None,
    overlap: float = 1.0,
    density: float = 1.0,
) -> Scene:
    """An open room as two scans see it.

    The target sees all of its outline, the source the part from 6 % to 94 % of its
    length. The target is sampled every 0.15 u, the source every 0.16 u from another
    phase, so no point has an exact partner. The truth is the identity; the start pose
    displaces the source.

    Parameters
    ----------
    setting : str, default "clean"
        "clean"; "noise" (σ 0.11 u instead of 0.02); "gradient" (spacing 0.07 + 0.42 f
        at the fraction f of the length, both clouds); "striped" (nine bands of spacing
        0.08 and 0.42 u in turn, both clouds); "outliers" (20 % of each cloud replaced
        by junk over 10 × 6.4 u); "combo" (noise and outliers).
    seed : int, default 40
        The seed of the random numbers.
    noise : float, optional
        σ in u. None is the setting's own.
    outliers : float, optional
        The replaced fraction of each cloud, 0 to 1. None is the setting's own.
    overlap : float, default 1.0
        The fraction of the outline's length, from its beginning, that the target sees,
        0.1 to 1; the points of the rest are missing.
    density : float, default 1.0
        How much denser than usual the source is sampled, 0.2 to 5.

    Returns
    -------
    Scene
        The two scans, not paired.

    Raises
    ------
    ValueError
        If the setting is unknown, the seed or the noise negative, or a fraction or the
        density out of its range.

    Examples
    --------
    >>> from solvers.scenes import room
    >>> scene = room("combo", seed=53)
    >>> scene.source.shape, scene.target.shape
    ((132, 2), (160, 2))
    >>> scene.start
    Pose(angle=45°, t=(1.14991, 0.849935), scale=1)
    """
    validate.one_of(setting, ROOM_SETTINGS, "setting")
    visible, denser = validate.number(overlap, "overlap", 0.1, 1.0), validate.number(density, "density", 0.2, 5.0)
    own = 0.11 if setting in ("noise", "combo") else 0.02
    sigma = own if noise is None else validate.number(noise, "noise", 0.0)
    own = 0.2 if setting in ("outliers", "combo") else 0.0
    fraction = own if outliers is None else validate.number(outliers, "outliers", 0.0, 1.0)
    total = float(lengths(ROOM)[-1])

    rng = np.random.default_rng(validate.count(seed, "seed"))
    clouds: list[FloatArray] = []
    masks: list[BoolArray] = []
    for spacing, first, last, ratio in (
        (0.15, 0.0, total, 1.0),
        (0.16, 0.06 * total + 0.06, 0.94 * total, denser),
    ):
        along = _stations(setting, spacing, first, last, total, ratio)
        points = places(ROOM, along)
        n = len(points)
        unit, order, junk = rng.standard_normal((n, 2)), rng.permutation(n), scattered(rng, n)
        points += sigma * unit
        wrong = np.zeros(n, dtype=np.bool_)
        wrong[order[: round(fraction * n)]] = True
        points[wrong] = junk[wrong]
        # Drawn for all of the outline, then cut: a smaller overlap leaves the other
        # points where they were.
        inside = along <= (total if clouds else visible * total + 1e-9)
        clouds.append(points[inside])
        masks.append(wrong[inside])
    return Scene(
        setting, seed, clouds[1], clouds[0], Pose.identity(), room_start(), masks[1], masks[0], (ROOM.copy(),)
    )


def _stations(setting: str, spacing: float, first: float, last: float, total: float, ratio: float) -> FloatArray:
    """Arc lengths from `first` to `last` at which the outline is sampled, `ratio` times
    as densely as usual.
    """
    spacing /= ratio
    if setting not in ("gradient", "striped"):
        return first + spacing * np.arange(np.floor((last - first) / spacing + 1e-9) + 1.0)
    stations, s = [], first
    while s <= last:
        stations.append(s)
        f = s / total
        s += (0.07 + 0.42 * f if setting == "gradient" else (0.08, 0.42)[min(int(9.0 * f), 8) % 2]) / ratio
    return np.array(stations)


def scattered(rng: np.random.Generator, count: int) -> FloatArray:
    """`count` places uniform over 10 × 6.4 u about the origin: a room's junk."""
    return rng.uniform((-5.0, -3.2), (5.0, 3.2), (count, 2))


def _closed(points: FloatArray) -> FloatArray:
    return np.vstack([points, points[:1]])
