"""Registering scans to a map of several: what one scan sees sparsely or at a slant, its neighbours see better."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers.core.arrays import IntArray
from solvers.core.pose import Pose
from solvers.geometry import nearest
from solvers.geometry.nearest import Index
from solvers.geometry.normals import Normals
from solvers.odometry.matching import Matches, MatchOptions, Scans, matched, matches_of


def local_map(scans: Scans, rows: Sequence[int], poses: Pose) -> tuple[Index, Normals]:
    """The echoes of the scans `rows` at their `poses`, as one cloud with its normals. If no scan has any, a single
    point without a normal, to which nothing can be matched.
    """
    if not scans.weights[list(rows)].any():
        point = np.zeros((1, 1, 2))
        return nearest.build(point), Normals(point, np.ones((1, 1), dtype=np.bool_), point)
    points, vectors, flagged, values = [], [], [], []
    for k, R, t in zip(rows, poses.R, poses.t, strict=True):
        echo = scans.weights[k] > 0.0
        points.append(Pose.trusted(R, t).apply(scans.points[k][echo]))
        vectors.append(scans.surface.vectors[k][echo] @ R.T)
        flagged.append(scans.surface.flagged[k][echo])
        values.append(scans.surface.eigenvalues[k][echo])
    cloud, normal, none, spread = (np.concatenate(part)[None] for part in (points, vectors, flagged, values))
    return nearest.build(cloud), Normals(normal, none, spread)


def match_to_map(
    scans: Scans, source: IntArray, target: IntArray, poses: Pose, around: int, start: Pose, options: MatchOptions
) -> Matches:
    """`match` for a single pair, with the target extended by up to `around` scans before and after it, at the chain's
    `poses`; not by the source, which fits itself wherever the chain has it.
    """
    j = int(target[0])
    rows = [k for k in range(max(j - around, 0), min(j + around + 1, len(scans))) if k != int(source[0])]
    index, surface = local_map(scans, rows, poses[j].inverse().compose(poses[rows]))
    return matches_of(source, target, matched(scans, source, index, surface, start, options), options)
