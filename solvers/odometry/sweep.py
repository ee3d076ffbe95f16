"""Scans taken on the move: a laser sends its beams one after another while the robot drives on and turns.

At 1.5 m/s and 20 degrees a second the 20 ms between a scan's first beam and its last are 3 cm and 0.4 degrees. Each
echo is moved to where a robot standing still would have seen it, given the speed from odometry.
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.kinds import of_kind
from solvers.scenes.drive import Drive

AROUND = 2
"""How many scans before and after to average a speed over, because the times of single scans are inexact."""


def straightened(drive: Drive, farthest: float = np.inf) -> list[FloatArray]:
    """The echoes of every scan, as if the robot had stood still.

    Parameters
    ----------
    drive : Drive
        Without `delays` its echoes are returned as recorded.
    farthest : float, default inf
        The range beyond which echoes are left out, metres.

    Returns
    -------
    list of ndarray of shape (m, 2)
        Metres, in the robot's coordinates, in the order of the beams.

    Raises
    ------
    ValueError
        If `drive` is not a Drive, or `farthest` is negative or not a number.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.drives import telecom_loop
    >>> from solvers.odometry import straightened
    >>> drive = telecom_loop()
    >>> gap = np.linalg.norm(straightened(drive)[67] - drive.points(67), axis=1)
    >>> bool(0.01 < gap.mean() < 0.03)
    True
    """
    of_kind(drive, Drive, "drive")
    validate.reach(farthest, "farthest", 0.0)
    clouds = [drive.points(k, farthest) for k in range(len(drive.ranges))]
    if drive.delays is None:
        return clouds
    shift, turn = speeds(drive)
    out = []
    for k, cloud in enumerate(clouds):
        delays = drive.delays[drive.heard(k, farthest)]
        cos, sin = np.cos(turn[k] * delays), np.sin(turn[k] * delays)
        x, y = cloud.T
        out.append(np.stack([cos * x - sin * y, sin * x + cos * y], axis=1) + shift[k] * delays[:, None])
    return out


def speeds(drive: Drive) -> tuple[FloatArray, FloatArray]:
    """The speeds by odometry: metres per second in the robot's coordinates, (n, 2), and radians per second, (n,)."""
    n = len(drive.seconds)
    first, last = np.maximum(np.arange(n) - AROUND, 0), np.minimum(np.arange(n) + AROUND, n - 1)
    span = drive.seconds[last] - drive.seconds[first]
    path = np.cumsum(np.column_stack([drive.motion.t, drive.motion.angle]), axis=0)
    rate = np.where(span > 0.0, 1.0 / np.where(span > 0.0, span, 1.0), 0.0)[:, None] * (path[last] - path[first])
    return rate[:, :2], rate[:, 2]
