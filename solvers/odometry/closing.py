"""Closing loops: the poses that agree best with a chain and with its loops."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.edges import Edges, pose_count, within
from solvers.core.kinds import of_kind
from solvers.core.pose import Pose
from solvers.core.poses import concatenated
from solvers.odometry.chain import Chain
from solvers.odometry.matching import Matches, Progress
from solvers.posegraph import GraphResult, checks, optimise

SOFT = np.diag([1.0 / 0.1**2, 1.0 / 0.1**2, 1.0 / 0.1**2])
"""The information of a link that is only predicted: standard deviations of 0.1 m and 0.1 rad."""


def edges_of(chain: Chain, loops: Matches, used: BoolArray | None = None) -> tuple[Edges, BoolArray]:
    """The edges of a graph whose nodes are the scans: the chain's links, then the loops used.

    Parameters
    ----------
    chain : Chain
        From `scan_to_scan` or `scan_to_map`.
    loops : Matches
        From `verified`.
    used : ndarray of bool, shape (c,), optional
        Which loops. None is those believed.

    Returns
    -------
    edges : Edges
        For `solvers.posegraph.optimise`.
    robust : ndarray of bool
        Which of them are loops, to which a kernel applies.

    Raises
    ------
    ValueError
        If `chain` is not a Chain, `loops` are not Matches, `used` is not one bool per
        loop, or names a loop that could not be matched.

    Examples
    --------
    >>> from solvers.odometry import candidates, edges_of, prepare, scan_to_scan, verified
    >>> from solvers.drives import simulated_drive
    >>> scans = prepare(simulated_drive()[0])
    >>> chain = scan_to_scan(scans, simulated_drive()[0].motion)
    >>> loops = verified(scans, chain.poses, *candidates(chain.poses))
    >>> edges, robust = edges_of(chain, loops)
    >>> len(edges) - len(scans) + 1 == robust.sum() == loops.believed.sum()
    np.True_
    """
    n = of_kind(chain, Chain, "chain").poses.batch[0]
    of_kind(loops, Matches, "loops")
    rows = np.flatnonzero(loops.believed if used is None else checks.mask(used, len(loops.source), "used", "a loop"))
    link = np.where(chain.believed[1:, None, None], chain.information[1:], SOFT)
    for k in rows[~loops.information[rows].any(axis=(1, 2))]:
        raise ValueError(f"used: loop {k}, of scans {loops.source[k]} and {loops.target[k]}, could not be matched")
    edges = Edges(
        np.concatenate([chain.reference[1:], loops.target[rows]]),
        np.concatenate([np.arange(1, n), loops.source[rows]]),
        concatenated([chain.measured[1:], loops.pose[rows]]),
        np.concatenate([link, loops.information[rows]]),
    )
    return edges, np.arange(n - 1 + len(rows)) >= n - 1


def close(
    chain: Chain,
    loops: Matches,
    used: BoolArray | None = None,
    *,
    kernel: str = "cauchy",
    fixed: int = 0,
    progress: Progress | None = None,
) -> GraphResult:
    """The poses that agree with the chain and with its loops.

    Parameters
    ----------
    chain : Chain
        From `scan_to_scan` or `scan_to_map`.
    loops : Matches
        From `verified`.
    used : ndarray of bool, shape (c,), optional
        Which loops. None is those believed.
    kernel : str, default "cauchy"
        The robust kernel for loops that do not agree; see `solvers.posegraph.optimise`.
    fixed : int, default 0
        The scan whose pose stays fixed.
    progress : callable, optional
        Called as `progress(steps, most)` after every step, and once more with the same
        number if the run ends without another step.

    Returns
    -------
    GraphResult
        n poses, with χ² and weights of the edges: n − 1 links, then the loops.

    Raises
    ------
    ValueError
        Where `edges_of` and `optimise` do.

    Examples
    --------
    >>> from solvers.odometry import candidates, close, prepare, scan_to_scan, verified
    >>> from solvers.drives import simulated_drive
    >>> drive, truth = simulated_drive()
    >>> scans = prepare(drive)
    >>> chain = scan_to_scan(scans, drive.motion)
    >>> result = close(chain, verified(scans, chain.poses, *candidates(chain.poses)))
    >>> print(result.status)
    converged
    """
    edges, robust = edges_of(chain, loops, used)
    return optimise(chain.poses, edges, fixed=fixed, kernel=kernel, robust=robust, progress=progress)


def missed(poses: Pose, loops: Matches) -> tuple[FloatArray, FloatArray]:
    """How far poses are from the loops' measurements.

    Parameters
    ----------
    poses : Pose
        n poses.
    loops : Matches
        c loops.

    Returns
    -------
    shift, turn : ndarray of shape (c,)
        The distance in metres between the two positions of the later scan's origin, and
        the angle between the two, in radians.

    Raises
    ------
    ValueError
        If the poses are not rigid motions of the plane, of shape (n,), if `loops` are
        not Matches, or a loop joins a scan that has no pose.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers.odometry import candidates, close, missed, prepare, scan_to_scan, verified
    >>> from solvers.drives import simulated_drive
    >>> drive, truth = simulated_drive()
    >>> scans = prepare(drive)
    >>> chain = scan_to_scan(scans, drive.motion)
    >>> loops = verified(scans, chain.poses, *candidates(chain.poses))
    >>> poses = close(chain, loops).poses
    >>> bool(np.median(missed(poses, loops)[0]) < np.median(missed(chain.poses, loops)[0]))
    True
    """
    n = pose_count(poses)
    of_kind(loops, Matches, "loops")
    for rows, name in ((loops.source, "loops.source"), (loops.target, "loops.target")):
        within(rows, n, name, "scan")
    gap = loops.pose.inverse().compose(poses[loops.target].inverse().compose(poses[loops.source]))
    return np.linalg.norm(gap.t, axis=-1), np.abs(gap.angle)
