"""Scans made on the move: a laser sends its beams one after another, and meanwhile the robot drives on and turns.

At 1.5 m/s and 20 degrees a second the 20 ms between a scan's first beam and its last are 3 cm and 0.4 degrees. Each
echo is put where a robot that stood still would have it, for the speed that the odometry tells.
"""

from __future__ import annotations

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.kinds import of_kind
from solvers.scenes.drive import Drive

AROUND = 2
"""Scans before and after, over which a speed is taken: the times of single scans are not exact."""


def straightened(drive: Drive, farthest: float = np.inf) -> list[FloatArray]:
    """The echoes of every scan, as from a robot that stood still.

    Parameters
    ----------
    drive : Drive
        Without `delays` its echoes are as they were recorded.
    farthest : float, default inf
        Metres beyond which an echo is left out.

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
        after = drive.delays[drive.heard(k, farthest)]
        cos, sin = np.cos(turn[k] * after), np.sin(turn[k] * after)
        x, y = cloud.T
        out.append(np.stack([cos * x - sin * y, sin * x + cos * y], axis=1) + shift[k] * after[:, None])
    return out


def speeds(drive: Drive) -> tuple[FloatArray, FloatArray]:
    """Metres a second in the robot's coordinates, (n, 2), and radians a second, (n,), by the odometry."""
    n = len(drive.seconds)
    first, last = np.maximum(np.arange(n) - AROUND, 0), np.minimum(np.arange(n) + AROUND, n - 1)
    took = drive.seconds[last] - drive.seconds[first]
    way = np.cumsum(np.column_stack([drive.motion.t, drive.motion.angle]), axis=0)
    rate = np.where(took > 0.0, 1.0 / np.where(took > 0.0, took, 1.0), 0.0)[:, None] * (way[last] - way[first])
    return rate[:, :2], rate[:, 2]
