"""A simulated drive round a block in a hall, with the truth."""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.pose import Pose
from solvers.scenes.drive import Drive
from solvers.scenes.scans import ranges as cast

OUTER = np.array([(0, 0), (7, 0), (7, 1.2), (9, 1.2), (9, 0), (20, 0), (20, 14), (12, 14), (12, 13), (9, 13), (9, 14),
                  (0, 14), (0, 8), (-1.2, 8), (-1.2, 5), (0, 5)], dtype=float)  # fmt: skip
INNER = np.array([(4, 4), (10, 4), (10, 5), (12, 5), (12, 4), (16, 4), (16, 10), (8, 10), (8, 9), (6, 9), (6, 10),
                  (4, 10)], dtype=float)  # fmt: skip
OUTER.flags.writeable = INNER.flags.writeable = False


def simulated_drive(
    *, seed: int = 40, scans: int = 90, noise: float = 0.01, slip: float = 0.03, beams: int = 181
) -> tuple[Drive, Pose]:
    """A drive round a block in a hall, a little more than once, with the truth.

    The laser sees half a circle ahead, up to 12 m. The odometry's error is a share of
    what was driven and turned; for each metre driven it also turns a tenth of the slip
    too far, in radians, as if a wheel had the wrong radius.

    Parameters
    ----------
    seed : int, default 40
        The seed of the random numbers.
    scans : int, default 90
        How many scans, at least 2, over the same path.
    noise : float, default 0.01
        σ of a range, metres. A range that it brings to 0 or below has no echo.
    slip : float, default 0.03
        σ of the odometry's error, as a share of the motion.
    beams : int, default 181
        Beams per scan, at least 3.

    Returns
    -------
    drive : Drive
        The recording.
    truth : Pose
        Where the robot was at each scan, in the coordinates of the first.

    Raises
    ------
    ValueError
        If a count is too small, or the noise or the slip negative.

    Examples
    --------
    >>> from solvers.drives import simulated_drive
    >>> drive, truth = simulated_drive(scans=40)
    >>> drive.ranges.shape, truth.batch
    ((40, 181), (40,))
    """
    n = validate.count(scans, "scans", 2)
    validate.count(beams, "beams", 3)
    sigma, share = validate.number(noise, "noise", 0.0), validate.number(slip, "slip", 0.0)
    rng = np.random.default_rng(validate.count(seed, "seed"))
    # An ellipse with square shoulders round the block, 1.15 times, at one speed.
    u = np.linspace(0.0, 2.0 * np.pi * 1.15, 4000)
    c, s = np.cos(u), np.sin(u)
    x, y = 10.0 + 8.0 * np.sign(c) * np.abs(c) ** 0.7, 7.0 + 5.0 * np.sign(s) * np.abs(s) ** 0.7
    along = np.append(0.0, np.cumsum(np.hypot(np.diff(x), np.diff(y))))
    even = np.linspace(0.0, along[-1], 20 * n)
    x, y = np.interp(even, along, x), np.interp(even, along, y)
    heading = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
    heading = np.convolve(np.pad(heading, 20, "edge"), np.full(41, 1 / 41), "valid")
    at = np.arange(n) * 20
    world = Pose.from_angle(heading[at], np.stack([x[at], y[at]], axis=1))
    truth = world[:1].inverse().compose(world)
    step = truth[:-1].inverse().compose(truth[1:])
    bearings: FloatArray = np.linspace(-np.pi / 2, np.pi / 2, beams, dtype=np.float64)
    mount = Pose.from_angle(0.0, (0.3, 0.0))
    a, b = (np.concatenate(ends) for ends in ((OUTER, INNER), (np.roll(OUTER, -1, 0), np.roll(INNER, -1, 0))))
    ranges = np.empty((n, beams))
    for k in range(n):
        laser = world[k].compose(mount)
        ahead = np.stack([np.cos(bearings), np.sin(bearings)], axis=1) @ laser.R.T
        r = cast(laser.t, ahead, a, b) + sigma * rng.standard_normal(beams)
        ranges[k] = np.where((r <= 0.0) | (r > 12.0), np.inf, r)
    went, true_turn = np.linalg.norm(step.t, axis=1), np.asarray(step.angle)
    t = step.t * (1.0 + share * rng.standard_normal((n - 1, 1)))
    turn = true_turn * (1.0 + share * rng.standard_normal(n - 1)) + 0.5 * share * went * 0.2
    motion = Pose.from_angle(np.append(0.0, turn), np.concatenate([np.zeros((1, 2)), t]))
    return Drive(0.25 * np.arange(n, dtype=np.float64), motion, ranges, bearings, mount), truth
