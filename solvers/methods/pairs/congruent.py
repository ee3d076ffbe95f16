"""RANSAC without pairs: two source points are laid on two target points equally far apart.

A draw takes two source points at least `separation` apart, a target point, and a second
target point at the same distance from it up to `tolerance`. It lays one segment on the
other, midpoint on midpoint, in both directions, which gives two hypotheses. A pose is
judged by the capped sum `C(T) = Σ_i min(r_i², ε²)` over the source points, r_i the
distance of moved point i to its nearest target point. The starting pose plays no part.

Hypotheses are screened before they are scored. A grid over the target holds in each
cell the least r² of any point in it, which bounds C from below. All hypotheses of a
step are bounded with `screen` of the source points and the lowest few with all of them;
the lowest of these is scored exactly if its bound lies below the best score so far. A
hypothesis that becomes the best is refitted to the pairs within ε, at most twice, while
that lowers C. After `patience` steps without a better one, the best pose is refitted,
twice a step, until C stops falling: the run is at rest, which proves nothing.

Left out: the search structures of [3]_.

References
----------
.. [1] M. A. Fischler, R. C. Bolles, "Random sample consensus: a paradigm for model
   fitting with applications to image analysis and automated cartography", 1981.
   doi:10.1145/358669.358692
.. [2] O. Chum, J. Matas, J. Kittler, "Locally optimized RANSAC", 2003 (the refits).
.. [3] D. Aiger, N. J. Mitra, D. Cohen-Or, "4-points congruent sets …", 2008.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.extent import EQUAL, at_one_place
from solvers.core.method import Method, Problem
from solvers.core.partners import chosen
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed, put, take
from solvers.geometry import nearest
from solvers.geometry.nearest import Index
from solvers.methods.pairs.capped_grid import CappedGrid
from solvers.methods.pairs.consensus import capped_sum
from solvers.numerics.fits import fit_pairs, lengths

SEPARATION, TOLERANCE, INLIER = 0.6, 0.1, 0.1
"""The defaults, as fractions of an RMS radius: the source's for the first, the target's for the other two."""
_SHORTLIST, _REFITS = 4, 2  # more refits at once would make steps uneven in cost, and the final refits make up for it


@dataclass(frozen=True)
class CongruentOptions:
    """Options of `ransac-congruent`.

    Parameters
    ----------
    separation : float, optional
        The least distance between two drawn source points, u; by default 0.6 of the
        source's RMS radius.
    tolerance : float, optional
        How much the distance of the two target points may differ from theirs, u; by
        default 0.1 of the target's RMS radius.
    inlier : float, optional
        ε, the distance at which a point's share of the objective is capped, u; by
        default 0.1 of the target's RMS radius, which is too large if a point lies far
        away, but not more than 20 times as far out as the median point.
    per_step : int, default 32
        Hypotheses per step, an even number.
    most : int, default 70
        The number of steps for which draws are made; then they are reused.
    screen : int, default 32
        The number of source points with which all hypotheses of a step are first
        bounded.
    patience : int, default 20
        Steps without a better pose after which the best one is refitted for the last
        time.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> hasty = options.CongruentOptions(patience=5)
    >>> register(scene.source, scene.target, "ransac-congruent", options=hasty).steps
    10
    """

    separation: float | None = None
    tolerance: float | None = None
    inlier: float | None = None
    per_step: int = 32
    most: int = 70
    screen: int = 32
    patience: int = 20

    def __post_init__(self) -> None:
        for name, least in (("separation", 1e-100), ("tolerance", 0.0), ("inlier", 1e-100)):
            value = getattr(self, name)
            if value is not None:
                validate.number(value, name, least, 1e100)
        if validate.count(self.per_step, "per_step", 2) % 2:
            raise ValueError(f"per_step: two hypotheses come of each draw, so it is even, not {self.per_step}")
        validate.count(self.most, "most", 1)
        validate.count(self.screen, "screen", 1)
        validate.count(self.patience, "patience", 1)


@dataclass(frozen=True, eq=False)
class CongruentState:
    """The best pose so far; objective, rows, distances, used and count are at `pose`.

    separation, tolerance, inlier: (b,) world units. draws: (b, most · per_step/2, 2) source rows and first: (b, …)
    target row of each draw, choice: (b, …) in [0, 1) which of the congruent target points is taken. screen: (b,
    screen) source rows. drawn: (b,) steps so far. best: (b,) the best C of a hypothesis before refitting, infinite
    before there is one. idle: (b,) steps without a better pose. rows: (b, m) nearest target rows, distances: (b, m),
    used: (b, m) those within ε, count: (b,). source_pair, target_pair: (b, 2) rows of the best hypothesis, −1 before
    there is one. scored: (b,) hypotheses that passed the screening, tried: (b,) all of them.
    """

    problem: Problem = field(metadata=CONSTANT)
    index: Index = field(metadata=CONSTANT)
    map: CappedGrid = field(metadata=CONSTANT)
    options: CongruentOptions = field(metadata=SHARED)
    separation: FloatArray = field(metadata=CONSTANT)
    tolerance: FloatArray = field(metadata=CONSTANT)
    inlier: FloatArray = field(metadata=CONSTANT)
    draws: IntArray = field(metadata=CONSTANT)
    first: IntArray = field(metadata=CONSTANT)
    choice: FloatArray = field(metadata=CONSTANT)
    screen: IntArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    drawn: IntArray
    best: FloatArray
    idle: IntArray
    rows: IntArray
    distances: FloatArray
    used: BoolArray
    count: IntArray
    source_pair: IntArray
    target_pair: IntArray
    scored: IntArray
    tried: IntArray

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class _Score:
    """Nearest neighbours at a pose, rows and squares (b, m); their capped sum, cost (b,)."""

    pose: Pose
    rows: IntArray
    squares: FloatArray
    cost: FloatArray


def _score(source: FloatArray, index: Index, pose: Pose, inlier: FloatArray) -> _Score:
    with np.errstate(over="ignore", under="ignore"):
        rows, squares = index.nearest(pose.apply(source))
        return _Score(pose, rows, squares, capped_sum(squares, inlier[:, None]))


def _start(problem: Problem, options: CongruentOptions) -> CongruentState:
    b, m, _ = problem.source.shape
    n = problem.target.shape[1]
    total = options.most * (options.per_step // 2)
    draws, first = np.zeros((b, total, 2), dtype=np.int64), np.zeros((b, total), dtype=np.int64)
    choice, enough = np.zeros((b, total)), np.ones(b, dtype=np.bool_)
    screen = np.zeros((b, min(options.screen, m)), dtype=np.int64)
    separation = lengths(options.separation, SEPARATION, problem.source)
    tolerance = lengths(options.tolerance, TOLERANCE, problem.target)
    inlier = lengths(options.inlier, INLIER, problem.target)
    for i in range(b):
        rng = np.random.default_rng(problem.seed[i])
        screen[i] = rng.permutation(m)[: screen.shape[1]]
        first[i], choice[i] = rng.integers(0, n, total), rng.random(total)
        # Rejection sampling; too few accepted pairs are repeated.
        pairs = rng.integers(0, m, (4 * total, 2))
        apart = np.linalg.norm(problem.source[i, pairs[:, 0]] - problem.source[i, pairs[:, 1]], axis=1)
        candidates = pairs[apart >= separation[i]]
        enough[i] = len(candidates) > 0
        if enough[i]:
            draws[i] = np.resize(candidates[:total], (total, 2))
    index = nearest.build(problem.target)
    at = _score(problem.source, index, problem.start, inlier)
    used = at.squares <= np.square(inlier)[:, None]
    status, reason = statuses((b,)), reasons((b,))
    status, reason = mark(status, reason, at_one_place(problem.source), Status.DEGENERATE, EQUAL.format("source"))
    words = f"no two source points were found {_length_text(options.separation, SEPARATION, 'their RMS radius')} apart"
    status, reason = mark(status, reason, ~enough, Status.DEGENERATE, words)
    none, zero = np.full((b, 2), -1, dtype=np.int64), np.zeros(b, dtype=np.int64)
    return CongruentState(
        problem=problem, index=index, map=CappedGrid.of(problem.target, inlier), options=options, separation=separation,
        tolerance=tolerance, inlier=inlier, draws=draws, first=first, choice=choice, screen=screen, pose=problem.start,
        objective=at.cost, status=status, reason=reason, drawn=zero, best=np.full(b, np.inf), idle=zero, rows=at.rows,
        distances=np.sqrt(at.squares), used=used, count=used.sum(axis=1), source_pair=none, target_pair=none,
        scored=zero, tried=zero,
    )  # fmt: skip


def _length_text(length: float | None, share: float, of: str) -> str:
    """The length in words: in u if given, else as a share of `of`."""
    return f"{share:g} of {of}" if length is None else f"{length:g} u"


def _hypotheses(state: CongruentState) -> tuple[FloatArray, FloatArray, BoolArray, IntArray, IntArray]:
    """This step's poses R (b, k, 2, 2) and t (b, k, 2), which of them exist (b, k), and their source and target rows
    (b, k, 2). The second half repeats the first half's draws in the other direction.
    """
    problem, options = state.problem, state.options
    h = options.per_step // 2
    turn = (state.drawn[:, None] % options.most) * h + np.arange(h)
    b = np.arange(problem.size)[:, None]
    pair, first, choice = state.draws[b, turn], state.first[b, turn], state.choice[b, turn]
    p, q = problem.source[b[..., None], pair], problem.target[b, first]
    dp = p[:, :, 1] - p[:, :, 0]
    length = np.hypot(dp[..., 0], dp[..., 1])[..., None]
    across = [problem.target[:, None, :, k] - q[:, :, None, k] for k in (0, 1)]
    squares = across[0] * across[0]
    squares += across[1] * across[1]
    tolerance = state.tolerance[:, None, None]
    ring = squares >= np.square(np.maximum(length - tolerance, 0.0))
    ring &= squares <= np.square(length + tolerance)
    order = ring.cumsum(axis=2, dtype=np.int32)
    count = order[:, :, -1]
    second = (order > (choice * count).astype(np.int32)[..., None]).argmax(axis=2)
    dq = np.stack([np.take_along_axis(a, second[..., None], axis=2)[..., 0] for a in across], axis=-1)
    cosine = (dp * dq).sum(axis=-1)
    sine = dp[..., 0] * dq[..., 1] - dp[..., 1] * dq[..., 0]
    norm = np.hypot(cosine, sine)
    exist = (count > 0) & (norm > 1e-290)  # below this a product has lost digits
    norm = np.where(exist, norm, 1.0)
    c, s = np.where(exist, cosine / norm, 1.0), sine / norm
    R = np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)
    R = np.concatenate([R, -R], axis=1)
    middle = np.tile(p.mean(axis=2), (1, 2, 1))
    t = np.tile(q + 0.5 * dq, (1, 2, 1)) - (R @ middle[..., None])[..., 0]
    ends = np.stack([first, second], axis=-1)
    return R, t, np.tile(exist, (1, 2)), np.tile(pair, (1, 2, 1)), np.concatenate([ends, ends[..., ::-1]], axis=1)


def _step(state: CongruentState) -> CongruentState:
    problem, options = state.problem, state.options
    b = problem.size
    at = np.arange(b)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        R, t, exist, pairs, ends = _hypotheses(state)
        rough = state.map.total(R, t, np.take_along_axis(problem.source, state.screen[..., None], axis=1))
        rough = np.where(exist, rough, np.inf)
        short = np.argsort(rough, axis=1, kind="stable")[:, :_SHORTLIST]
        bound = state.map.total(R[at[:, None], short], t[at[:, None], short], problem.source)
        bound = np.where(exist[at[:, None], short], bound * np.square(state.inlier)[:, None], np.inf)
    lowest = bound.argmin(axis=1)
    leader = short[at, lowest]
    promising = bound[at, lowest] * (1.0 - 1e-9) < state.best
    new = changed(
        state, drawn=state.drawn + 1, idle=state.idle + 1, tried=state.tried + exist.sum(axis=1),
        scored=state.scored + promising,
    )  # fmt: skip
    if promising.any():
        problems = np.flatnonzero(promising)
        leaders = problems, leader[problems]
        new = _try(new, problems, Pose.trusted(R[leaders], t[leaders]), pairs[leaders], ends[leaders])
    has_pose = np.isfinite(new.best)
    resting = new.idle >= options.patience
    words = "no two target points were found as far apart as two source points, up to "
    words += _length_text(options.tolerance, TOLERANCE, "the target's RMS radius")
    status, reason = mark(new.status, new.reason, resting & ~has_pose, Status.DEGENERATE, words)
    new, lower = _polished(new, resting & has_pose)
    words = f"no better pose in {options.patience} steps"
    status, reason = mark(status, reason, resting & has_pose & ~lower, Status.CONVERGED, words)
    return changed(new, status=status, reason=reason)


def _try(state: CongruentState, problems: IntArray, pose: Pose, pairs: IntArray, ends: IntArray) -> CongruentState:
    """Score one hypothesis for each of these problems; refit it if it is the best so far, and keep the result if
    it is the best pose so far. pairs, ends: its source and target rows.
    """
    source, index, inlier = state.problem.source[problems], take(state.index, problems), state.inlier[problems]
    score = _score(source, index, pose, inlier)
    better = np.flatnonzero(score.cost < state.best[problems])
    if not better.size:
        return state
    problems = problems[better]
    first = ~np.isfinite(state.best[problems])
    state = changed(
        state,
        best=_with(state.best, problems, score.cost[better]),
        source_pair=_with(state.source_pair, problems, pairs[better]),
        target_pair=_with(state.target_pair, problems, ends[better]),
    )
    score = _refitted(source[better], take(index, better), take(score, better), inlier[better])
    winners = np.flatnonzero(first | (score.cost < state.objective[problems]))
    return changed(_at(state, problems[winners], take(score, winners)), idle=_with(state.idle, problems[winners], 0))


def _polished(state: CongruentState, mask: BoolArray) -> tuple[CongruentState, BoolArray]:
    """The state after further refits of the best pose in the problems of `mask`, and where these lowered the cost."""
    lower = np.zeros(mask.shape, dtype=np.bool_)
    if not mask.any():
        return state, lower
    problems = np.flatnonzero(mask)
    squares = np.square(state.distances[problems])
    own = _Score(state.pose[problems], state.rows[problems], squares, state.objective[problems])
    score = _refitted(state.problem.source[problems], take(state.index, problems), own, state.inlier[problems])
    lower[problems] = score.cost < own.cost
    improved = lower[problems]
    return _at(state, problems[improved], take(score, improved)), lower


def _at(state: CongruentState, problems: IntArray, score: _Score) -> CongruentState:
    """The state with the pose of a score, and all that depends on it, in these problems."""
    used = score.squares <= np.square(state.inlier[problems])[:, None]
    return changed(
        state,
        pose=put(state.pose, problems, score.pose),
        objective=_with(state.objective, problems, score.cost),
        rows=_with(state.rows, problems, score.rows),
        distances=_with(state.distances, problems, np.sqrt(score.squares)),
        used=_with(state.used, problems, used),
        count=_with(state.count, problems, used.sum(axis=1)),
    )


def _with(whole: AnyArray, rows: IntArray, part: AnyArray | int) -> AnyArray:
    """A copy of `whole` with `part` in the given rows."""
    out = whole.copy()
    out[rows] = part
    return out


def _refitted(source: FloatArray, index: Index, score: _Score, inlier: FloatArray) -> _Score:
    """The scores after fits to the pairs within reach, at most `_REFITS`, for as long as they lower the cost."""
    active, own = np.arange(len(source)), score
    for _ in range(_REFITS):
        partners = nearest.picked(index.points, own.rows)
        weights = (own.squares <= np.square(inlier)[:, None]).astype(np.float64)
        pose, _, _ = fit_pairs(own.pose, source, partners, weights)
        own, cost = _score(source, index, pose, inlier), own.cost
        better = np.flatnonzero(own.cost < cost)
        if not better.size:
            break
        if better.size < active.size:
            active, own = active[better], take(own, better)
            source, index, inlier = source[better], take(index, better), inlier[better]
        score = put(score, active, own)
    return score


CONGRUENT = Method(
    name="ransac-congruent",
    summary="two source points laid on two target points equally far apart, at random, the best such pose refitted",
    source="Fischler & Bolles 1981; Aiger, Mitra & Cohen-Or 2008",
    start=_start,
    step=_step,
    options=CongruentOptions,
    partners=lambda state: chosen(state.rows, state.used),
    dims=(2,),
)
