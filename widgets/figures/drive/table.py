"""What the solvers found on the recorded drive, as the figure draws it: kept in a file, since to find it takes the
browser longer than a reader waits.

`made` computes it from the scans; a test holds the file to that. To write the file anew:
`python -c "from widgets.figures.drive import table; table.write()"`.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from solvers import Pose
from solvers.core.edges import Edges
from solvers.odometry import Matches, candidates, close, edges_of, prepare, scan_to_scan, verified
from solvers.posegraph import optimise
from solvers.scenes.drive import chained, telecom_loop

FILE = os.path.join(os.path.dirname(__file__), "poses.f4")
KERNELS = ("none", "huber", "cauchy")
WRONG = (150, 20)
"""The wrong loop: scan 150 said to stand where scan 20 stood, with the information that a loop has."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Table:
    """ways: 'odometry', 'matched', and 'closed' by kernel and whether the wrong loop is among the edges; poses of all
    scans, from the robot's coordinates to those of the first scan. later, earlier: (c,) the loops that are used, and
    loops: what was measured. kept: what each kernel leaves of the wrong loop."""

    ways: dict[tuple[str, str, bool], Pose]
    later: NDArray[np.int64]
    earlier: NDArray[np.int64]
    loops: Pose
    kept: dict[str, float]

    def way(self, poses: str, kernel: str, wrong: bool) -> Pose:
        """The poses for what a reader has set; kernel and wrong loop matter to the closed ones alone."""
        return self.ways[("closed", kernel, wrong) if poses == "closed" else (poses, "", False)]

    def missed(self, way: Pose, seen: int) -> tuple[Array, Array]:
        """By how much the loops among the first `seen` scans miss: metres and degrees."""
        some = self.later < seen
        i, j = self.earlier[some], self.later[some]
        gap = self.loops[some].inverse().compose(way[i].inverse().compose(way[j]))
        return np.linalg.norm(gap.t, axis=-1), np.degrees(np.abs(gap.angle))


def with_wrong(edges: Edges, loops: Matches) -> Edges:
    """The edges and the wrong loop."""
    later, earlier = WRONG
    return Edges(
        np.append(edges.i, earlier),
        np.append(edges.j, later),
        Pose(np.concatenate([edges.relative.R, np.eye(2)[None]]), np.concatenate([edges.relative.t, np.zeros((1, 2))])),
        np.concatenate([edges.information, np.median(loops.information, axis=0)[None]]),
    )


def made() -> bytes:
    """The table's file, computed from the scans."""
    drive = telecom_loop()
    scans = prepare(drive)
    chain = scan_to_scan(scans, drive.motion)
    loops = verified(scans, chain.poses, *candidates(chain.poses))
    used = loops.believed
    edges, robust = edges_of(chain, loops)
    closed, kept = [], []
    for kernel, wrong in product(KERNELS, (False, True)):
        if wrong:
            found = optimise(chain.poses, with_wrong(edges, loops), kernel=kernel, robust=np.append(robust, True))
            kept.append(found.weights[-1])
        else:
            found = close(chain, loops, kernel=kernel)
        closed.append(found.poses)
    rows = [_rows(chain.poses), *map(_rows, closed)]
    measured = np.column_stack([loops.source[used], loops.target[used], _rows(loops.pose[used])])
    head = np.array([len(scans), used.sum(), *kept])
    return b"".join(part.astype("<f4").tobytes() for part in (head, *rows, measured))


def write() -> None:
    """Put the computed table into its place."""
    with open(FILE, "wb") as file:
        file.write(made())


@cache
def table() -> Table:
    """The table as it lies beside this module."""
    with open(FILE, "rb") as file:
        return read(file.read())


def read(data: bytes) -> Table:
    """What `made` has written."""
    numbers = np.frombuffer(data, "<f4").astype(np.float64)
    n, c = int(numbers[0]), int(numbers[1])
    at = 2 + len(KERNELS)
    poses = []
    for _ in range(1 + 2 * len(KERNELS)):
        poses.append(_pose(numbers[at : at + 3 * n].reshape(n, 3)))
        at += 3 * n
    measured = numbers[at:].reshape(c, 5)
    ways = {("odometry", "", False): chained(telecom_loop().motion), ("matched", "", False): poses[0]}
    for (kernel, wrong), way in zip(product(KERNELS, (False, True)), poses[1:], strict=True):
        ways["closed", kernel, wrong] = way
    later, earlier = (measured[:, k].astype(np.int64) for k in (0, 1))
    kept = dict(zip(KERNELS, numbers[2 : 2 + len(KERNELS)].tolist(), strict=True))
    return Table(ways, later, earlier, _pose(measured[:, 2:]), kept)


def _rows(pose: Pose) -> Array:
    return np.column_stack([pose.t, pose.angle])


def _pose(rows: Array) -> Pose:
    return Pose.from_angle(rows[:, 2], rows[:, :2])
