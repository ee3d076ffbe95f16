"""Annealed soft targets: every moving point is drawn to a weighted mean of the fixed ones, less and less soft.

With `K_ij = exp(−‖T p_i − q_j‖² / 2σ²)` and a constant score o (`miss`) for 'no partner', point i has

    support   s_i = Σ_j K_ij / (Σ_j K_ij + o)
    target    μ_i = Σ_j K_ij q_j / Σ_j K_ij

A step fits a rigid motion to the targets, each row weighted by its support, rows below `least_support` dropped; then σ
shrinks by `shrink`, down to `last`.

A heuristic, and not CPD: it is normalised over the fixed points for each moving one, CPD the other way round; its o
does not scale with σ or with the number of points, so the weight of 'no partner' moves with both; and σ follows a
schedule, whatever the fit. At one σ and with no row dropped a step lowers `−σ² Σ_i log(1 + Σ_j K_ij / o)` (it lowers a
bound of it, the targets being held), which is the objective here; over a run σ and the dropped rows change, and it may
rise.

In the manner of Rangarajan et al. 1997, The softassign Procrustes matching algorithm, whose assignment is doubly
normalised; this one is not.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from solvers import gaussians, validate
from solvers.arrays import BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.icp import fit_pairs, rms_radius
from solvers.pose import Pose
from solvers.rows import CONSTANT, SHARED
from solvers.status import Status, mark, reasons, statuses
from solvers.stepper import Method, Problem

_NOTHING = "no row has enough support"


@dataclass(frozen=True)
class SoftOptions:
    """first, shrink, last: σ begins at `first`, world units, and is multiplied by `shrink`, above 0 up to 1, after
    every step until it is `last`. miss: the score o of 'no partner'. least_support: rows below it are dropped, 0 to
    below 1.

    It stops when, σ being `last`, a step moves the source points, root mean square, by at most `tolerance` of their RMS
    radius.
    """

    first: float = 1.1
    shrink: float = 0.9
    last: float = 0.12
    miss: float = 0.12
    least_support: float = 0.15
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        for name in ("first", "last", "miss"):
            validate.number(getattr(self, name), name, 1e-100, 1e100)
        validate.number(self.shrink, "shrink", 1e-6, 1.0)
        if self.last > self.first:
            raise ValueError(f"last: expected at most first, {self.first:g}, got {self.last!r}")
        if not 0.0 <= validate.number(self.least_support, "least_support") < 1.0:
            raise ValueError(f"least_support: expected 0 to below 1, got {self.least_support!r}")
        validate.number(self.tolerance, "tolerance", 0.0)


@dataclass(frozen=True, eq=False)
class SoftState:
    """A pose, σ, and the soft targets there.

    sigma: (b,) world units. moved: (b, m, d). mass: (b, m) Σ_j K_ij. targets: (b, m, d) μ_i. weights: (b, m) the
    support, zero where dropped. change: (b,) how far the last step moved the points, root mean square, over their RMS
    radius `radius`. condition: (b,) that of the last fit.
    """

    problem: Problem = field(metadata=CONSTANT)
    radius: FloatArray = field(metadata=CONSTANT)
    options: SoftOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    sigma: FloatArray
    moved: FloatArray
    mass: FloatArray
    targets: FloatArray
    weights: FloatArray
    change: FloatArray
    condition: FloatArray


def _start(problem: Problem, options: SoftOptions) -> SoftState:
    b, m, _ = problem.source.shape
    nothing = np.zeros((b, m))
    state = SoftState(
        problem=problem, radius=rms_radius(problem.source), options=options, pose=problem.start, objective=np.zeros(b),
        status=statuses((b,)), reason=reasons((b,)), sigma=np.full(b, options.first), moved=problem.source,
        mass=nothing, targets=problem.source, weights=nothing, change=np.full(b, np.inf), condition=np.full(b, np.inf),
    )  # fmt: skip
    return _soften(state, problem.start, state.sigma)


def _soften(state: SoftState, pose: Pose, sigma: FloatArray) -> SoftState:
    """The state at another pose and σ; degenerate where no row is left."""
    options = state.options
    with np.errstate(over="ignore", under="ignore"):
        moved = pose.apply(state.problem.source)
        near = gaussians.sums(moved, state.problem.target, sigma, gaussians.powers(state.problem.target))
        mass, targets = near[..., 0], near[..., 1:] / near[..., :1]
        support = mass / (mass + options.miss)
        objective = -np.square(sigma) * np.log1p(mass / options.miss).sum(axis=1)
    weights = np.where(support >= options.least_support, support, 0.0)
    left: BoolArray = weights.max(axis=1) > 0.0
    status, reason = mark(state.status, state.reason, ~left, Status.DEGENERATE, _NOTHING)
    return replace(
        state, pose=pose, objective=objective, status=status, reason=reason, sigma=sigma, moved=moved, mass=mass,
        targets=targets, weights=weights,
    )  # fmt: skip


def _step(state: SoftState) -> SoftState:
    options = state.options
    pose, free, condition = fit_pairs(state.pose, state.problem.source, state.targets, state.weights)
    final = state.sigma <= options.last
    after = _soften(state, pose, np.maximum(state.sigma * options.shrink, options.last))
    with np.errstate(over="ignore", under="ignore"):
        step = after.moved - state.moved
        change = np.sqrt(np.einsum("bmd,bmd->b", step, step) / step.shape[1]) / state.radius
    rest = final & (change <= options.tolerance)
    status, reason = after.status, after.reason
    for i in np.flatnonzero(rest & (free != "")):
        status, reason = mark(status, reason, np.arange(len(rest)) == i, Status.DEGENERATE, str(free[i]))
    status, reason = mark(status, reason, rest, Status.CONVERGED, "the pose has come to rest at the last σ")
    return replace(after, status=status, reason=reason, change=change, condition=condition)


SOFT = Method(
    name="soft-annealed",
    summary="rigid fits to Gaussian-weighted means of the fixed points, their width shrinking; a heuristic",
    source="in the manner of Rangarajan et al. 1997",
    start=_start,
    step=_step,
    options=SoftOptions,
    dims=None,
)
