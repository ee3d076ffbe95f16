"""Two sparse, noisy, cluttered samplings of one bird: few enough points that every
share between them can be drawn.
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.pose import Pose
from solvers.scenes.polyline import lengths, places
from solvers.scenes.rooms import BIRD, Scene

SHAPE = 1.4 * BIRD
SHAPE.flags.writeable = False
TRUTH = Pose.from_angle(np.radians(20.0), (0.6, 0.0))
FIELD = (10.0, 6.4)
"""Width and height, u, of the field about the origin that clutter is spread over."""
AREA = FIELD[0] * FIELD[1]
"""Its area, u²: the V of a clutter density 1/V."""
COUNTS = (26, 30)
"""Points on the outline in source and target."""
MOST = 10
"""The most clutter points in each cloud."""


def bird(*, seed: int = 40, noise: float = 0.1, clutter: int = 4) -> Scene:
    """The outline of a bird, sampled twice: no point has an exact partner.

    The two samplings differ in spacing and phase. More noise stretches the same draw;
    one more clutter point leaves the others unchanged. The start is `bird_start()`.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    noise : float, default 0.1
        σ of the isotropic Gaussian noise on both clouds, in u.
    clutter : int, default 4
        How many clutter points each cloud has, 0 to 10, spread uniformly over a field
        of 10 × 6.4 u in target coordinates; they come last in their cloud.

    Returns
    -------
    Scene
        26 source and 30 target points, and the clutter; not paired.

    Raises
    ------
    ValueError
        If the seed or the noise is negative, or the count out of its range.

    Examples
    --------
    >>> from solvers.bird_scene import bird
    >>> scene = bird(clutter=2)
    >>> scene.source.shape, scene.target.shape
    ((28, 2), (32, 2))
    >>> scene.truth
    Pose(angle=20°, t=(0.6, 0), scale=1)
    """
    sigma, wrong = validate.number(noise, "noise", 0.0), validate.count(clutter, "clutter")
    if wrong > MOST:
        raise ValueError(f"clutter: expected at most {MOST} points, got {wrong}")
    rng = np.random.default_rng(validate.count(seed, "seed"))
    p, source_clutter = _sampled(rng, COUNTS[0], 0.5, sigma)
    q, target_clutter = _sampled(rng, COUNTS[1], 0.0, sigma)
    source = np.vstack([p, TRUTH.inverse().apply(source_clutter)[:wrong]])
    target = np.vstack([TRUTH.apply(q), target_clutter[:wrong]])
    masks = [np.arange(n + wrong) >= n for n in COUNTS]
    outline = np.vstack([SHAPE, SHAPE[:1]])
    return Scene("bird", seed, source, target, TRUTH, bird_start(), masks[0], masks[1], (outline,))


def bird_start(degrees: float = -40.0, distance: float = 1.6) -> Pose:
    """A start near the truth of `bird`.

    The true pose, turned about the bird's centre and moved to the left.

    Parameters
    ----------
    degrees : float, default -40.0
        The angle, anticlockwise.
    distance : float, default 1.6
        How far it is moved, in u, along (−0.96, 0.28).

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
    >>> import numpy as np
    >>> from solvers.bird_scene import bird, bird_start
    >>> from solvers.metrics import rre
    >>> np.degrees(rre(bird_start(degrees=-40.0), bird().truth)).round(6)
    np.float64(40.0)
    """
    turn, far = validate.number(degrees, "degrees"), validate.number(distance, "distance")
    centre = SHAPE.mean(axis=0)
    R = Pose.from_angle(np.radians(turn)).R @ TRUTH.R
    position = TRUTH.apply(centre[None])[0] + far * np.array([-0.96, 0.28])
    return Pose.trusted(R, position - R @ centre)


def _sampled(rng: np.random.Generator, n: int, phase: float, sigma: float) -> tuple[FloatArray, FloatArray]:
    """n noisy points along the outline (n, 2), and as much clutter as there may be
    (MOST, 2).
    """
    line = np.vstack([SHAPE, SHAPE[:1]])
    points = places(line, (np.arange(n) + phase) * lengths(line)[-1] / n)
    points += sigma * rng.standard_normal((n, 2))
    half = 0.5 * np.array(FIELD)
    return points, rng.uniform(-half, half, (MOST, 2))
