"""The closed-form fits as methods: one step from any start to the same optimum."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core.arrays import AnyArray, FloatArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, NoOptions, Problem
from solvers.core.partners import own_rows
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.geometry.rigid import fit_rigid, pair_cost

MOST_POWERS = 300
"""The largest ratio, in powers of ten, of the clouds' widths for which a similarity is sought."""


@dataclass(frozen=True, eq=False)
class KabschState:
    """A paired fit before and after its one step; the fields beyond `State`'s are those of `rigid.Fit`, and are blank
    (zeros, condition infinite) before the step. The objective is Σ wᵢ ‖T pᵢ − qᵢ‖², (b,).
    """

    problem: Problem = field(metadata=CONSTANT)
    scaled: bool = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    singular_values: FloatArray
    determinant: AnyArray
    condition: FloatArray

    __repr__ = brief


def _start(problem: Problem, scaled: bool) -> KabschState:
    b = problem.size
    return KabschState(
        problem=problem,
        scaled=scaled,
        pose=problem.start,
        objective=pair_cost(problem.start, problem.source, problem.target, problem.weights),
        status=statuses((b,)),
        reason=reasons((b,)),
        singular_values=np.zeros((b, problem.dim)),
        determinant=np.zeros(b, dtype=np.int8),
        condition=np.full(b, np.inf),
    )


def _step(state: KabschState) -> KabschState:
    fit = fit_rigid(state.problem.source, state.problem.target, state.problem.weights, scale=state.scaled)
    return changed(
        state,
        pose=fit.pose,
        objective=fit.cost,
        status=fit.status,
        reason=fit.reason,
        singular_values=fit.singular_values,
        determinant=fit.determinant,
        condition=fit.condition,
    )


def _start_rigid(problem: Problem, options: NoOptions) -> KabschState:
    return _start(problem, scaled=False)


def _start_similarity(problem: Problem, options: NoOptions) -> KabschState:
    state = _start(problem, scaled=True)
    powers = [_power(cloud, problem.weights) for cloud in (problem.source, problem.target)]
    apart = np.abs(powers[1] - powers[0]) > MOST_POWERS
    words = f"one cloud is more than 1e+{MOST_POWERS} times as wide as the other: no float64 is their scale"
    status, reason = mark(state.status, state.reason, apart, Status.DEGENERATE, words)
    return changed(state, status=status, reason=reason)


def _power(points: FloatArray, weights: FloatArray) -> FloatArray:
    """log₁₀ of the width of each cloud (b, n, d), (b,), over the points with a weight; 0 for a cloud of no width."""
    counts = (weights > 0.0)[..., None]
    low, high = np.where(counts, points, np.inf).min(axis=1), np.where(counts, points, -np.inf).max(axis=1)
    width = np.where(counts.any(axis=1), high - low, 0.0).max(axis=-1)
    powers: FloatArray = np.log10(np.where(width > 0.0, width, 1.0))
    return powers


KABSCH = Method(
    name="kabsch",
    summary="the rigid motion of known pairs with the least weighted sum of squares, in closed form",
    source="Kabsch 1976; Arun, Huang & Blostein 1987",
    start=_start_rigid,
    step=_step,
    partners=lambda state: own_rows(state.problem.weights > 0.0),
    paired=True,
    weighted=True,
    dims=None,
    max_steps=1,
    any_extent=True,
)

SIMILARITY = Method(
    name="similarity",
    summary="the rigid motion and scale of known pairs with the least weighted sum of squares, in closed form",
    source="Umeyama 1991",
    start=_start_similarity,
    step=_step,
    partners=lambda state: own_rows(state.problem.weights > 0.0),
    paired=True,
    weighted=True,
    scaled=True,
    dims=None,
    max_steps=1,
    any_extent=True,
)
