"""MMD-Reg: move one cloud until the mean features of both agree.

No point is paired with any other.

With the mean feature of `solvers.features` at length scale ℓ, a pose has the residual
`r(T) = mean φ(T x) − mean φ(y)` (2D numbers) and the objective `‖r‖²`, which estimates
MMD². Here X moves and Y is fixed, the reverse of CPD's notation. The mean of the fixed
cloud is computed once per ℓ. Levenberg-Marquardt minimises over translation and
rotation, the latter about the moved cloud's centroid and scaled by its RMS radius, so
that units and origin do not matter. The length scale follows a falling schedule, each
stage starting where the last one ended; the objective jumps when ℓ changes.

With E_k = mean exp(i ω_kᵀq) over the moved points q: `∂_t E_k = i ω_k E_k` and, for a
turn in the plane with generator K, `∂_φ E_k = i ω_kᵀ K mean(q exp(i ω_kᵀ q))`.
`feature_sums` gives all these sums at once.

Nothing compensates for density, partial overlap or clutter: they move the minimum, and
random features add minima of their own. Left out of [1]_: learned starts, scales and
overlap weights.

Every source point counts, strays too: one far off displaces the centroid and raises the
radius, so that a run can end near its start. `room("noise")`, started 10° and 0.3 u
off, ends 1° and 0.1 u off; with a source point added at (100, −100), 11° and 0.6 u off.
Leave such points out.

Two defaults differ from [1]_; options give the authors' choices. The frequencies are
Gaussian; the authors' code also offers "Laplace", the distribution of each coordinate
of a frequency, of scale 1/ℓ. Its kernel is `kernel="cauchy"` here, with ℓ smaller by
√2; it is not Laplace's kernel, `kernel="laplace"`. One draw is rescaled through all
stages; the authors draw again for each (`redraw=True`), with a different number of
waves (`count`, one per stage).

References
----------
.. [1] R. Crane and others, "Scalable and differentiable point-cloud registration using
   maximum mean discrepancy", 2026 (random features, Levenberg-Marquardt, a length-scale
   schedule). arXiv:2606.27818
.. [2] A. Rahimi, B. Recht, "Random features for large-scale kernel machines", 2007.
.. [3] A. Gretton and others, "A kernel two-sample test", Journal of Machine Learning
   Research 13, 2012.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.kinds import shown
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.rotations import planar
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed, put, take
from solvers.numerics.fits import rms_radius, typical_radius
from solvers.numerics.fourier_features import KERNELS, feature_sums, mean_features, unit_frequencies

_FRACTIONS = (0.6, 0.3, 0.15, 0.075)
_ATTEMPTS = 6
_WEAK = 1e-10  # of the largest eigenvalue: below this a direction is undetermined


@dataclass(frozen=True)
class MmdOptions:
    """Options of `mmd`.

    Every source point counts, and one far away can keep the run near its start: leave
    such points out.

    Parameters
    ----------
    lengths : float or sequence of float, optional
        The schedule of ℓ, world units, each positive. None is the target's RMS radius
        times 0.6, 0.3, 0.15 and 0.075.
    count : int or sequence of int, default 32
        D, the number of frequencies, at least 1: one for all stages, or one for each of
        the `lengths`. Without `redraw` a stage takes the first D of one draw.
    kernel : str, default "gaussian"
        The kernel for which frequencies are drawn, with x the difference of two points:
        "gaussian", `exp(−‖x‖²/2ℓ²)`; "cauchy", `Π 1/(1 + x_j²/2ℓ²)`, Laplace
        frequencies along each axis; "laplace", `exp(−‖x‖/ℓ)`, multivariate Cauchy
        frequencies. The last have no variance, so JᵀJ has no mean and grows with D: the
        kernel has a kink where points meet. The fastest waves dominate the step, and a
        run stops early unless it starts close.
    redraw : bool, default False
        Whether every stage draws its own frequencies; otherwise the first stage's draw
        serves all.
    damping : float, default 1e-3
        λ of each stage's first step, a fraction of the largest eigenvalue of JᵀJ.
    tolerance : float, default 1e-6
        The last stage ends when a step's RMS motion of the source points is at most
        this fraction of their RMS radius.
    coarse : float, default 1e-2
        The same fraction for the stages before the last.
    decrease : float, default 1e-6
        A stage also ends when a step lowers the objective by at most this fraction.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> register(scene.source, scene.target, "mmd", options=options.MmdOptions(count=64)).detail("frequencies").shape
    (64, 2)
    """

    lengths: float | Sequence[float] | FloatArray | None = None
    count: int | Sequence[int] | IntArray = 32
    kernel: str = "gaussian"
    redraw: bool = False
    damping: float = 1e-3
    tolerance: float = 1e-6
    coarse: float = 1e-2
    decrease: float = 1e-6

    def __post_init__(self) -> None:
        lengths = () if self.lengths is None else validate.one_or_several(self.lengths, "lengths")
        if self.lengths is not None:
            # Store a tuple, since the caller's array could change later.
            object.__setattr__(self, "lengths", tuple(validate.number(x, "lengths", 1e-100, 1e100) for x in lengths))
        counts = tuple(validate.count(x, "count", 1) for x in validate.one_or_several(self.count, "count"))
        stages = len(lengths or _FRACTIONS)
        if len(counts) not in (1, stages):
            raise ValueError(f"count: expected one number or one for each of {stages} stages, got {shown(self.count)}")
        object.__setattr__(self, "count", counts if len(counts) > 1 else counts[0])
        validate.one_of(self.kernel, KERNELS, "kernel")
        validate.flag(self.redraw, "redraw")
        validate.number(self.damping, "damping", 1e-12, 1e12)
        for name in ("tolerance", "coarse", "decrease"):
            validate.number(getattr(self, name), name, 0.0)


@dataclass(frozen=True, eq=False)
class MmdState:
    """A pose and the two mean features there, at the current length scale.

    lengths: (b, L) the schedule. draws: (b, S, D, d) frequencies in units of 1/ℓ, S = L sets, one per stage, or one for
    all. counts: (b, L) how many of them a stage takes; where that is less than D, the rest of `frequencies` and the
    entries that belong to it are zero. fixed_means: (b, L, 2D) of the target, one per stage. centred: (b, m, d) the
    source about its centroid (b, d) `centroid`, `radius` (b,) its RMS radius. stage: (b,) counted from 0. frequencies:
    (b, D, d) and length: (b,) ℓ, world units, of the stage. moving_mean, fixed_mean: (b, 2D), cosines first, and
    residual, their difference. jacobian: (b, 2D, p) of the residual in p = d + d(d − 1)/2 dimensionless parameters: the
    translation in ℓ, then a turn about the moved centroid in ℓ over the RMS radius. The objective is ‖residual‖².
    damping: (b,) λ. condition: (b,) of JᵀJ; weak: (b, p) the unit vector of its least determined direction. change:
    (b,) how far the last step moved the points, root mean square, as a fraction of `radius`.
    """

    problem: Problem = field(metadata=CONSTANT)
    options: MmdOptions = field(metadata=SHARED)
    lengths: FloatArray = field(metadata=CONSTANT)
    draws: FloatArray = field(metadata=CONSTANT)
    counts: IntArray = field(metadata=CONSTANT)
    fixed_means: FloatArray = field(metadata=CONSTANT)
    centred: FloatArray = field(metadata=CONSTANT)
    centroid: FloatArray = field(metadata=CONSTANT)
    radius: FloatArray = field(metadata=CONSTANT)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    stage: IntArray
    frequencies: FloatArray
    length: FloatArray
    moving_mean: FloatArray
    fixed_mean: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    damping: FloatArray
    condition: FloatArray
    weak: FloatArray
    change: FloatArray

    __repr__ = brief


def _planes(d: int) -> list[tuple[int, int]]:
    """The coordinate planes (i, j), i < j, of rotations: one in the plane, three in space."""
    return [(i, j) for i in range(d) for j in range(i + 1, d)]


def _moved_by(pose: Pose, centroid: FloatArray, shift: FloatArray, turns: FloatArray) -> Pose:
    """`pose`, then turned about the moved centroid by `turns` (b, planes), then shifted
    by (b, d).
    """
    d = pose.dim
    if d == 2:
        turn = planar(turns[:, 0])
    else:
        # Cayley's map gives a rotation for every antisymmetric matrix and equals the exponential to second order.
        A = np.zeros((len(turns), d, d))
        for k, (i, j) in enumerate(_planes(d)):
            A[:, j, i], A[:, i, j] = 0.5 * turns[:, k], -0.5 * turns[:, k]
        turn = np.asarray(np.linalg.solve(np.eye(d) - A, np.eye(d) + A), dtype=np.float64)
    R = turn @ pose.R
    centre = (pose.R @ centroid[..., None])[..., 0] + pose.t
    return Pose.trusted(R, centre + shift - (R @ centroid[..., None])[..., 0])


def _evaluate(state: MmdState, pose: Pose) -> tuple[FloatArray, FloatArray]:
    """The moving cloud's mean feature (b, 2D) and its Jacobian (b, 2D, p), as in
    `MmdState`, at the state's ℓ.
    """
    z, ell, radius = state.frequencies, state.length, state.radius
    b, m, d = state.centred.shape
    D, count = z.shape[1], state.counts[np.arange(b), state.stage]
    R = pose.R
    # About the centroid the points only turn; the centroid's position is one phase per frequency.
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        unit = (state.centred @ R.swapaxes(-1, -2)) / radius[:, None, None]
        c, s = feature_sums(unit, z * (radius / ell)[:, None, None])
        turning = (c + 1j * s) / (m * np.sqrt(count))[:, None, None]
        if (count < D).any():
            turning[np.arange(D) >= count[:, None]] = 0.0
        centre = (R @ state.centroid[..., None])[..., 0] + pose.t
        phase = (z @ (centre / ell[:, None])[..., None])[..., 0]
        turning *= np.exp(1j * phase)[..., None]
    if not np.isfinite(turning).all():  # the cloud spans too many wavelengths for finite phases
        turning = np.where(np.isfinite(turning), turning, 0.0)
    mean, first = turning[..., 0], turning[..., 1:]
    planes = _planes(d)
    J = np.empty((b, D, d + len(planes)), dtype=np.complex128)
    J[..., :d] = z * mean[..., None]
    for k, (i, j) in enumerate(planes):
        J[..., d + k] = z[..., j] * first[..., i] - z[..., i] * first[..., j]
    J *= 1j
    return np.concatenate([mean.real, mean.imag], axis=1), np.concatenate([J.real, J.imag], axis=1)


def _at(state: MmdState, pose: Pose) -> MmdState:
    """The state re-evaluated at `pose`."""
    mean, J = _evaluate(state, pose)
    residual = mean - state.fixed_mean
    return changed(
        state, pose=pose, moving_mean=mean, residual=residual, jacobian=J,
        objective=np.einsum("bk,bk->b", residual, residual),
    )  # fmt: skip


def _at_stage(state: MmdState, stage: IntArray) -> MmdState:
    """The state at the same pose with the length scale of `stage` (b,)."""
    rows = np.arange(len(stage))
    z = state.draws[rows, stage if state.draws.shape[1] > 1 else 0]
    few = np.arange(z.shape[1]) >= state.counts[rows, stage, None]
    state = changed(
        state, stage=stage, frequencies=np.where(few[..., None], 0.0, z), length=state.lengths[rows, stage],
        fixed_mean=state.fixed_means[rows, stage], damping=np.full(len(stage), float(state.options.damping)),
    )  # fmt: skip
    return _at(state, state.pose)


def _draws(problem: Problem, options: MmdOptions, stages: int) -> tuple[FloatArray, IntArray]:
    """The frequencies (b, S, D, d) and how many each stage takes, (L,), as in `MmdState`."""
    counts = np.array(np.broadcast_to(options.count, (stages,)), dtype=np.int64)
    sets = range(stages if options.redraw else 1)
    draws = [unit_frequencies(problem.seed, int(counts.max()), problem.dim, options.kernel, k) for k in sets]
    return np.stack(draws, axis=1), counts


def _start(problem: Problem, options: MmdOptions) -> MmdState:
    b, _, d = problem.source.shape
    p = d + len(_planes(d))
    if options.lengths is None:
        lengths = typical_radius(problem.target)[:, None] * np.array(_FRACTIONS)
    else:
        lengths = np.tile(np.array(options.lengths, dtype=np.float64), (b, 1))
    draws, counts = _draws(problem, options, lengths.shape[1])
    D, means = draws.shape[2], []
    for stage, (ell, count) in enumerate(zip(lengths.T, counts, strict=True)):
        z = draws[:, stage if options.redraw else 0, :count]
        with np.errstate(over="ignore", under="ignore"):
            mean = mean_features(problem.target, z / ell[:, None, None])
        means.append(np.pad(mean.reshape(b, 2, count), ((0, 0), (0, 0), (0, D - count))).reshape(b, 2 * D))
    centroid = problem.source.mean(axis=1)
    zeros = np.zeros((b, 2 * D))
    state = MmdState(
        problem=problem, options=options, lengths=lengths, draws=draws, counts=np.tile(counts, (b, 1)),
        fixed_means=np.stack(means, axis=1), centred=problem.source - centroid[:, None], centroid=centroid,
        radius=rms_radius(problem.source), pose=Pose.trusted(problem.start.R, problem.start.t), objective=np.zeros(b),
        status=statuses((b,)), reason=reasons((b,)), stage=np.zeros(b, dtype=np.int64), frequencies=draws[:, 0],
        length=lengths[:, 0], moving_mean=zeros, fixed_mean=means[0], residual=zeros,
        jacobian=np.zeros((b, 2 * D, p)), damping=np.full(b, float(options.damping)), condition=np.full(b, np.inf),
        weak=np.zeros((b, p)), change=np.full(b, np.inf),
    )  # fmt: skip
    return _at_stage(state, state.stage)


def _step(state: MmdState) -> MmdState:
    """Take one step that lowers the objective, raising λ until one does; at rest, go to the next length scale."""
    options = state.options
    b, d = len(state.stage), state.problem.dim
    J = state.jacobian
    g = (J.swapaxes(1, 2) @ state.residual[..., None])[..., 0]
    values, V = np.linalg.eigh(J.swapaxes(1, 2) @ J)
    values = np.maximum(values, 0.0)
    top = np.maximum(values[:, -1], np.finfo(np.float64).tiny)
    along = (V.swapaxes(1, 2) @ g[..., None])[..., 0]

    damping, change = state.damping.copy(), np.zeros(b)
    after, pending, small = state, np.ones(b, dtype=np.bool_), np.zeros(b, dtype=np.bool_)
    limit = np.where(state.stage == state.lengths.shape[1] - 1, options.tolerance, options.coarse)
    for _ in range(_ATTEMPTS):
        rows = np.flatnonzero(pending)
        step = -along[rows] / (values[rows] + (damping * top)[rows, None])
        step = (V[rows] @ step[..., None])[..., 0]
        size = np.linalg.norm(step, axis=1)
        whole = rows.size == b  # always so for a batch of one problem: nothing to copy
        trial = state if whole else take(state, rows)
        with np.errstate(over="ignore"):
            per_radius = np.minimum(trial.length / trial.radius, 1e300)
        # Cap the step at one length scale, and at one radian about each axis.
        cap = 1.0 / np.maximum(np.maximum(1.0, size), np.abs(step[:, d:]).max(axis=1) * per_radius)
        step *= cap[:, None]
        shift, turn = step[:, :d] * trial.length[:, None], step[:, d:] * per_radius[:, None]
        trial = _at(trial, _moved_by(trial.pose, trial.centroid, shift, turn))
        motion = cap * size * per_radius
        better = trial.objective < state.objective[rows]
        winners, losers = rows[better], rows[~better]
        after = trial if whole and better.all() else put(after, winners, take(trial, better))
        change[winners] = motion[better]
        damping[winners] = np.maximum(0.2 * damping[winners], 1e-9)
        damping[losers] *= 8.0
        small[rows] = motion <= limit[rows]
        pending[winners] = False
        pending &= ~small
        if not pending.any():
            break

    little = state.objective - after.objective <= options.decrease * state.objective
    least = np.maximum(values[:, 0], 1e-16 * top)
    condition = np.where(least > 0.0, top / np.where(least > 0.0, least, 1.0), np.inf)
    after = changed(after, damping=damping, change=change, condition=condition, weak=V[:, :, 0])
    return _end_of_stage(after, small | little, pending, values[:, 0] <= _WEAK * top)


def _end_of_stage(state: MmdState, rest: BoolArray, stuck: BoolArray, weak: BoolArray) -> MmdState:
    """Move problems at rest or without an improving step (`stuck`) to the next length scale, or end them."""
    ended = rest | stuck
    if not ended.any():
        return state
    last = state.stage == state.lengths.shape[1] - 1
    status, reason = state.status, state.reason
    turn = np.square(state.weak[:, state.problem.dim :]).sum(axis=1) > 0.5
    over = ended & last
    for rotating, words in ((True, "the rotation"), (False, "a translation")):
        status, reason = mark(
            status, reason, over & weak & (turn == rotating), Status.DEGENERATE,
            f"{words} leaves the mean feature as it is: the clouds do not determine it",
        )  # fmt: skip
    status, reason = mark(status, reason, over & stuck, Status.STALLED, "no step lowers the objective")
    status, reason = mark(status, reason, over, Status.CONVERGED, "the pose or the objective has come to rest")
    state = changed(state, status=status, reason=reason)
    onward = np.flatnonzero(ended & ~last)
    if onward.size:
        part = take(state, onward)
        state = put(state, onward, _at_stage(part, part.stage + 1))
    return state


MMD = Method(
    name="mmd",
    summary="the pose at which the mean random features of the two clouds agree best, over shrinking length scales",
    source="Crane et al. 2026; Rahimi & Recht 2007",
    start=_start,
    step=_step,
    options=MmdOptions,
    dims=None,
)
