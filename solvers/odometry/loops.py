"""Loops: the pairs of scans, far apart in a drive, that see the same place.

A loop edge claims that two scans far apart in the drive see the same place. A wrong one bends the whole map, so four
signs are checked: how much of the scan is explained, whether a motion is free, whether the reverse match agrees, and
how far the match is from the chain's prediction. Loops that pass enter the graph under a robust kernel.

The first two are those of `solvers.verify.evidence`, read from the match's last state instead of recomputed, without
the padding echoes, and less what the noise of the normals gives a motion. The third replaces `solvers.verify.halves`:
two halves of one scan see the same things from the same place and share their errors, while the reverse match has other
sources, other normals and another view.

A scan is matched to a map of the scans around its partner, because matches of two single scans taken side by side may
agree both ways and still be centimetres off.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.api import register
from solvers.core import validate
from solvers.core.arrays import IntArray
from solvers.core.kinds import function, or_usual
from solvers.core.pose import Pose
from solvers.odometry.chain import keyframes
from solvers.odometry.maps import match_to_map
from solvers.odometry.matching import (
    Matches,
    MatchOptions,
    Progress,
    Scans,
    match_pairs,
    one_per_scan,
    scan_numbers,
    together,
)

SEARCHES = ("none", "correlative", "branch-and-bound")


@dataclass(frozen=True)
class LoopOptions:
    """Where to look for loops, and which to keep.

    Parameters
    ----------
    radius : float, default 3.0
        How near two scans of the chain must lie, metres.
    turn : float, default 0.8
        By how much they may be turned against each other, radians.
    apart : float, default 15.0
        How far the robot must have driven between them, metres.
    most : int, default 2
        The most candidates per scan; the nearest are kept.
    least_share : float, default 0.5
        The fraction of echoes that a loop must explain.
    least_weakest : float, default 0.05
        The least `Matches.weakest` of a loop: more than of a link, since a wrong loop
        bends the whole map.
    agree_shift : float, default 0.1
        How far apart the matches in the two directions may be, metres.
    agree_turn : float, default 0.02
        By how much they may be turned against each other, radians.
    farthest : float, default 1.5
        How far a match may lie from the chain's prediction, metres; infinite to ignore
        the chain.
    around : int, default 3
        How many scans before and after a scan join it in the map that its partner is
        matched to; with 0, the partner is matched to the scan alone.
    search : {"none", "correlative", "branch-and-bound"}, default "none"
        Where matches start. "none" is the chain's prediction; the others are methods of
        `solvers.register` that search everywhere and ignore the chain: "correlative"
        takes half a second per pair; "branch-and-bound" proves its pose and takes up to
        a minute if the two scans have little in common.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers.odometry import LoopOptions
    >>> LoopOptions().radius
    3.0
    """

    radius: float = 3.0
    turn: float = 0.8
    apart: float = 15.0
    most: int = 2
    least_share: float = 0.5
    least_weakest: float = 0.05
    agree_shift: float = 0.1
    agree_turn: float = 0.02
    farthest: float = 1.5
    around: int = 3
    search: str = "none"

    def __post_init__(self) -> None:
        for name in ("radius", "turn", "apart", "agree_shift", "agree_turn"):
            validate.number(getattr(self, name), name, 0.0)
        validate.reach(self.farthest, "farthest", 0.0)
        validate.count(self.around, "around")
        validate.one_of(self.search, SEARCHES, "search")
        for name in ("least_share", "least_weakest"):
            validate.number(getattr(self, name), name, 0.0, 1.0)
        validate.count(self.most, "most", 1)


def candidates(poses: Pose, options: LoopOptions | None = None) -> tuple[IntArray, IntArray]:
    """Pairs of keyframes that may see the same place, according to a chain.

    Parameters
    ----------
    poses : Pose
        n poses of a chain.
    options : LoopOptions, optional
        None takes the defaults.

    Returns
    -------
    later, earlier : ndarray of int64, shape (c,)
        Numbers of scans.

    Raises
    ------
    ValueError
        If there is no pose, or the poses are not rigid motions of the plane, of shape
        (n,), or `options` are not LoopOptions.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.odometry import candidates
    >>> round_trip = np.concatenate([np.arange(11.0), np.arange(10.0, -1.0, -1.0)])
    >>> poses = Pose.from_angle(np.zeros(22), np.stack([round_trip, np.zeros(22)], axis=1))
    >>> later, earlier = candidates(poses)
    >>> later[0], earlier[0]
    (np.int64(17), np.int64(1))
    """
    options = or_usual(options, LoopOptions, "options")
    frames = keyframes(poses)
    odometer = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(poses.t, axis=0), axis=1)))
    later, earlier = [], []
    for b in frames.tolist():
        frames_before = frames[odometer[b] - odometer[frames] >= options.apart]
        frames_before = frames_before[frames_before < b]
        gap = np.linalg.norm(poses.t[frames_before] - poses.t[b], axis=1)
        heading = np.abs(Pose.trusted(poses.R[frames_before] @ poses.R[b].T, np.zeros(2)).angle)
        near = (gap <= options.radius) & (heading <= options.turn)
        for a in frames_before[near][np.argsort(gap[near], kind="stable")][: options.most].tolist():
            later.append(b)
            earlier.append(a)
    return np.array(later, dtype=np.int64), np.array(earlier, dtype=np.int64)


def verified(
    scans: Scans,
    poses: Pose,
    later: Any,
    earlier: Any,
    options: LoopOptions | None = None,
    matching: MatchOptions | None = None,
    progress: Progress | None = None,
) -> Matches:
    """Match candidates and mark as `believed` those that pass all four checks.

    A first match, scan to scan, has three times the gate, since a chain may have
    drifted by more than the gate. Its result starts a second match, to a map of the
    surrounding scans at the chain's poses.

    Parameters
    ----------
    scans : Scans
        From `prepare`.
    poses : Pose
        The chain's.
    later, earlier : array_like of int, shape (c,)
        As from `candidates`.
    options : LoopOptions, optional
        None takes the defaults.
    matching : MatchOptions, optional
        None takes the defaults.
    progress : callable, optional
        Called as `progress(done, c)` after every candidate.

    Returns
    -------
    Matches
        The results for the c candidates, each from the later scan's coordinates to the
        earlier's.

    Raises
    ------
    ValueError
        If an argument is not of the type given above, if `later` and `earlier` differ
        in length or name one scan twice, if a scan's number is not an integer or names
        no scan, or if the poses are not as many rigid motions of the plane as there are
        scans.

    Examples
    --------
    >>> from solvers.odometry import candidates, prepare, scan_to_scan, verified
    >>> from solvers.drives import simulated_drive
    >>> drive, truth = simulated_drive()
    >>> scans = prepare(drive)
    >>> chain = scan_to_scan(scans, drive.motion)
    >>> bool(verified(scans, chain.poses, *candidates(chain.poses)).believed.any())
    True
    """
    options, matching = or_usual(options, LoopOptions, "options"), or_usual(matching, MatchOptions, "matching")
    function(progress, "progress")
    one_per_scan(scans, poses, "poses")
    later, earlier = scan_numbers(scans, later, "later"), scan_numbers(scans, earlier, "earlier")
    if len(later) != len(earlier):
        raise ValueError(f"later, earlier: expected one of each per candidate, got {len(later)} and {len(earlier)}")
    if (later == earlier).any():
        raise ValueError("later, earlier: a candidate joins a scan to itself")
    parts = []
    for k in range(len(later)):
        parts.append(_verified(scans, poses, later[k : k + 1], earlier[k : k + 1], options, matching))
        if progress is not None:
            progress(k + 1, len(later))
    return together(parts)


def _verified(
    scans: Scans, poses: Pose, later: IntArray, earlier: IntArray, options: LoopOptions, matching: MatchOptions
) -> Matches:
    """`verified` for a single candidate."""
    predicted = poses[earlier].inverse().compose(poses[later])
    has_echoes = scans.weights[later].any() and scans.weights[earlier].any()
    search = has_echoes and options.search != "none"
    start = _search(scans, int(later[0]), int(earlier[0]), options.search) if search else predicted
    wide = match_pairs(scans, later, earlier, start, replace(matching, gate=3.0 * matching.gate))
    forward = match_to_map(scans, later, earlier, poses, options.around, wide.pose, matching)
    back = match_to_map(scans, earlier, later, poses, options.around, forward.pose.inverse(), matching)
    gap = forward.pose.compose(back.pose)
    agree = (np.linalg.norm(gap.t, axis=-1) <= options.agree_shift) & (np.abs(gap.angle) <= options.agree_turn)
    near = np.linalg.norm(forward.pose.t - predicted.t, axis=-1) <= options.farthest
    enough = np.minimum(forward.share, back.share) >= options.least_share
    determined = forward.weakest >= options.least_weakest
    return replace(forward, believed=forward.believed & back.believed & agree & near & enough & determined)


def _search(scans: Scans, later: int, earlier: int, method: str) -> Pose:
    """The pose (1,) of one scan on another that a search over all poses finds."""
    pose = register(scans.cloud(later), scans.cloud(earlier), method).pose
    return Pose.trusted(pose.R[None], pose.t[None])
