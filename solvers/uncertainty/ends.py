"""The spread of the end poses of many runs, from redrawn scans or from a spread of starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from solvers.api import register
from solvers.core import validate
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.brief import brief
from solvers.core.edges import rigid
from solvers.core.kinds import of_kind
from solvers.core.method import Method
from solvers.core.numbers import finite, numbers, unequal
from solvers.core.pose import Pose
from solvers.core.poses import concatenated, stacked
from solvers.core.registry import rigid_method_of
from solvers.core.result import Result
from solvers.uncertainty import se2
from solvers.uncertainty.matrices import from_scaled
from solvers.uncertainty.region import Covariance

APART = 0.25
"""The default distance between modes, as a fraction of the cloud's radius."""


@dataclass(frozen=True, eq=False)
class Spread:
    """The end poses of k runs, described by one matrix and by their modes.

    Attributes
    ----------
    poses : Pose
        The k end poses.
    mode : ndarray of int64, shape (k,)
        The group of each pose; 0 is the largest. Poses closer than the threshold belong
        together, as do all connected by a chain of such poses.
    whole : Covariance
        One mean and one matrix for all poses.
    modes : tuple of Covariance
        One per group, largest first; a group of one pose has no spread.

    Examples
    --------
    >>> import numpy as np
    >>> from solvers import Pose
    >>> from solvers.uncertainty import spread_of
    >>> poses = Pose.from_angle(np.radians([0.0, 1.0, 2.0, 180.0, 181.0]))
    >>> spread = spread_of(poses, centre=(0.0, 0.0), radius=3.0)
    >>> spread.mode, len(spread.modes)
    (array([0, 0, 0, 1, 1]), 2)
    """

    poses: Pose
    mode: IntArray
    whole: Covariance
    modes: tuple[Covariance, ...]

    __repr__ = brief

    @property
    def shares(self) -> FloatArray:
        """The fraction of the poses in each mode, largest first.

        Examples
        --------
        >>> import numpy as np
        >>> from solvers import Pose
        >>> from solvers.uncertainty import spread_of
        >>> poses = Pose.from_angle(np.array([0.0, 0.01, 0.02, 3.0]))
        >>> spread_of(poses, centre=(0.0, 0.0), radius=1.0).shares
        array([0.75, 0.25])
        """
        return np.bincount(self.mode) / self.mode.size


def spread_of(
    poses: Pose, *, centre: ArrayLike, radius: float, apart: float | None = None, made_by: str = "sampled"
) -> Spread:
    """The spread of k poses.

    Parameters
    ----------
    poses : Pose
        Rigid motions of the plane, of shape (k,), k ≥ 2.
    centre : array_like of shape (2,)
        The cloud's centre in source coordinates.
    radius : float
        The cloud's RMS radius, world units.
    apart : float, optional
        The distance from which on two poses belong to different modes, world units: the
        RMS distance between the cloud's points as moved by each. None is a quarter of
        the radius.
    made_by : str, default "sampled"
        The `made_by` of the covariances.

    Returns
    -------
    Spread
        All poses, their modes, and the covariances in the frame "target".

    Raises
    ------
    ValueError
        If the poses are fewer than two, or not rigid motions of the plane, or the
        centre is not a point of the plane.

    Notes
    -----
    The mean is the pose about which the twists average to zero, found by iteration; the
    covariance is the sum of the outer products of these twists over k − 1. With modes
    half a turn apart there is no meaningful mean: `whole` shows what one matrix makes
    of them.

    Examples
    --------
    >>> from solvers import Pose
    >>> from solvers.uncertainty import spread_of
    >>> poses = Pose.from_angle(0.0, [(0.0, 0.0), (0.1, 0.0), (0.2, 0.0)])
    >>> spread_of(poses, centre=(1.0, 0.0), radius=2.0).whole.words()
    'widest: the slide along (1.00, 0.00), σ = 0.1 u'
    """
    poses = rigid(poses, "poses")
    if len(poses.batch) != 1 or poses.batch[0] < 2:
        raise ValueError(f"poses: expected two or more, in one row, got the shape {poses.batch}")
    radius = validate.number(radius, "radius", 1e-100, 1e100)
    limit = APART * radius if apart is None else validate.number(apart, "apart", 0.0)
    middle = finite(numbers(centre, "centre"), "centre")
    if middle.shape != (2,):
        raise ValueError(f"centre: expected shape (2,), got {middle.shape}")
    mode = _modes(poses, middle, radius, limit)
    groups = tuple(_gaussian(poses[mode == k], middle, radius, made_by) for k in range(int(mode.max()) + 1))
    # Start from the largest mode's mean, which the iteration leaves only for a smaller spread.
    whole = groups[0] if len(groups) == 1 else _gaussian(poses, middle, radius, made_by, groups[0].mean)
    return Spread(poses, mode, whole, groups)


def monte_carlo(
    source: ArrayLike | Sequence[ArrayLike], target: ArrayLike | Sequence[ArrayLike],
    method: str | Method[Any] = "icp", *, start: Pose | None = None,
    weights: ArrayLike | Sequence[ArrayLike | None] | None = None, apart: float | None = None, **options: Any,
) -> Spread:  # fmt: skip
    """Register redrawn scans, each as if it were the only one, and keep all end poses.

    The caller decides what to redraw: the noise, the rays, the start. Sources of error
    that are not redrawn do not appear in the spread.

    Parameters
    ----------
    source : array_like of shape (k, m, 2) or (m, 2), or list of k (m, 2) arrays
        The clouds to move, one per draw or one for all.
    target : array_like of shape (k, n, 2) or (n, 2), or list of k (n, 2) arrays
        The clouds that stay.
    method : str or Method, default "icp"
        As for `solvers.register`.
    start : Pose, optional
        The starting poses, of shape () or (k,).
    weights : array_like, optional
        As for `solvers.register`.
    apart : float, optional
        As for `spread_of`.
    **options
        The method's own.

    Returns
    -------
    Spread
        Of the k end poses, however the runs stopped, about the centre of the first
        source's points with a weight; if pairs are given, of those that are paired.

    Raises
    ------
    ValueError
        If there are fewer than two draws, if the method finds a scale, or if
        `solvers.register` rejects an argument.

    Examples
    --------
    Forty draws of the corridor agree across it but not along it.

    >>> import numpy as np
    >>> from solvers.uncertainty import monte_carlo
    >>> from solvers.wall_scenes import corridor
    >>> scenes = [corridor(seed=seed) for seed in range(40)]
    >>> source, target = (np.stack([getattr(s, n) for s in scenes]) for n in ("source", "target"))
    >>> ends = monte_carlo(source, target, "point-to-plane", start=scenes[0].start, gate=0.8)
    >>> ends.poses.batch, bool(ends.whole.deviations[0] > 50.0 * ends.whole.deviations[1])
    ((40,), True)
    """
    rigid_method_of(method)
    p = validate.cloud(source[0] if unequal(source) else cast(ArrayLike, source), "source", 2)
    result = register(source if unequal(source) else p, target, method, start=start, weights=weights, **options)
    if len(result.pose.batch) != 1 or len(result.pose) < 2:
        raise ValueError(
            f"source, target: expected two or more draws of either, in one row, got the shape {result.pose.batch}"
        )
    middle, radius = _middle(result)
    return spread_of(result.pose, centre=middle, radius=radius, apart=apart)


def from_starts(
    source: ArrayLike, target: ArrayLike, method: str | Method[Any] = "icp", *, start: Covariance,
    noise: Covariance | None = None, weights: ArrayLike | None = None, draws: int = 0, seed: int = 0,
    **options: Any,
) -> Covariance:  # fmt: skip
    """The covariance of a run's end pose that the uncertainty of its start causes.

    One pair of scans is registered from several starts. With `draws` = 0 these are the
    six points of the unscented transform, √3 deviations to either side along each
    direction of the start's covariance; otherwise they are drawn from it.

    Parameters
    ----------
    source : array_like of shape (m, 2)
        The cloud to move.
    target : array_like of shape (n, 2)
        The cloud that stays.
    method : str or Method, default "icp"
        As for `solvers.register`.
    start : Covariance
        The starting pose with its uncertainty, without free directions.
    noise : Covariance, optional
        The covariance due to the points' noise, such as a closed form's: the two
        matrices are added. Its free directions stay free.
    weights : array_like, optional
        As for `solvers.register`.
    draws : int, default 0
        How many starts to draw; 0 takes the unscented six.
    seed : int, default 0
        The seed of the draws.
    **options
        The method's own.

    Returns
    -------
    Covariance
        In the frame "target", about the end pose of the run from the mean start. The
        spread is measured from that pose, not from the mean of the ends, so that it
        shows if the run from the mean misses what the others find.

    Raises
    ------
    ValueError
        If `start` or `noise` is not a single Covariance, if a direction of the start is
        free, if the method finds a scale, or if `solvers.register` rejects an argument.

    References
    ----------
    .. [1] M. Brossard, S. Bonnabel, A. Barrau, "A new approach to 3D ICP covariance
       estimation", 2020. arXiv:1909.05722 (left out: the sensor's bias).

    Examples
    --------
    In a corridor the end pose keeps the start's error along it:

    >>> import numpy as np
    >>> from solvers.uncertainty import from_matrix, from_starts
    >>> from solvers.wall_scenes import corridor
    >>> scene = corridor()
    >>> start = from_matrix(np.diag([0.03, 0.3, 0.3]) ** 2, scene.truth)
    >>> ends = from_starts(scene.source, scene.target, "icp", start=start, gate=0.8)
    >>> print(ends.words())
    widest: the slide along (0.94, 0.33), σ = 0.3 u
    """
    rigid_method_of(method)
    p, q = validate.cloud(source, "source", 2), validate.cloud(target, "target", 2)
    if noise is not None and of_kind(noise, Covariance, "noise").mean.batch:
        raise ValueError(f"noise: expected one covariance, got a batch of shape {noise.mean.batch}")
    if p.ndim != 2 or q.ndim != 2 or of_kind(start, Covariance, "start").mean.batch:
        raise ValueError("source, target, start: expected one pair of clouds and one start")
    validate.count(seed, "seed")
    poses = start.sample(draws, seed) if validate.count(draws, "draws") else _unscented(start)
    starts = concatenated([stacked([start.mean]), poses])
    result = register(p, q, method, start=starts, weights=weights, **options)
    middle, radius = _middle(result)
    end = result.pose[0]
    centre = end.apply(middle[None])[0]
    along = _twists(result.pose[1:], end, centre, radius)
    matrix = along.T @ along / len(along)
    free = None
    if noise is not None:
        extra = _about(noise.to("target"), centre, radius)
        half = extra.directions * np.where(extra.free, 0.0, extra.deviations)
        matrix, free = matrix + half @ half.T, np.where(extra.free, extra.directions, 0.0)
        keep = np.eye(3) - free @ free.T
        matrix = keep @ matrix @ keep
    return from_scaled(matrix, end, centre, np.asarray(radius), "target", "starts", free)


def _middle(result: Result) -> tuple[FloatArray, float]:
    """The centre and RMS radius of the first problem's source points with a weight; of pairs, those that are paired."""
    problem = result.states[0].problem
    first = problem.source[0][problem.weights[0] > 0.0]
    if not len(first):
        raise ValueError("weights: no source point has one")
    middle = first.mean(axis=0)
    return middle, float(np.sqrt(np.square(first - middle).sum(axis=1).mean())) or 1.0


def _about(spread: Covariance, centre: FloatArray, radius: float) -> Covariance:
    """The same covariance about another centre and in units of another radius."""
    # From centre to centre directly, not via the origin, which may be far away.
    change = np.array([radius, 1.0, 1.0])[:, None] * se2.shifted(centre - spread.centre)
    change = change / np.array([float(spread.radius), 1.0, 1.0])
    span = change @ spread.directions[:, spread.free]
    free = np.zeros((3, 3))
    free[:, : span.shape[1]] = np.linalg.qr(span)[0]
    keep = np.eye(3) - free @ free.T
    half = keep @ change @ (spread.directions * np.where(spread.free, 0.0, spread.deviations))
    matrix = half @ half.T
    return from_scaled(matrix, spread.mean, centre, np.asarray(radius), "target", spread.made_by, free)


def _unscented(start: Covariance) -> Pose:
    """The 2d sigma points of equal weight, √d deviations along each of d = 3 directions."""
    if start.free.any():
        raise ValueError(f"start: it has no finite spread: {start.words()}")
    return start.poses(np.sqrt(3.0) * np.concatenate([np.diag(start.deviations), -np.diag(start.deviations)]))


def _twists(poses: Pose, mean: Pose, centre: FloatArray, radius: float) -> FloatArray:
    """(radius · angle, x, y) from the mean to each pose, about the centre in target coordinates."""
    shift = Pose.trusted(np.eye(2), centre)
    twist = se2.log(shift.inverse().compose(poses.compose(mean.inverse())).compose(shift))
    scaled: FloatArray = twist * np.array([radius, 1.0, 1.0])
    return scaled


def _gaussian(poses: Pose, middle: FloatArray, radius: float, made_by: str, mean: Pose | None = None) -> Covariance:
    """The mean and covariance of poses (k,)."""
    mean = poses[0] if mean is None else mean
    spread = np.inf
    for _ in range(20):
        centre = mean.apply(middle[None])[0]
        along = _twists(poses, mean, centre, radius)
        squares = float(np.square(along).sum())
        if squares >= spread * (1.0 - 1e-12):
            break
        spread, best = squares, (mean, centre, along)
        step = se2.exp(along.mean(axis=0) / np.array([radius, 1.0, 1.0]))
        shift = Pose.trusted(np.eye(2), centre)
        mean = shift.compose(step).compose(shift.inverse()).compose(mean)
    mean, centre, along = best
    matrix = along.T @ along / max(len(along) - 1, 1)
    return from_scaled(matrix, replace(mean), centre, np.asarray(radius), "target", made_by)


def _modes(poses: Pose, middle: FloatArray, radius: float, apart: float) -> IntArray:
    """The labels of the connected groups, 0 for the largest."""
    at = poses.apply(middle[None])[:, 0]
    angle = np.asarray(poses.angle)
    label = np.full(len(at), -1, dtype=np.int64)
    for first in range(len(at)):
        if label[first] >= 0:
            continue
        label[first] = first
        queue = [first]  # members of this group whose neighbours are not yet searched
        while queue:
            k = queue.pop()
            rest = np.flatnonzero(label < 0)
            gap = np.square(at[rest] - at[k]).sum(axis=-1)
            gap += np.square(2.0 * radius * np.sin(0.5 * (angle[rest] - angle[k])))
            near = rest[gap < apart * apart]
            label[near] = first
            queue += near.tolist()
    _, label, count = np.unique(label, return_inverse=True, return_counts=True)
    rank = np.empty(len(count), dtype=np.int64)
    rank[np.argsort(-count, kind="stable")] = np.arange(len(count))
    labels: IntArray = rank[label]
    return labels
