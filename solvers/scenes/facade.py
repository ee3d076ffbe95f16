"""Proposed pairs, some of them wrong: forty window corners of a building front, matched
between two views of it.

Drawn like the scenes of `solvers.scenes`: all random numbers from the scene's own seed,
in a fixed order and in units of one, so that a noise slider stretches one draw and one
more wrong pair leaves the others unchanged.
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.pose import Pose
from solvers.scenes.rooms import Scene

MATCH_SCENES = ("occluded", "repeated")
FACADE_TRUTH = Pose.from_angle(np.radians(25.0), (0.3, -0.2))
PERIOD = 1.1  # u from one window to the next in its row
_COLUMNS, _ROWS, _WINDOW = 5, 2, np.array([(0.0, 0.0), (0.55, 0.0), (0.55, 0.8), (0.0, 0.8)])
_RIGHT = (3, 4, 8, 9)  # the windows of the two columns at the right
_CORNERS = np.array([(-2.475 + PERIOD * c, -1.1 + 1.4 * r) for r in range(_ROWS) for c in range(_COLUMNS)])

# Row 4 k + j is corner j of window k; windows count from the left, the lower row first.
FACADE = (_CORNERS[:, None] + _WINDOW).reshape(-1, 2)
FRONT = np.array([(-2.85, -1.7), (2.85, -1.7), (2.85, 1.45), (-1.6, 2.15), (-2.85, 1.45), (-2.85, -1.7)])
for _points in (FACADE, FRONT):
    _points.flags.writeable = False


def facade_scene(
    name: str = "occluded", *, seed: int = 40, noise: float = 0.06, outliers: float = 0.45
) -> Scene:
    """Forty window corners of one building front in two views, paired row by row.

    The views are 25° and (0.3, −0.2) u apart, and some of the pairs are wrong.

    Parameters
    ----------
    name : str, default "occluded"
        Which pairs are wrong, and what their partners are. "occluded": mostly corners
        at the left of the front, which the target view does not see, so each is paired
        with a random corner of another window, one of the four at the right end; the
        wrong pairs contradict one another. "repeated": any corners, each paired with
        the same corner of the next window to the right, so all wrong pairs agree on one
        pose, which is off by the distance between two windows.
    seed : int, default 40
        The seed of the random numbers.
    noise : float, default 0.06
        σ of the isotropic Gaussian error of every target point, right or wrong, in u.
    outliers : float, default 0.45
        The fraction of wrong pairs, 0 to 0.8 (the last column of windows has no next
        one).

    Returns
    -------
    Scene
        Paired, the wrong pairs marked in both clouds.

    Raises
    ------
    ValueError
        If the name is unknown, the seed or the noise negative, or the fraction out of
        its range.

    Examples
    --------
    >>> from solvers import register
    >>> from solvers.match_scenes import facade_scene
    >>> from solvers.metrics import rte
    >>> scene = facade_scene()
    >>> int(scene.source_outlier.sum())
    18
    >>> for method in ("kabsch", "ransac"):
    ...     pose = register(scene.source, scene.target, method).pose
    ...     print(f"{method}: {rte(pose, scene.truth):.2f} u")
    kabsch: 1.48 u
    ransac: 0.02 u
    """
    validate.one_of(name, MATCH_SCENES, "name")
    sigma = validate.number(noise, "noise", 0.0)
    wrong = round(validate.number(outliers, "outliers", 0.0, 0.8) * len(FACADE))

    rng = np.random.default_rng(validate.count(seed, "seed"))
    own = np.arange(len(FACADE), dtype=np.int64)
    window, column = own // 4, own // 4 % _COLUMNS
    unit, order = rng.standard_normal((len(own), 2)), rng.permutation(len(own))
    jitter, visible = rng.random(len(own)), rng.integers(0, 12, len(own))
    corner = rng.integers(0, 4, len(own))

    if name == "repeated":
        order = order[column[order] < _COLUMNS - 1]
        partner = own + 4
    else:
        order = np.argsort(column + 2.0 * jitter)
        # One of the four right windows, except the pair's own: three or four of them,
        # each equally often among twelve.
        right = np.array([(12 * [w for w in _RIGHT if w != k])[:12] for k in range(len(_CORNERS))])
        partner = 4 * right[window, visible] + corner
    outlier = np.zeros(len(own), dtype=np.bool_)
    outlier[order[:wrong]] = True
    target = FACADE_TRUTH.apply(FACADE[np.where(outlier, partner, own)]) + sigma * unit
    panes = [np.vstack([pane, pane[:1]]) for pane in FACADE.reshape(-1, 4, 2)]
    return Scene(
        name, seed, FACADE.copy(), target, FACADE_TRUTH, Pose.identity(), outlier, outlier.copy(),
        (FRONT.copy(), *panes), paired=True,
    )  # fmt: skip
