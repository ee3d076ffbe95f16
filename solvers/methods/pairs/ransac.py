"""RANSAC on proposed pairs.

Fit a few pairs drawn at random, count how many agree, keep the best pose, refit it to
its consensus.

A trial draws d distinct pairs (two in the plane, three in space), fits them in closed
form (by least squares, as their lengths disagree), and is judged by its capped sum of
squares `C(T) = Σ_i min(r_i², ε²)`, r_i the residual distance of pair i. The pairs
within ε are its consensus. When the trials are done, the best pose is refitted to its
consensus until that stays the same. A refit never raises C: it lowers the sum over the
consensus, and capping again lowers it further. It may *lower the count*, which is why
the best pose is chosen by C and not by the count.

The number of trials comes from `solvers.consensus.trials`, with the best consensus so
far as the share of right pairs, so the budget falls as better poses are found; `most`
caps it, and a run that ends at that cap says so. The formula treats the draws of one
trial as independent; d *distinct* pairs are all right with probability
k(k−1)…/(n(n−1)…), a little less than wᵈ.

A draw in which two source points, or two target points, lie closer than `separation` is
discarded and does not count as a trial: a short baseline gives a poor angle.

For comparison, `ghost` is the least-squares fit of all pairs, right and wrong.

Left out: guided sampling and early rejection, which are not needed for forty pairs.

References
----------
.. [1] M. A. Fischler, R. C. Bolles, "Random sample consensus: a paradigm for model
   fitting with applications to image analysis and automated cartography", 1981 (trials,
   consensus). doi:10.1145/358669.358692
.. [2] P. H. S. Torr, A. Zisserman, "MLESAC: a new robust estimator with application to
   estimating image geometry", 2000, sec. 4 (the capped sum). doi:10.1006/cviu.1999.0832
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.partners import own_rows
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed, put
from solvers.geometry.rigid import Fit, fit_planar, fit_rigid
from solvers.methods.pairs.consensus import capped_sum, trials
from solvers.numerics.fits import lengths

INLIER = 0.1
"""The default ε, as a fraction of the target's RMS radius."""


@dataclass(frozen=True)
class RansacOptions:
    """Options of `ransac`.

    Parameters
    ----------
    inlier : float, optional
        ε, the residual up to which a pair agrees with a pose, world units. None is 0.1
        of the target's RMS radius, which wrong pairs far away make too large unless
        they are more than 20 times as far out as the median point.
    confidence : float, default 0.99
        p, the probability, above 0 and below 1, that at least one draw holds only right
        pairs.
    most : int, default 1000
        The cap on trials.
    per_step : int, default 32
        Trials per step.
    separation : float, default 0.0
        The least distance between the points of a draw, world units.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.kabsch_scene("outliers")
    >>> register(scene.source, scene.target, "ransac", options=options.RansacOptions(inlier=0.3)).detail("count")
    np.int64(10)
    """

    inlier: float | None = None
    confidence: float = 0.99
    most: int = 1000
    per_step: int = 32
    separation: float = 0.0

    def __post_init__(self) -> None:
        if self.inlier is not None:
            validate.number(self.inlier, "inlier", 1e-100, 1e100)
        if not 0.0 < validate.number(self.confidence, "confidence") < 1.0:
            raise ValueError(f"confidence: expected a probability above 0 and below 1, got {self.confidence!r}")
        validate.count(self.most, "most", 1)
        validate.count(self.per_step, "per_step", 1)
        validate.number(self.separation, "separation", 0.0)


@dataclass(frozen=True, eq=False)
class RansacState:
    """The best pose so far, the residuals of the pairs there, and the trials.

    Attributes
    ----------
    problem : Problem
        The problems.
    options : RansacOptions
        The options.
    inlier : ndarray of shape (b,)
        ε, world units.
    draws : ndarray of int, shape (b, most, d)
        The rows of the pairs drawn for each trial.
    drawn : ndarray of int, shape (b,)
        How many draws there are.
    ghost : Pose
        The least-squares pose of all pairs.
    ghost_rms : ndarray of shape (b,)
        Its RMS residual, world units.
    pose : Pose
        The best so far; the start before a best trial.
    objective : ndarray of shape (b,)
        The capped sum there.
    status : ndarray of int8, shape (b,)
        The status of each problem.
    reason : ndarray of object, shape (b,)
        Why it stopped, in words; empty while running.
    trials : ndarray of int, shape (b,)
        Trials made so far.
    budget : ndarray of shape (b,)
        Trials needed by the formula, uncapped; infinite before a consensus.
    sample : ndarray of int, shape (b, d)
        Rows of the best trial, −1 before there is one.
    found : ndarray of bool, shape (b,)
        Whether there is a best trial.
    residuals : ndarray of shape (b, n)
        At `pose`, world units.
    inliers : ndarray of bool, shape (b, n)
        Which of them are at most ε.
    count : ndarray of int, shape (b,)
        Their number.
    refits : ndarray of int, shape (b,)
        Refits made so far.
    last_sample : ndarray of int, shape (b, d)
        The last trial of the last step, good or not, for display.
    last_pose : Pose
        Its pose.
    last_count : ndarray of int, shape (b,)
        Its consensus.

    Examples
    --------
    >>> from solvers import register, scenes
    >>> scene = scenes.kabsch_scene("outliers")
    >>> (state,) = register(scene.source, scene.target, "ransac", inlier=0.3).states
    >>> state.count, state.inliers.shape
    (array([10]), (1, 13))
    """

    problem: Problem = field(metadata=CONSTANT)
    options: RansacOptions = field(metadata=SHARED)
    inlier: FloatArray = field(metadata=CONSTANT)
    draws: IntArray = field(metadata=CONSTANT)
    drawn: IntArray = field(metadata=CONSTANT)
    ghost: Pose = field(metadata=CONSTANT)
    ghost_rms: FloatArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    trials: IntArray
    budget: FloatArray
    sample: IntArray
    found: BoolArray
    residuals: FloatArray
    inliers: BoolArray
    count: IntArray
    refits: IntArray
    last_sample: IntArray
    last_pose: Pose
    last_count: IntArray

    __repr__ = brief


def _squares(pose: Pose, source: FloatArray, target: FloatArray) -> FloatArray:
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        left = pose.apply(source) - target
        squares = np.einsum("...nd,...nd->...n", left, left)
    return np.where(np.isfinite(squares), squares, np.inf)


def _draw(rng: np.random.Generator, source: FloatArray, target: FloatArray, options: RansacOptions) -> IntArray:
    """Up to `most` draws of d distinct rows whose points lie apart in both clouds, (k, d)."""
    n, d = source.shape
    samples, tries = np.empty((0, d), dtype=np.int64), 0
    while len(samples) < options.most and tries < 8:
        tries += 1
        rows = np.empty((2 * options.most, d), dtype=np.int64)
        for k in range(d):
            # Uniform over the n − k rows not yet drawn: step over the drawn ones in
            # ascending order.
            new = rng.integers(0, n - k, len(rows))
            for earlier in np.sort(rows[:, :k], axis=1).T:
                new += new >= earlier
            rows[:, k] = new
        apart = np.ones(len(rows), dtype=np.bool_)
        for i in range(d):
            for j in range(i):
                for cloud in (source, target):
                    gap = np.linalg.norm(cloud[rows[:, i]] - cloud[rows[:, j]], axis=1)
                    apart &= (gap >= options.separation) & (gap > 0.0)
        samples = np.concatenate([samples, rows[apart]])
    return samples[: options.most]


def _start(problem: Problem, options: RansacOptions) -> RansacState:
    b, n, d = problem.source.shape
    draws, drawn = np.zeros((b, options.most, d), dtype=np.int64), np.zeros(b, dtype=np.int64)
    if n >= d:
        for i in range(b):
            own = _draw(np.random.default_rng(problem.seed[i]), problem.source[i], problem.target[i], options)
            draws[i, : len(own)], drawn[i] = own, len(own)
    ghost = _fit(problem.source, problem.target).pose
    squares = _squares(problem.start, problem.source, problem.target)
    inlier = lengths(options.inlier, INLIER, problem.target)
    inliers = squares <= np.square(inlier)[:, None]
    few = f"a trial needs {d} pairs, got {n}"
    near = f"no {d} pairs are {options.separation:g} u apart" if options.separation else "no pairs are apart"
    status, reason = mark(statuses((b,)), reasons((b,)), drawn == 0, Status.DEGENERATE, few if n < d else near)
    none = np.full((b, d), -1, dtype=np.int64)
    zero = np.zeros(b, dtype=np.int64)
    with np.errstate(over="ignore", under="ignore"):
        ghost_rms = np.sqrt(_squares(ghost, problem.source, problem.target).mean(axis=1))
    return RansacState(
        problem=problem, options=options, inlier=inlier, draws=draws, drawn=drawn, ghost=ghost, ghost_rms=ghost_rms,
        pose=problem.start, objective=capped_sum(squares, inlier[:, None]), status=status, reason=reason, trials=zero,
        budget=np.full(b, np.inf), sample=none, found=np.zeros(b, dtype=np.bool_), residuals=np.sqrt(squares),
        inliers=inliers, count=inliers.sum(axis=1), refits=zero, last_sample=none, last_pose=problem.start,
        last_count=zero,
    )  # fmt: skip


def _fit(source: FloatArray, target: FloatArray, weights: FloatArray | None = None) -> Fit:
    return (fit_planar if source.shape[-1] == 2 else fit_rigid)(source, target, weights)


def _step(state: RansacState) -> RansacState:
    """Run a block of trials for the problems that need more and a refit for those that have had all theirs."""
    limit = np.minimum(np.minimum(state.budget, state.drawn), state.options.most)
    searching = state.trials < limit
    after = state
    if searching.any():
        after = _search(state, searching, limit)
    if not searching.all():
        after = _refit(after, ~searching)
    return after


def _search(state: RansacState, where: BoolArray, limit: FloatArray) -> RansacState:
    problem, options = state.problem, state.options
    b, n, d = problem.source.shape
    size = min(options.per_step, options.most)
    turn = state.trials[:, None] + np.arange(size)
    valid = where[:, None] & (turn < limit[:, None])
    rows = np.take_along_axis(state.draws, np.minimum(turn, options.most - 1)[..., None], axis=1)
    at = np.arange(b)[:, None, None]
    fit = _fit(problem.source[at, rows], problem.target[at, rows])
    sound = valid & (fit.status != Status.DEGENERATE)
    squares = _squares(fit.pose, problem.source[:, None], problem.target[:, None])
    inlier = state.inlier[:, None, None]
    count = (squares <= np.square(inlier)).sum(axis=2)
    cost = np.where(sound & (count >= d), capped_sum(squares, inlier), np.inf)

    # The budget is updated after every single trial and the block cut where it is met, so the block size changes
    # nothing.
    incumbent = np.where(state.found, state.objective, np.inf)[:, None]
    before = np.minimum.accumulate(np.concatenate([incumbent, cost[:, :-1]], axis=1), axis=1)
    leader = np.maximum.accumulate(np.where(cost < before, np.arange(size), -1), axis=1)
    consensus = np.where(state.found, state.count, 0)[:, None]
    consensus = np.where(leader >= 0, np.take_along_axis(count, np.maximum(leader, 0), axis=1), consensus)
    budget = trials(consensus / n, options.confidence, d)
    met = turn + 1 >= np.minimum(budget, limit[:, None])
    end = np.arange(b), np.where(met.any(axis=1), met.argmax(axis=1), size - 1)

    best = np.arange(b), np.maximum(leader[end], 0)
    better = where & (leader[end] >= 0)
    state = _better(state, better, fit.pose[best], squares[best])
    return changed(
        state,
        trials=np.where(where, turn[end] + 1, state.trials),
        budget=np.where(where, np.asarray(budget)[end], state.budget),
        sample=np.where(better[:, None], rows[best], state.sample),
        found=state.found | better,
        last_sample=np.where(where[:, None], rows[end], state.last_sample),
        last_pose=put(state.last_pose, where, fit.pose[end][where]),
        last_count=np.where(where, count[end], state.last_count),
    )


def _better(state: RansacState, better: BoolArray, pose: Pose, squares: FloatArray) -> RansacState:
    """The state with the new pose, and all that depends on it, where `better`."""
    inlier = state.inlier[:, None]
    inliers = np.where(better[:, None], squares <= np.square(inlier), state.inliers)
    return changed(
        state,
        pose=put(state.pose, better, pose[better]),
        objective=np.where(better, capped_sum(squares, inlier), state.objective),
        residuals=np.where(better[:, None], np.sqrt(squares), state.residuals),
        inliers=inliers,
        count=inliers.sum(axis=1),
    )


def _refit(state: RansacState, where: BoolArray) -> RansacState:
    problem, options = state.problem, state.options
    fit = _fit(problem.source, problem.target, state.inliers.astype(np.float64))
    squares = _squares(fit.pose, problem.source, problem.target)
    lower = where & state.found & (fit.status != Status.DEGENERATE)
    lower &= capped_sum(squares, state.inlier[:, None]) < state.objective
    old, state = state.inliers, _better(state, lower, fit.pose, squares)
    stable = where & (state.inliers == old).all(axis=1)
    near = f"{INLIER:g} of the target's RMS radius" if options.inlier is None else f"{options.inlier:g} u"
    status, reason = mark(
        state.status, state.reason, where & ~state.found, Status.DEGENERATE,
        f"no trial found {problem.dim} pairs within {near} that determine a pose",
    )  # fmt: skip
    short = state.budget > state.trials
    status, reason = mark(
        status, reason, stable & short, Status.CAPPED,
        f"the consensus is stable, but the trials ended before {100.0 * options.confidence:g} % confidence",
    )  # fmt: skip
    status, reason = mark(status, reason, stable, Status.CONVERGED, "the consensus is stable")
    return changed(state, status=status, reason=reason, refits=state.refits + (where & state.found))


RANSAC = Method(
    name="ransac",
    summary="the pose that most of the proposed pairs agree on, found by random trials and refitted",
    source="Fischler & Bolles 1981",
    start=_start,
    step=_step,
    options=RansacOptions,
    partners=lambda state: own_rows(state.inliers),
    paired=True,
    dims=None,
)
