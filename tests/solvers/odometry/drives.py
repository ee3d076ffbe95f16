"""A simulated drive with its chain, and loops that are known to be wrong."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from solvers import Pose
from solvers.drives import simulated_drive
from solvers.odometry import Chain, Matches, Scans, prepare, scan_to_scan, verified
from solvers.odometry.matching import together
from solvers.scenes.drive import Drive


@cache
def simulation() -> tuple[Drive, Pose, Scans, Chain]:
    drive, truth = simulated_drive()
    scans = prepare(drive)
    return drive, truth, scans, scan_to_scan(scans, drive.motion)


def without_echoes(drive: Drive, *silent: int, left: int = 0) -> Drive:
    """The drive with only the first `left` echoes of these scans kept."""
    ranges = np.array(drive.ranges)
    for k in silent:
        ranges[k, np.flatnonzero(np.isfinite(ranges[k]))[left:]] = np.inf
    return replace(drive, ranges=ranges)


def matches_of(pairs: list[tuple[int, int]]) -> Matches:
    """Loops verified from poses that put the first scan of each pair, with three on either side, where the second
    is."""
    _, _, scans, chain = simulation()
    parts = []
    for later, earlier in pairs:
        R, t = np.array(chain.poses.R), np.array(chain.poses.t)
        rows = slice(later - 3, later + 4)
        poses = chain.poses[earlier].compose(chain.poses[later].inverse()).compose(chain.poses[rows])
        R[rows], t[rows] = poses.R, poses.t
        parts.append(verified(scans, Pose(R, t), [later], [earlier]))
    return together(parts)
