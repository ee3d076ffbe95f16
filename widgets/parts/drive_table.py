"""The solvers' results on the recorded drive, as figures draw them: kept in a file, since computing them in the browser
would take longer than a reader waits.

`widgets.parts.drive_solved` makes the file; reading it imports neither matching nor graphs.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers import Pose
from solvers.scenes.drive import chained, telecom_loop

FILE = os.path.join(os.path.dirname(__file__), "drive_poses.f4")
KERNELS = ("none", "huber", "cauchy")
WRONG = (150, 20)
"""The wrong loop: it claims that scan 150 has the pose of scan 20, with the information of a typical loop."""

SCRIPT = (
    "drive = telecom_loop()",
    "scans = prepare(drive)",
    "chain = scan_to_scan(scans, drive.motion)",
    "loops = verified(scans, chain.poses, *candidates(chain.poses))",
)
"""The lines of a reader's script that match the drive and find its loops, as was done for the table."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Table:
    """ways: the poses of all scans, from the robot's coordinates to those of the first scan, for 'odometry', 'matched',
    and 'closed' by kernel and whether the wrong loop is among the edges. later, earlier: (c,) the scans of the loops
    that are used; loops: their measured poses. kept: the weight that each kernel leaves the wrong loop."""

    ways: dict[tuple[str, str, bool], Pose]
    later: NDArray[np.int64]
    earlier: NDArray[np.int64]
    loops: Pose
    kept: dict[str, float]

    def way(self, poses: str, kernel: str = "none", wrong: bool = False) -> Pose:
        """The poses of this kind; kernel and wrong loop matter only to the closed ones."""
        return self.ways[("closed", kernel, wrong) if poses == "closed" else (poses, "", False)]

    def missed(self, way: Pose, count: int) -> tuple[Array, Array]:
        """How far `way` misses the loops among the first `count` scans: metres and degrees."""
        mask = self.later < count
        i, j = self.earlier[mask], self.later[mask]
        gap = self.loops[mask].inverse().compose(way[i].inverse().compose(way[j]))
        return np.linalg.norm(gap.t, axis=-1), np.degrees(np.abs(gap.angle))


@cache
def table() -> Table:
    """The table from the file beside this module."""
    with open(FILE, "rb") as file:
        return read(file.read())


def read(data: bytes) -> Table:
    """Parse what `widgets.parts.drive_solved.made` returned."""
    numbers = np.frombuffer(data, "<f4").astype(np.float64)
    n, c = int(numbers[0]), int(numbers[1])
    at = 2 + len(KERNELS)
    poses = []
    for _ in range(1 + 2 * len(KERNELS)):
        poses.append(_pose(numbers[at : at + 3 * n].reshape(n, 3)))
        at += 3 * n
    loop_rows = numbers[at:].reshape(c, 5)
    ways = {("odometry", "", False): chained(telecom_loop().motion), ("matched", "", False): poses[0]}
    for (kernel, wrong), way in zip(product(KERNELS, (False, True)), poses[1:], strict=True):
        ways["closed", kernel, wrong] = way
    later, earlier = (loop_rows[:, k].astype(np.int64) for k in (0, 1))
    weights = dict(zip(KERNELS, numbers[2 : 2 + len(KERNELS)].tolist(), strict=True))
    return Table(ways, later, earlier, _pose(loop_rows[:, 2:]), weights)


def _pose(rows: Array) -> Pose:
    return Pose.from_angle(rows[:, 2], rows[:, :2])
