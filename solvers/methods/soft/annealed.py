"""Annealed soft targets.

Every moving point is drawn to a weighted mean of the fixed ones, with weights that
sharpen as the run proceeds.

With `K_ij = exp(−‖T p_i − q_j‖² / 2σ²)` and a constant score o (`miss`) for 'no
partner', point i has

    weights   w_ij = K_ij / (Σ_k K_ik + o),   support   s_i = Σ_j w_ij,   target   Σ_j w_ij q_j / s_i.

A step fits a rigid motion to the targets, each row weighted by its support, rows below
`least_support` dropped; then σ shrinks. Fit and schedule are those of
`solvers.methods.soft.schedule`, but over all pairs.

This is a heuristic, not CPD: weights are normalised over the fixed points for each
moving one, in CPD the other way round; o does not scale with σ or with the number of
points, so the weight of 'no partner' varies with both; and σ follows a schedule,
whatever the fit. At a fixed σ and with no row dropped, a step never raises
`−σ² Σ_i log(1 + Σ_j K_ij / o)`, for which the fitted sum of squares is a majoriser;
over a run, σ and the dropped rows change.

In the manner of [1]_, whose assignment is doubly normalised; this one is not.

References
----------
.. [1] A. Rangarajan, H. Chui, F. L. Bookstein, "The softassign Procrustes matching
   algorithm", 1997.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.tree import CONSTANT, SHARED
from solvers.methods.soft import schedule
from solvers.numerics import gaussians


@dataclass(frozen=True)
class SoftOptions:
    """Options of `soft-annealed`.

    Parameters
    ----------
    first : float, optional
        The first σ, world units. None is 0.3 of the target's RMS radius.
    last : float, optional
        The last σ, world units. None is 0.03 of that radius.
    shrink : float, default 0.9
        The factor by which σ shrinks at every step until it reaches `last`, above 0, at
        most 1.
    miss : float, default 0.12
        o, the score of having no partner; kernels are at most 1.
    least_support : float, default 0.15
        Source points with less support are left out of the fit.
    tolerance : float, default 1e-4
        The run stops when σ has reached `last` and a step's RMS motion of the source
        points is at most this fraction of their RMS radius.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> register(scene.source, scene.target, "soft-annealed", options=options.SoftOptions(last=0.2)).detail("sigma")
    np.float64(0.2)
    """

    first: float | None = None
    last: float | None = None
    shrink: float = 0.9
    miss: float = 0.12
    least_support: float = 0.15
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        schedule.check(self)


@dataclass(frozen=True, eq=False)
class SoftState:
    """The fields of `schedule.Scheduled`."""

    problem: Problem = field(metadata=CONSTANT)
    options: SoftOptions = field(metadata=SHARED)
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
    change: FloatArray
    condition: FloatArray

    __repr__ = brief


def _associate(state: SoftState) -> SoftState:
    target = state.problem.target
    with np.errstate(over="ignore", under="ignore"):
        moved = state.pose.apply(state.problem.source)
        near = gaussians.sums(moved, target, state.sigma, gaussians.powers(target))
        shares = near / (near[..., :1] + state.options.miss)
    return schedule.associated(state, shares[..., 0], shares[..., 1:])


def _start(problem: Problem, options: SoftOptions) -> SoftState:
    return _associate(SoftState(**schedule.initial(problem, options)))


def _step(state: SoftState) -> SoftState:
    return schedule.step(state, _associate)


def weights(state: SoftState, i: int = 0) -> FloatArray:
    """The matrix w (m, n) of problem i at the state's pose and σ, for figures; its rows sum to the support."""
    moved = state.pose[i].apply(state.problem.source[i])
    return gaussians.share_matrix(moved, state.problem.target[i], float(state.sigma[i]), state.options.miss)


SOFT = Method(
    name="soft-annealed",
    summary="rigid fits to Gaussian-weighted means of the fixed points, their width shrinking; a heuristic",
    source="in the manner of Rangarajan, Chui & Bookstein 1997",
    start=_start,
    step=_step,
    options=SoftOptions,
    dims=None,
)
