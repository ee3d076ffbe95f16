"""A chain of poses from scans, each registered to the previous one or to a map of the last few.

An error in one link moves all that follow, so a chain drifts. Against a local map of several scans it drifts more
slowly than against a single scan, but each error also stays in the map.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray
from solvers.core.brief import brief
from solvers.core.edges import pose_count
from solvers.core.kinds import function, or_usual
from solvers.core.pose import Pose
from solvers.core.poses import concatenated, stacked
from solvers.odometry.maps import local_map
from solvers.odometry.matching import (
    Matches,
    MatchOptions,
    Progress,
    Scans,
    match_pairs,
    matched,
    matches_of,
    one_per_scan,
    together,
)
from solvers.scenes.drive import chained

PREDICTIONS = ("odometry", "velocity", "rest")


@dataclass(frozen=True, eq=False)
class Chain:
    """n poses, one per scan, and the links that they are made of.

    Attributes
    ----------
    poses : Pose
        n poses, each from the robot's coordinates at a scan to those at the first.
    motion : Pose
        n links, each from a scan's coordinates to those of the previous scan; the first
        is the identity.
    information : ndarray of shape (n, 3, 3)
        Of the matches, for (x, y, angle) in the later scan's coordinates; zero for the
        first. Meaningless for a link that is not believed: `edges_of` uses 0.1 m and
        0.1 rad instead.
    believed : ndarray of bool, shape (n,)
        Whether a link is a match; otherwise it is the prediction. True for the first.
    share : ndarray of shape (n,)
        The explained fraction of each scan at its match; 1 for the first.
    reference : ndarray of int64, shape (n,)
        The scan from which each is measured: the previous one, or for a match to a map,
        the last scan matched to it before. 0 for the first.

    Examples
    --------
    >>> from solvers.odometry import prepare, scan_to_scan
    >>> from solvers.drives import simulated_drive
    >>> drive, truth = simulated_drive()
    >>> chain = scan_to_scan(prepare(drive), drive.motion)
    >>> chain.poses.batch == chain.motion.batch == chain.share.shape
    True
    """

    poses: Pose
    motion: Pose
    information: FloatArray
    believed: BoolArray
    share: FloatArray
    reference: IntArray

    __repr__ = brief

    @property
    def measured(self) -> Pose:
        """n links, each from a scan's coordinates to those of its `reference`.

        The first is the identity. Scans between the two did not match, so the match
        says nothing of their motions.

        Examples
        --------
        >>> from solvers.odometry import prepare, scan_to_scan
        >>> from solvers.drives import simulated_drive
        >>> drive, truth = simulated_drive(scans=30)
        >>> chain = scan_to_scan(prepare(drive), drive.motion)
        >>> (chain.measured.t == chain.motion.t).all()
        np.True_
        """
        over = self.reference < np.arange(len(self.reference)) - 1
        across = self.poses[self.reference].inverse().compose(self.poses)
        R = np.where(over[:, None, None], across.R, self.motion.R)
        return Pose(R, np.where(over[:, None], across.t, self.motion.t))


def scan_to_scan(
    scans: Scans,
    motion: Pose,
    options: MatchOptions | None = None,
    *,
    prediction: str = "odometry",
    progress: Progress | None = None,
) -> Chain:
    """Register every scan to the previous one.

    Parameters
    ----------
    scans : Scans
        From `prepare`.
    motion : Pose
        n motions by odometry, as in `Drive.motion`.
    options : MatchOptions, optional
        None takes the defaults.
    prediction : str, default "odometry"
        The start of each match, and its replacement if it is not believed: "odometry";
        "velocity", the previous match repeated; "rest", no motion. With "odometry" no
        match waits for another, and many run at once.
    progress : callable, optional
        Called as `progress(done, links)` from time to time.

    Returns
    -------
    Chain
        As many poses as scans.

    Raises
    ------
    ValueError
        If an argument is not of the type given above, if the motions are not as many
        rigid motions of the plane as there are scans, or there is no such prediction.

    Examples
    --------
    >>> from solvers.odometry import prepare, scan_to_scan
    >>> from solvers.drives import simulated_drive
    >>> drive, truth = simulated_drive(scans=30)
    >>> chain = scan_to_scan(prepare(drive), drive.motion)
    >>> bool(chain.believed.all())
    True
    """
    n = one_per_scan(scans, motion, "motion")
    validate.one_of(prediction, PREDICTIONS, "prediction")
    options = or_usual(options, MatchOptions, "options")
    function(progress, "progress")
    rows = np.arange(1, n, dtype=np.int64)
    if prediction == "odometry" or n == 1:
        return _chain(match_pairs(scans, rows, rows - 1, motion[1:], options, progress), motion[1:])
    parts, starts = [], []
    start = Pose.identity()
    for k in range(1, n):
        match = match_pairs(scans, rows[k - 1 : k], rows[k - 1 : k] - 1, stacked([start]), options)
        parts.append(match)
        starts.append(start)
        if prediction == "velocity" and match.believed[0]:
            start = match.pose[0]
        if progress is not None:
            progress(k, n - 1)
    return _chain(together(parts), stacked(starts))


def keyframes(poses: Pose, shift: float = 0.5, turn: float = 0.2) -> IntArray:
    """Scans that lie apart: the first, and each that moved or turned far enough from the previous keyframe.

    Parameters
    ----------
    poses : Pose
        n poses.
    shift : float, default 0.5
        The distance that makes a new keyframe, metres.
    turn : float, default 0.2
        The turn that makes one, radians.

    Returns
    -------
    ndarray of int64
        Their numbers, ascending.

    Raises
    ------
    ValueError
        If there is no pose, or the poses are not rigid motions of the plane, of shape
        (n,), or `shift` or `turn` is negative or not a number.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.odometry import keyframes
    >>> keyframes(Pose.from_angle([0.0, 0.0, 0.3, 0.3], [[0.0, 0.0], [0.3, 0.0], [0.3, 0.0], [0.9, 0.0]]))
    array([0, 2, 3])
    """
    n = pose_count(poses)
    shift, turn = validate.reach(shift, "shift", 0.0), validate.reach(turn, "turn", 0.0)
    if not n:
        raise ValueError("poses: is empty; at least one pose is needed")
    rows = [0]
    for k in range(1, n):
        if _apart(poses[rows[-1]], poses[k], shift, turn):
            rows.append(k)
    return np.array(rows, dtype=np.int64)


def scan_to_map(
    scans: Scans,
    motion: Pose,
    options: MatchOptions | None = None,
    *,
    length: int = 8,
    shift: float = 0.5,
    turn: float = 0.2,
    progress: Progress | None = None,
) -> Chain:
    """Register every scan to a map of the last keyframes, starting from the odometry.

    Where that match is not believed but one to the previous scan is, as after a gap in
    the recording, a new map begins with the previous scan.

    Parameters
    ----------
    scans : Scans
        From `prepare`.
    motion : Pose
        n motions by odometry.
    options : MatchOptions, optional
        None takes the defaults.
    length : int, default 8
        How many keyframes make up the map; with 1, a scan is registered to the last
        keyframe alone.
    shift : float, default 0.5
        As for `keyframes`.
    turn : float, default 0.2
        As for `keyframes`.
    progress : callable, optional
        Called as `progress(done, links)` after every scan.

    Returns
    -------
    Chain
        As many poses as scans. The links are the motions between the poses found.

    Raises
    ------
    ValueError
        If an argument is not of the type given above, if the motions are not as many
        rigid motions of the plane as there are scans, if the length is below 1, or
        `shift` or `turn` is negative.

    Examples
    --------
    >>> from solvers.odometry import prepare, scan_to_map
    >>> from solvers.drives import simulated_drive
    >>> drive, truth = simulated_drive(scans=30)
    >>> chain = scan_to_map(prepare(drive), drive.motion)
    >>> bool(abs(chain.poses.t[-1] - truth.t[-1]).max() < 0.1)
    True
    """
    n = one_per_scan(scans, motion, "motion")
    validate.count(length, "length", 1)
    shift, turn = validate.reach(shift, "shift", 0.0), validate.reach(turn, "turn", 0.0)
    options = or_usual(options, MatchOptions, "options")
    function(progress, "progress")
    poses = [Pose.identity()]
    believed, share = np.ones(n, dtype=np.bool_), np.ones(n)
    link_information = np.zeros((n, 3, 3))
    reference = np.maximum(np.arange(n) - 1, 0)
    begin = int(np.argmax(scans.weights.any(axis=1)))  # the scans before it are empty, so there is no map yet
    for k in range(1, begin + 1):
        poses.append(poses[-1].compose(motion[k]))
        believed[k], share[k] = False, 0.0
        if progress is not None:
            progress(k, n - 1)
    recent, last = [begin], begin  # the map's keyframes; the last scan whose pose on the map is measured
    index, surface = local_map(scans, recent, Pose.identity(batch=(1,)))
    for k in range(begin + 1, n):
        # All in the coordinates of the last keyframe, so that no number grows with the drive.
        frame = poses[recent[-1]]
        start = frame.inverse().compose(poses[-1]).compose(motion[k])
        row, pose = np.array([k]), Pose.trusted(start.R[None], start.t[None])
        state = matched(scans, row, index, surface, pose, options)
        match = matches_of(row, np.array(recent[-1:]), state, options)
        if not match.believed[0] and recent != [k - 1]:
            # The map may lie behind for good, as after a gap: begin a new one if the scan fits the previous scan.
            previous = match_pairs(scans, row, row - 1, motion[k : k + 1], options)
            if previous.believed[0]:
                match, recent, last, frame = previous, [k - 1], k - 1, poses[-1]
                index, surface = local_map(scans, recent, Pose.identity(batch=(1,)))
        believed[k], share[k], link_information[k] = match.believed[0], match.share[0], match.information[0]
        if believed[k]:
            reference[k], last = last, k
        pose = frame.compose(match.pose[0] if believed[k] else start)
        # Make R a rotation again: its rounding error would double with every keyframe that is inverted.
        poses.append(Pose.from_angle(pose.angle, pose.t))
        if believed[k] and _apart(frame, poses[k], shift, turn):
            recent = [*recent, k][-length:]
            back = poses[recent[-1]].inverse()
            index, surface = local_map(scans, recent, stacked([back.compose(poses[j]) for j in recent]))
        if progress is not None:
            progress(k, n - 1)
    whole = stacked(poses)
    links = whole[:-1].inverse().compose(whole[1:])
    return Chain(whole, concatenated([Pose.identity(batch=(1,)), links]), link_information, believed, share, reference)


def _apart(a: Pose, b: Pose, shift: float, turn: float) -> bool:
    between = a.inverse().compose(b)
    return bool(np.hypot(*between.t) >= shift or abs(float(between.angle)) >= turn)


def _chain(matches: Matches, predicted: Pose) -> Chain:
    ok = matches.believed
    links = concatenated([
        Pose.identity(batch=(1,)),
        Pose(
            np.where(ok[:, None, None], matches.pose.R, predicted.R),
            np.where(ok[:, None], matches.pose.t, predicted.t),
        ),
    ])  # fmt: skip
    link_information = np.concatenate([np.zeros((1, 3, 3)), matches.information])
    reference = np.maximum(np.arange(len(ok) + 1) - 1, 0)
    shares = np.append(1.0, matches.share)
    return Chain(chained(links), links, link_information, np.append(True, ok), shares, reference)
