"""The recorded drive as a map seen from above: the echoes that are drawn of each scan, and the lines of its loops.

The poses come from a table (`widgets.parts.drive_table`), the echoes from the scans themselves.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from solvers import Pose
from solvers.scenes.drive import telecom_loop
from widgets.drawing.picture import Array, Points, Segments, View
from widgets.parts.drive_table import table

VIEW = View(-36.0, 32.0, -33.0, 17.0)
SCANS = 225
CHUNK = 15  # scans drawn as one mark, which is rendered once
EVERY = 13  # one in so many echoes of a scan is on the map: a page has several whole maps, and every dot costs bytes
APART = 0.35  # m between scans whose echoes are drawn: the robot stood still for the first twenty
FARTHEST = 30.0  # m


@lru_cache(maxsize=1)
def drawn_scans() -> tuple[int, ...]:
    """The scans whose echoes are drawn: each at least `APART` from the one before, by the matched poses."""
    t = table().way("matched").t
    scans = [0]
    for k in range(1, SCANS):
        if np.hypot(*(t[k] - t[scans[-1]])) >= APART:
            scans.append(k)
    return tuple(scans)


@lru_cache(maxsize=SCANS)
def echoes(k: int, every: int) -> Array:
    """Every `every`-th echo of scan k, in the robot's coordinates."""
    return telecom_loop().points(k, FARTHEST)[k % every :: every]


def inside(points: Array) -> Array:
    """The points inside the window."""
    x, y = points[:, 0], points[:, 1]
    return points[(x > VIEW.x0) & (x < VIEW.x1) & (y > VIEW.y0) & (y < VIEW.y1)]


def echo_marks(count: int, poses: str, kernel: str = "none", wrong: bool = False) -> list[Points]:
    """The echoes of the first `count` scans, placed by these poses of the table."""
    return [chunk(first, min(first + CHUNK, count), poses, kernel, wrong) for first in range(0, count, CHUNK)]


@lru_cache(maxsize=256)
def chunk(first: int, end: int, poses: str, kernel: str, wrong: bool) -> Points:
    """The echoes of the drawn scans from `first` to before `end`, as one mark that stays the same object."""
    way = table().way(poses, kernel, wrong)
    parts = [way[k].apply(echoes(k, EVERY)) for k in drawn_scans() if first <= k < end]
    points = inside(np.concatenate([np.zeros((0, 2)), *parts]))
    return Points(points, "target", "square", radius=1.0)


def loops(way: Pose, count: int, every: int = 1, weight: float | None = None) -> Segments:
    """A line between the two scans of every `every`-th loop among the first `count` scans."""
    data = table()
    rows = np.flatnonzero(data.later < count)[::every]
    a, b = way.t[data.earlier[rows]].reshape(-1, 2), way.t[data.later[rows]].reshape(-1, 2)
    return Segments(a, b, "inlier", None if weight is None else np.full(len(a), weight))
