"""One-to-one association by loopy belief propagation.

How likely is it that a source point is a given target point, given all the others?

Each source point is one target point or missed, and each target point is at most one
source point. An association a has the weight
`Π_{pairs (i, j) of a} ψ_ij · Π_{i missed} ψ₀`, ψ the Gaussian score, ψ₀ the miss score.
The marginal `P(a_i = j)` sums over exponentially many associations; the messages of
Williams and Lau approximate it in a few sweeps:

    μ_{i→j} = ψ_ij / (ψ₀ + Σ_{k≠j} ψ_ik ν_{k→i}),   ν_{j→i} = 1 / (1 + Σ_{l≠i} μ_{l→j}),
    P(a_i = j) ≈ ψ_ij ν_{j→i} / (ψ₀ + Σ_k ψ_ik ν_{k→i}).

If the pairs of positive score form no loop, they are exact once the sweeps have crossed
the tree; with loops they are approximate: at 2 × 2 and the default ψ₀ the error reaches
0.1, and more with a smaller ψ₀ (checked by enumeration in the tests). The sweeps
converge from any start to one fixed point (the paper's theorem). The marginals are the
weights of a rigid fit, at a width σ that shrinks.

This borrows the association step of a tracker but is not a tracker: it has no motion
model, no existence, and no clutter model beyond a weight of one. Independently sampled
surfaces need not match one to one at all.

References
----------
.. [1] J. L. Williams, R. A. Lau, "Approximate evaluation of marginal association
   probabilities with belief propagation", 2014, sec. III. doi:10.1109/TAES.2014.120568
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.tree import CONSTANT, SHARED, changed, take
from solvers.methods.soft import radius_pairs, schedule
from solvers.methods.soft.radius_pairs import Candidates


@dataclass(frozen=True)
class BpOptions:
    """Options of `association-bp`.

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
    sweeps : int, default 6
        How many times the messages go back and forth at every step.
    least_support : float, default 0.15
        Source points whose marginals sum to less are left out of the fit.
    tolerance : float, default 1e-5
        The run stops when σ has reached `last` and a step's RMS motion of the source
        points is at most this fraction of their RMS radius.

    Raises
    ------
    ValueError
        If an option is out of its range. A run raises it, too, for clouds of more than
        14 million pairs of points (`solvers.methods.soft.radius_pairs`).

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> register(scene.source, scene.target, "association-bp", options=options.BpOptions(last=0.2)).detail("sigma")
    np.float64(0.2)
    """

    first: float | None = None
    last: float | None = None
    shrink: float = 0.9
    reach: float = 4.0
    miss: float = 0.12
    sweeps: int = 6
    least_support: float = 0.15
    tolerance: float = 1e-5

    def __post_init__(self) -> None:
        schedule.check(self)
        validate.count(self.sweeps, "sweeps", 1)


@dataclass(frozen=True, eq=False)
class BpState:
    """The fields of `schedule.Scheduled`, and taken: (b, n) the sum of each target point's marginals."""

    problem: Problem = field(metadata=CONSTANT)
    options: BpOptions = field(metadata=SHARED)
    radius: FloatArray = field(metadata=CONSTANT)
    last: FloatArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    sigma: FloatArray
    soft: FloatArray
    support: FloatArray
    used: BoolArray
    taken: FloatArray
    change: FloatArray
    condition: FloatArray

    __repr__ = brief


def messages(pairs: Candidates, psi: FloatArray, miss: float, sweeps: int) -> FloatArray:
    """The marginals of the listed pairs, (e,), from their scores psi (e,), after `sweeps` sweeps from uninformed
    messages. Written with `ω = ψ ν = ψ / (1 + Σ_l μ_l − μ)`, so that a sweep needs only two divisions.
    """
    omega, mu, work = psi.copy(), np.empty_like(psi), np.empty_like(psi)
    for _ in range(sweeps):
        np.subtract(pairs.along(pairs.row_sums(omega) + miss), omega, out=work)
        # At least the miss score must remain, whatever the rounding.
        np.maximum(work, miss, out=work)
        np.divide(psi, work, out=mu)
        np.take(pairs.column_sums(mu) + 1.0, pairs.column, out=work, mode="clip")
        np.subtract(work, mu, out=work)
        np.maximum(work, 1.0, out=work)
        np.divide(psi, work, out=omega)
    np.divide(omega, pairs.along(pairs.row_sums(omega) + miss), out=omega)
    return omega


def bp_marginals(scores: ArrayLike, miss: float = 0.12, sweeps: int = 6) -> FloatArray:
    """P(a_i = j) by belief propagation, (m, n), for the non-negative scores ψ (m, n); ψ₀ is `miss`.

    Raises ValueError unless the scores are a matrix and the miss score is positive.
    """
    psi = _matrix(scores, miss)
    row, column = np.nonzero(psi)
    values = psi[row, column]
    pairs = radius_pairs.listed(row, column, values, *psi.shape)
    out = np.zeros(psi.shape)
    out[row, column] = messages(pairs, values, miss, validate.count(sweeps, "sweeps", 1))
    return out


def exact_marginals(scores: ArrayLike, miss: float = 0.12) -> FloatArray:
    """P(a_i = j) exactly, (m, n), by summing over all one-to-one associations;
    arguments as in `bp_marginals`.

    It enumerates the 2ⁿ sets of taken columns and raises ValueError for n above 16.
    """
    psi = _matrix(scores, miss)
    m, n = psi.shape
    if n > 16:
        raise ValueError(f"scores: enumeration takes at most 16 columns, got {n}")
    sets = np.arange(2**n)

    def onward(weight: FloatArray, i: int) -> FloatArray:
        """The weights of all sets of taken columns after adding row i."""
        sums = miss * weight
        for j in range(n):
            free = sets[(sets >> j) & 1 == 0]
            sums[free | (1 << j)] += psi[i, j] * weight[free]
        return sums

    forward = [np.where(sets == 0, 1.0, 0.0)]
    backward = [forward[0]]
    for i in range(m):
        forward.append(onward(forward[-1], i))
        backward.append(onward(backward[-1], m - 1 - i))
    whole = forward[m].sum()
    out = np.zeros((m, n))
    for i in range(m):
        first, rest = forward[i], backward[m - 1 - i]
        # The associations of the other rows that leave column j free: pairs of disjoint sets, summed over subsets.
        below = _subset_sums(rest, n)
        for j in range(n):
            free = sets[(sets >> j) & 1 == 0]
            room = (2**n - 1) ^ free ^ (1 << j)
            out[i, j] = psi[i, j] * float(first[free] @ below[room]) / whole
    return out


def _subset_sums(values: FloatArray, n: int) -> FloatArray:
    """For every subset of the n columns, the sum of the values of its subsets."""
    out = values.reshape((2,) * n).copy() if n else values.copy()
    for axis in range(n):
        np.cumsum(out, axis=axis, out=out)
    return out.reshape(-1)


def _matrix(scores: ArrayLike, miss: float) -> FloatArray:
    psi = np.asarray(scores, dtype=np.float64)
    if psi.ndim != 2 or psi.size == 0 or not np.isfinite(psi).all() or (psi < 0.0).any():
        raise ValueError(f"scores: expected a finite (m, n) matrix that is not negative, got shape {psi.shape}")
    validate.number(miss, "miss", 1e-300)
    return psi


def _pairs(state: BpState) -> tuple[Candidates, FloatArray]:
    """The pairs within reach at the state's pose and width, and their marginals."""
    options, problem = state.options, state.problem
    pairs = radius_pairs.within_reach(state.pose.apply(problem.source), problem.target, options.reach * state.sigma)
    psi = radius_pairs.scores(pairs, problem.source.shape[1], state.sigma)
    return pairs, messages(pairs, psi, options.miss, options.sweeps)


def marginal_matrix(state: BpState, i: int = 0) -> FloatArray:
    """The marginals (m, n) of problem i at the state's pose and width, for figures."""
    single: BpState = take(state, np.array([i]))
    pairs, p = _pairs(single)
    out = np.zeros((pairs.rows, pairs.columns))
    out[pairs.row, pairs.column] = p
    return out


def _associate(state: BpState) -> BpState:
    pairs, p = _pairs(state)
    b, m, d = state.problem.source.shape
    flat = np.ascontiguousarray(state.problem.target.reshape(-1, d).T)
    with np.errstate(over="ignore", under="ignore"):
        mass = pairs.row_sums(p).reshape(b, m)
        parts = [pairs.row_sums(p * flat[k].take(pairs.column)) for k in range(d)]
        taken = pairs.column_sums(p).reshape(b, -1)
    return schedule.associated(changed(state, taken=taken), mass, np.stack(parts, axis=-1).reshape(b, m, d))


def _start(problem: Problem, options: BpOptions) -> BpState:
    radius_pairs.few_enough(problem, "association-bp")
    zeros = np.zeros(problem.target.shape[:2])
    return _associate(BpState(**schedule.initial(problem, options), taken=zeros))


def _step(state: BpState) -> BpState:
    return schedule.step(state, _associate)


ASSOCIATION_BP = Method(
    name="association-bp",
    summary="a fit weighted by one-to-one association marginals from belief propagation, at a shrinking width",
    source="Williams & Lau 2014, borrowed from tracking",
    start=_start,
    step=_step,
    options=BpOptions,
)
