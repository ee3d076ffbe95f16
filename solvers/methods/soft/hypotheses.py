"""An average over a mixture of association hypotheses.

The hypotheses are complete one-to-one assignments, one greedy and the others drawn at
random.

At a pose and a width σ, each hypothesis assigns every source point to one target point
or to none, and uses no target point twice. The greedy one takes the pair with the best
score `ψ_ij = exp(−‖T p_i − q_j‖² / 2σ²)`, then the best of the remaining ones, as long
as the score exceeds the miss score ψ₀. In a drawn one, every source point draws a
target point with probability `ψ_ij / (ψ₀ + Σ_k ψ_ik)`, or none with the remaining
probability. A point that draws a taken partner draws again, which amounts to a draw
among the free ones; if several draw the same partner at once, the first in a random
order gets it. After `draws` unsuccessful rounds a point is missed. A source point's
soft target is the mean over the hypotheses that assign it, and its support is their
share. A weighted rigid fit follows, then σ shrinks. At the last σ a step is a function
of the pose alone, so a run comes to rest or cycles through the same few poses.

It is not PMBM: it has no Poisson part for undetected objects, no Bernoulli existence
and no posterior passed from step to step, and all hypotheses have equal weight. The
random numbers of a run are drawn once and reused at every step, so that a run can come
to rest.

References
----------
.. [1] Á. F. García-Fernández, J. L. Williams, K. Granström, L. Svensson, "Poisson
   multi-Bernoulli mixture filter: direct derivation and implementation", 2018 (the idea
   of a mixture over associations; nothing else of it). doi:10.1109/TAES.2018.2805153
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.methods.soft import radius_pairs, schedule
from solvers.methods.soft.radius_pairs import Candidates
from solvers.numerics import recurrence
from solvers.numerics.fits import rms_motion

_UNIT = 2.0**32  # scores are rounded to multiples of 2⁻³², so that sums are exact whatever else is in the batch


@dataclass(frozen=True)
class HypothesisOptions:
    """Options of `hypothesis-mixture`.

    Parameters
    ----------
    first : float, optional
        The first σ, world units. None is 0.3 of the target's RMS radius.
    last : float, optional
        The last σ, world units. None is 0.03 of that radius.
    shrink : float, default 0.9
        The factor by which σ shrinks at every step until it reaches `last`, above 0, at
        most 1.
    reach : float, default 4.0
        Pairs farther apart than this many σ score nothing.
    miss : float, default 0.12
        ψ₀, the score of having no partner; pairs score at most 1.
    count : int, default 12
        The number of hypotheses, the first of which is greedy.
    draws : int, default 4
        The number of rounds of drawing before a point is missed.
    least_support : float, default 0.15
        Source points assigned by a smaller share of the hypotheses are left out of the
        fit.
    tolerance : float, default 1e-4
        The run stops when σ has reached `last` and a step's RMS motion of the source
        points is at most this fraction of their RMS radius. A run that cycles through
        the same few poses, to `tolerance`, has stalled.

    Raises
    ------
    ValueError
        If an option is out of its range. A run raises it, too, for clouds of more than
        14 million pairs of points (`solvers.methods.soft.radius_pairs`).

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> result = register(scene.source, scene.target, "hypothesis-mixture", options=options.HypothesisOptions(count=4))
    >>> result.detail("assignments").shape == (4, len(scene.source))
    True
    """

    first: float | None = None
    last: float | None = None
    shrink: float = 0.9
    reach: float = 4.0
    miss: float = 0.12
    count: int = 12
    draws: int = 4
    least_support: float = 0.15
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        schedule.check(self)
        validate.count(self.count, "count", 1)
        validate.count(self.draws, "draws", 1)


@dataclass(frozen=True, eq=False)
class HypothesisState:
    """The fields of `schedule.Scheduled`, and assignments: (b, count, m) the target row that each hypothesis
    assigns to each source point, −1 where missed; the first is the greedy one.

    uniform: for each round, numbers in [0, 1), (b, m, count − 1). order: (b, m, count − 1) each source point's rank in
    the random order of a hypothesis. taken: (b,) steps at the last σ. anchor: (b, m, d) the moved points at one of them
    (`numerics.recurrence`).
    """

    problem: Problem = field(metadata=CONSTANT)
    options: HypothesisOptions = field(metadata=SHARED)
    radius: FloatArray = field(metadata=CONSTANT)
    last: FloatArray = field(metadata=CONSTANT)
    uniform: tuple[FloatArray, ...] = field(metadata=CONSTANT)
    order: IntArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    sigma: FloatArray
    soft: FloatArray
    support: FloatArray
    used: BoolArray
    assignments: IntArray
    change: FloatArray
    condition: FloatArray
    taken: IntArray
    anchor: FloatArray

    __repr__ = brief


def greedy(pairs: Candidates, psi: FloatArray, miss: float) -> AnyArray:
    """The greedy one-to-one assignment of all listed pairs: the column of each row,
    (rows,), −1 where missed.

    Works in rounds: a pair that is the best of its row and of its column would also be picked when picking one by one.
    Ties are broken in an order that does not depend on the batch.
    """
    out = np.full(pairs.rows, -1, dtype=np.int64)
    likely = psi > miss
    row, column, psi = pairs.row[likely], pairs.column[likely], psi[likely]
    best_of_row, best_of_column = np.empty(pairs.rows), np.empty(pairs.columns)
    first_of_row, first_of_column = np.empty(pairs.rows, dtype=np.intp), np.empty(pairs.columns, dtype=np.intp)
    occupied = np.zeros(pairs.columns, dtype=np.bool_)
    while row.size:
        best_of_row[row], best_of_column[column] = 0.0, 0.0
        np.maximum.at(best_of_row, row, psi)
        np.maximum.at(best_of_column, column, psi)
        mutual = np.flatnonzero((psi == best_of_row.take(row)) & (psi == best_of_column.take(column)))
        # Of equal scores the first listed wins: written in reverse order, it is written last.
        i, j, number = row.take(mutual), column.take(mutual), np.arange(len(mutual))
        first_of_row[i[::-1]], first_of_column[j[::-1]] = number[::-1], number[::-1]
        winners = (first_of_row[i] == number) & (first_of_column[j] == number)
        out[i[winners]] = j[winners]
        occupied[j[winners]] = True
        left = (out.take(row) < 0) & ~occupied.take(column)
        row, column, psi = row[left], column[left], psi[left]
    return out


def drawn(
    pairs: Candidates, psi: FloatArray, miss: float, uniform: Sequence[FloatArray], order: IntArray
) -> AnyArray:
    """Random one-to-one assignments: the column of each row in each hypothesis, (rows, H), −1 where missed.

    uniform: for each round, numbers in [0, 1), (rows, H). order: (rows, H) ranks, distinct within a problem and
    hypothesis; of several rows that draw one column, the lowest rank gets it.
    """
    rows, H = order.shape
    scale = _UNIT / max(1.0, miss)
    units = np.rint(psi * scale).astype(np.int64)
    ends = np.concatenate([[0], np.cumsum(units)])
    base, mass = ends[pairs.starts[:-1]], np.diff(ends[pairs.starts])
    total = (mass + np.int64(np.rint(miss * scale))).astype(np.float64)
    out = np.full(rows * H, -1, dtype=np.int64)
    owner = np.full(pairs.columns * H, np.iinfo(np.int64).max, dtype=np.int64)
    rank = order.ravel()
    pending: AnyArray = np.arange(rows * H)
    row = np.repeat(np.arange(rows), H)
    for u in uniform:
        t = (u.reshape(-1).take(pending) * total.take(row)).astype(np.int64)
        hit = np.flatnonzero(t < mass.take(row))
        pending, row = pending.take(hit), row.take(hit)
        pair = np.searchsorted(ends, base.take(row) + t.take(hit), side="right") - 1
        column = pairs.column.take(pair)
        slot = column * H + (pending - H * row)
        free = np.flatnonzero(owner.take(slot) >= 0)
        ranks, slots = rank.take(pending.take(free)), slot.take(free)
        np.minimum.at(owner, slots, ranks)
        winners = free.take(np.flatnonzero(owner.take(slots) == ranks))
        out[pending.take(winners)] = column.take(winners)
        owner[slot.take(winners)] = -1  # taken for good
        left = np.flatnonzero(out.take(pending) < 0)
        pending, row = pending.take(left), row.take(left)
    return out.reshape(rows, H)


def _associate(state: HypothesisState) -> HypothesisState:
    problem, options = state.problem, state.options
    b, m, d = problem.source.shape
    n = problem.target.shape[1]
    pairs = radius_pairs.within_reach(state.pose.apply(problem.source), problem.target, options.reach * state.sigma)
    psi = radius_pairs.scores(pairs, m, state.sigma)
    columns = np.empty((b * m, options.count), dtype=np.int64)
    columns[:, 0] = greedy(pairs, psi, options.miss)
    if options.count > 1:
        columns[:, 1:] = drawn(pairs, psi, options.miss, state.uniform, state.order.reshape(b * m, -1))
    assigned = columns >= 0
    mass = assigned.sum(axis=1).reshape(b, m) / options.count
    with np.errstate(over="ignore", under="ignore"):
        # A missed point's column, −1, indexes the zero appended at the end.
        shares = np.vstack([problem.target.reshape(-1, d) / options.count, np.zeros((1, d))])
        moment = np.stack([x.take(columns).sum(axis=1) for x in np.ascontiguousarray(shares.T)], axis=-1)
    inside = columns.reshape(b, m, -1) - n * np.arange(b)[:, None, None]
    assignments = np.where(assigned.reshape(b, m, -1), inside, -1).swapaxes(1, 2)
    return schedule.associated(changed(state, assignments=assignments), mass, moment.reshape(b, m, d))


def _start(problem: Problem, options: HypothesisOptions) -> HypothesisState:
    radius_pairs.few_enough(problem, "hypothesis-mixture")
    b, m, _ = problem.source.shape
    H = options.count - 1
    uniform, order = np.empty((options.draws, b, m, H)), np.empty((b, m, H), dtype=np.int64)
    for i in range(b):
        rng = np.random.default_rng(problem.seed[i])
        uniform[:, i] = rng.random((options.draws, m, H))
        order[i] = rng.permuted(np.tile(np.arange(m)[:, None], (1, H)), axis=0)
    none = np.full((b, options.count, m), -1, dtype=np.int64)
    return _associate(
        HypothesisState(
            **schedule.initial(problem, options), uniform=tuple(uniform), order=order, assignments=none,
            taken=np.zeros(b, dtype=np.int64), anchor=problem.source,
        )
    )  # fmt: skip


def _step(state: HypothesisState) -> HypothesisState:
    after = schedule.step(state, _associate)
    taken = np.where(state.sigma <= state.last, state.taken + 1, 0)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        moved = after.pose.apply(state.problem.source)
        recurs = rms_motion(moved - state.anchor) / state.radius <= state.options.tolerance
    status, reason = mark(after.status, after.reason, recurs & (taken > 1), Status.STALLED, recurrence.AGAIN)
    anchor = recurrence.anchor(taken, moved, state.anchor)
    return changed(after, status=status, reason=reason, taken=taken, anchor=anchor)


HYPOTHESIS_MIXTURE = Method(
    name="hypothesis-mixture",
    summary="a fit to the average of one greedy and several drawn one-to-one assignments, at a shrinking width",
    source="after García-Fernández et al. 2018, the idea of a mixture only",
    start=_start,
    step=_step,
    options=HypothesisOptions,
)
