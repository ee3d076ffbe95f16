"""Registering scans to scans, many pairs at once.

The method is point-to-plane ICP (`solvers.methods.icp.point_to_plane`) with a gate and a redescending weight. Scans
have different numbers of echoes, so they are stored in one array padded with repeats of the last echo: a repeat has no
weight as a source, and as a target it never has the lowest row at its distance, so it changes no pair. Normals are
computed once per scan, without the padding.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.edges import rigid, row_numbers, within
from solvers.core.kinds import function, of_kind, or_usual
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.poses import concatenated
from solvers.core.status import Status
from solvers.core.stepper import Batch, begin, run
from solvers.geometry import nearest
from solvers.geometry.nearest import Index
from solvers.geometry.normals import NEIGHBOURS, Normals, normals
from solvers.methods.icp import surface_icp
from solvers.methods.icp.surface_icp import SurfaceOptions, SurfaceState
from solvers.odometry import signs
from solvers.odometry.sweep import straightened
from solvers.scenes.drive import Drive

TOGETHER = 32  # pairs that run as one batch: more gains little, and progress is reported after each batch
FEWEST = 3  # echoes that a scan must have to be matched at all

Progress = Callable[[int, int], Any]
"""Called with the number of pairs done and the total."""


@dataclass(frozen=True)
class MatchOptions:
    """How two scans are registered, and when the result is believed.

    Parameters
    ----------
    gate : float, default 0.5
        Pairs farther apart are not used, metres.
    weight : str, default "tukey"
        A kernel of `solvers.robust` on the distance of a pair.
    reach : float, default 0.15
        How near an echo must be to one of the target's to count as explained, metres.
    sigma : float, default 0.035
        σ of a pair's distance along the normal, metres: above the laser's noise, since
        neighbouring beams err alike.
    least_share : float, default 0.3
        The fraction of echoes that must be explained.
    least_weakest : float, default 0.01
        The least ratio of the smallest eigenvalue to the largest after `margin` has
        been taken off: below it a motion is nearly free.
    margin : float, default 1.5
        How many times the part that the noise of the normals alone contributes is taken
        off that ratio. With 0, matches along bare walls are believed: at 1 cm of noise
        some, at 3 cm all. With the default none are, in simulations of a corridor.
    max_steps : int, default 40
        The most steps.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers.odometry import MatchOptions
    >>> MatchOptions(gate=1.0).surface().gate
    1.0
    """

    gate: float = 0.5
    weight: str = "tukey"
    reach: float = 0.15
    sigma: float = 0.035
    least_share: float = 0.3
    least_weakest: float = 0.01
    margin: float = 1.5
    max_steps: int = 40

    def __post_init__(self) -> None:
        self.surface()
        validate.number(self.reach, "reach", 1e-6)
        validate.number(self.sigma, "sigma", 1e-6)
        validate.number(self.least_share, "least_share", 0.0, 1.0)
        validate.number(self.least_weakest, "least_weakest", 0.0, 1.0)
        validate.number(self.margin, "margin", 0.0)
        validate.count(self.max_steps, "max_steps", 1)

    def surface(self) -> SurfaceOptions:
        """The options of the registration method."""
        return SurfaceOptions(gate=self.gate, weight=self.weight, tolerance=1e-5, rms_tolerance=1e-5)


@dataclass(frozen=True, eq=False)
class Scans:
    """n scans prepared for matching, each in the robot's coordinates.

    Attributes
    ----------
    points : ndarray of shape (n, m, 2)
        The echoes, padded to the largest number by repeats of the last.
    weights : ndarray of shape (n, m)
        1 for an echo, 0 for padding. All 0 for a scan of fewer than three echoes, which
        matches nothing.
    surface : Normals
        The normals of each scan, flagged where missing.

    Examples
    --------
    >>> from solvers.odometry import prepare
    >>> from solvers.drives import telecom_loop
    >>> scans = prepare(telecom_loop())
    >>> len(scans), scans.cloud(0).shape
    (225, (296, 2))
    """

    points: FloatArray
    weights: FloatArray
    surface: Normals

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.points)

    def cloud(self, k: int) -> FloatArray:
        """The echoes of one scan, without the padding.

        Parameters
        ----------
        k : int
            The scan's number, from 0.

        Returns
        -------
        ndarray of shape (m, 2)

        Raises
        ------
        ValueError
            If there is no such scan.
        """
        if validate.count(k, "k") >= len(self):
            raise ValueError(f"k: expected a scan from 0 to {len(self) - 1}, got {k}")
        echoes: FloatArray = self.points[k][self.weights[k] > 0.0]
        return echoes


def prepare(drive: Drive, farthest: float = 30.0, every: int = 1) -> Scans:
    """The scans of a drive, prepared for matching.

    Parameters
    ----------
    drive : Drive
        The recording.
    farthest : float, default 30.0
        The range beyond which echoes are left out, metres: there the beams are so far
        apart that a wall has no normal.
    every : int, default 1
        Keep every `every`-th echo.

    Returns
    -------
    Scans
        As many scans as the drive has. One with fewer than three echoes left is empty:
        it is not matched, and the link to it is the prediction.

    Raises
    ------
    ValueError
        If `drive` is not a Drive, `farthest` is negative, `every` is not a positive
        integer, or no scan has three echoes left.

    Examples
    --------
    >>> from solvers.odometry import prepare
    >>> from solvers.drives import telecom_loop
    >>> scans = prepare(telecom_loop())
    >>> scans.points.shape, int(scans.weights[0].sum())
    ((225, 347, 2), 296)
    """
    validate.count(every, "every", 1)
    clouds = [cloud[::every] for cloud in straightened(drive, farthest)]
    clouds = [cloud if len(cloud) >= FEWEST else cloud[:0] for cloud in clouds]
    n, most = len(clouds), max(map(len, clouds), default=0)
    if not most:
        raise ValueError(f"drive: none of {n} scans has three echoes within {farthest:g} m")
    points, weights = np.zeros((n, most, 2)), np.zeros((n, most))
    vectors, flagged, values = np.zeros((n, most, 2)), np.ones((n, most), dtype=np.bool_), np.zeros((n, most, 2))
    for k, cloud in enumerate(clouds):
        m = len(cloud)
        if not m:
            continue
        points[k, :m], points[k, m:], weights[k, :m] = cloud, cloud[-1], 1.0
        surface = normals(nearest.build(cloud[None]), NEIGHBOURS)
        vectors[k, :m], flagged[k, :m], values[k, :m] = surface.vectors[0], surface.flagged[0], surface.eigenvalues[0]
    return Scans(points, weights, Normals(vectors, flagged, values))


@dataclass(frozen=True, eq=False)
class Matches:
    """The results of registering b pairs of scans.

    Attributes
    ----------
    source : ndarray of int64, shape (b,)
        The scan that was moved.
    target : ndarray of int64, shape (b,)
        The scan that stayed.
    pose : Pose
        b poses from the source's coordinates to the target's.
    share : ndarray of shape (b,)
        The fraction of the source's echoes with one of the target's within reach.
    rms : ndarray of shape (b,)
        Of the distances along the normal over the weighted pairs, metres.
    weakest : ndarray of shape (b,)
        Smallest over largest eigenvalue of the system, less the noise's part (see
        `MatchOptions.margin`) and at least 0; near 0 a motion is free.
    information : ndarray of shape (b, 3, 3)
        For (x, y, angle) in the source's coordinates, the inverse of a covariance in
        m², m rad and rad².
    status : ndarray of int8, shape (b,)
        How each run stopped.
    reason : ndarray of object, shape (b,)
        The same in words.
    believed : ndarray of bool, shape (b,)
        Whether `share` and `weakest` reach the options' limits and the run is not
        degenerate.

    Examples
    --------
    >>> from solvers.odometry import match, prepare
    >>> from solvers.drives import telecom_loop
    >>> drive = telecom_loop()
    >>> found = match(prepare(drive), [1, 2], [0, 1], drive.motion[[1, 2]])
    >>> found.pose.batch, found.believed
    ((2,), array([ True,  True]))
    """

    source: IntArray
    target: IntArray
    pose: Pose
    share: FloatArray
    rms: FloatArray
    weakest: FloatArray
    information: FloatArray
    status: StatusArray
    reason: ReasonArray
    believed: BoolArray

    __repr__ = brief


def match(
    scans: Scans,
    source: Any,
    target: Any,
    start: Pose,
    options: MatchOptions | None = None,
    progress: Progress | None = None,
) -> Matches:
    """Register pairs of scans, many at once.

    Parameters
    ----------
    scans : Scans
        From `prepare`.
    source : array_like of int, shape (b,)
        The scans that are moved.
    target : array_like of int, shape (b,)
        The scans that stay.
    start : Pose
        b starts, from the source's coordinates to the target's.
    options : MatchOptions, optional
        None takes the defaults.
    progress : callable, optional
        Called as `progress(done, b)` after every `TOGETHER` pairs.

    Returns
    -------
    Matches
        The results for all b pairs.

    Raises
    ------
    ValueError
        If an argument is not of the type given above, if the numbers of pairs differ,
        if a scan's number is not an integer or names no scan, or if the starts are not
        rigid motions of the plane.

    Examples
    --------
    >>> from solvers.odometry import match, prepare
    >>> from solvers.drives import telecom_loop
    >>> drive = telecom_loop()
    >>> found = match(prepare(drive), [60], [59], drive.motion[[60]])
    >>> bool(found.believed[0]), bool(found.share[0] > 0.7)
    (True, True)
    """
    options = or_usual(options, MatchOptions, "options")
    function(progress, "progress")
    i, j = scan_numbers(scans, source, "source"), scan_numbers(scans, target, "target")
    batch = rigid(start, "start").batch
    if not i.shape == j.shape == batch:
        raise ValueError(f"source, target, start: expected one of each per pair, got {i.shape}, {j.shape}, {batch}")
    return match_pairs(scans, i, j, start, options, progress)


def scan_numbers(scans: Scans, values: Any, name: str) -> IntArray:
    """`values` as scan numbers, (b,); else a ValueError."""
    rows = row_numbers(values, name)
    within(rows, len(of_kind(scans, Scans, "scans")), name, "scan")
    return rows


def one_per_scan(scans: Scans, poses: Pose, name: str) -> int:
    """The number n of scans if `poses` are n rigid motions of the plane; else a ValueError."""
    of_kind(scans, Scans, "scans")
    batch = rigid(poses, name).batch
    if batch != (len(scans),):
        raise ValueError(f"{name}: expected one per scan, shape ({len(scans)},), got {batch}")
    return len(scans)


def match_pairs(
    scans: Scans, i: IntArray, j: IntArray, start: Pose, options: MatchOptions, progress: Progress | None = None
) -> Matches:
    """`match` for pairs already checked."""
    parts = []
    for first in range(0, len(i), TOGETHER):
        block = slice(first, first + TOGETHER)
        near = j[block]
        surface = Normals(scans.surface.vectors[near], scans.surface.flagged[near], scans.surface.eigenvalues[near])
        state = matched(scans, i[block], nearest.build(scans.points[near]), surface, start[block], options)
        parts.append(matches_of(i[block], near, state, options))
        if progress is not None:
            progress(min(first + TOGETHER, len(i)), len(i))
    return together(parts)


def together(parts: Sequence[Matches]) -> Matches:
    """Several matches concatenated in order."""
    if not parts:
        none, no_rows = np.zeros(0), np.zeros(0, dtype=np.int64)
        return Matches(
            no_rows, no_rows, Pose.identity(batch=(0,)), none, none, none, np.zeros((0, 3, 3)),
            np.zeros(0, dtype=np.int8), np.zeros(0, dtype=object), np.zeros(0, dtype=np.bool_),
        )  # fmt: skip
    pose = concatenated([part.pose for part in parts])
    arrays = {
        f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Matches) if f.name != "pose"
    }
    return Matches(pose=pose, **arrays)


def matched(
    scans: Scans, source: IntArray, index: Index, surface: Normals, start: Pose, options: MatchOptions
) -> SurfaceState:
    """The final states of the runs of b source scans, on targets given as an index and their normals."""
    seed = np.zeros(len(source), dtype=np.int64)
    problem = Problem(scans.points[source], index.points, scans.weights[source], start, seed)

    def first(scan_problem: Problem, surface_options: SurfaceOptions) -> SurfaceState:
        return surface_icp.start(scan_problem, surface_options, index, surface, None)

    method: Method[SurfaceState] = Method(
        "scan-matching", "point to plane on prepared scans", "Chen & Medioni 1992", first, surface_icp.step,
        SurfaceOptions, weighted=True,
    )  # fmt: skip
    batch: Batch[SurfaceState] = begin(method, problem, options.surface(), options.max_steps)
    return run(batch)[0].state()


def matches_of(i: IntArray, j: IntArray, state: SurfaceState, options: MatchOptions) -> Matches:
    """The matches of sources i to targets j, (b,) each, from the final states."""
    share, weakest = signs.explained(state, options.reach), signs.determined(state, options.margin)
    believed = (state.status != Status.DEGENERATE) & (share >= options.least_share) & (weakest >= options.least_weakest)
    return Matches(
        i, j, state.pose, share, state.pairing.rms, weakest, signs.information(state, options.sigma), state.status,
        state.reason, believed,
    )  # fmt: skip
