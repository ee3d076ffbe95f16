"""The run on a schedule of widths that three methods share.

They associate at the current pose and σ; fit the source points, each weighted by its
support `s_i`, to their soft targets (the mean of the target points associated with
them), dropping rows of little support; shrink σ; associate again. They differ in the
association, a function from a state to soft targets and support.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.core.method import Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import changed
from solvers.numerics.fits import fit_pairs, lengths, rms_motion, rms_radius


def check(options: Any) -> None:
    """Raise a ValueError that names the option if the options are not a valid schedule:
    see `Scheduled`.
    """
    validate.widths(options.first, options.last)
    if not 0.0 < validate.number(options.shrink, "shrink") <= 1.0:
        raise ValueError(f"shrink: expected a factor above 0, up to 1, got {options.shrink!r}")
    if hasattr(options, "reach"):  # the dense sums of the annealed soft targets have none
        validate.number(options.reach, "reach", 0.1, 30.0)
    validate.number(options.miss, "miss", 1e-12, 1e12)
    validate.number(options.least_support, "least_support", 0.0, 1.0)
    validate.number(options.tolerance, "tolerance", 0.0)


class Scheduled(Protocol):
    """The fields that the state of an annealed association has in addition to `State`'s.

    sigma: (b,) σ, world units, and last: (b,) where it ends. soft: (b, m, d) the soft
    target of each source point (its own place if it has none). support: (b, m) s_i, 0 to
    1. used: (b, m) whether the support is at least `least_support`. The objective is
    `Σ s_i ‖T p_i − soft_i‖²` over these, which the next fit minimises. It becomes
    a different function with every association, and may rise. change: (b,) how far the last
    step moved the points, root mean square, as a fraction of `radius` (b,), the
    source's RMS radius. condition: (b,) of the last fit.
    """

    @property
    def problem(self) -> Problem: ...
    @property
    def options(self) -> Any: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def objective(self) -> FloatArray: ...
    @property
    def status(self) -> StatusArray: ...
    @property
    def reason(self) -> ReasonArray: ...
    @property
    def sigma(self) -> FloatArray: ...
    @property
    def last(self) -> FloatArray: ...
    @property
    def radius(self) -> FloatArray: ...
    @property
    def soft(self) -> FloatArray: ...
    @property
    def support(self) -> FloatArray: ...
    @property
    def used(self) -> BoolArray: ...


S = TypeVar("S", bound=Scheduled)
Associate = Callable[[S], S]


def initial(problem: Problem, options: Any) -> dict[str, Any]:
    """The fields of a schedule's state before the first association."""
    b, m, _ = problem.source.shape
    first, last = lengths(options.first, 0.3, problem.target), lengths(options.last, 0.03, problem.target)
    last = np.minimum(last, first) if options.last is None else last
    return {
        "problem": problem,
        "options": options,
        "radius": rms_radius(problem.source),
        "last": last,
        "pose": Pose.trusted(problem.start.R, problem.start.t),
        "objective": np.zeros(b),
        "status": statuses((b,)),
        "reason": reasons((b,)),
        "sigma": np.maximum(first, last),  # a `last` above the default `first` is also where it begins
        "soft": problem.source,
        "support": np.zeros((b, m)),
        "used": np.zeros((b, m), dtype=np.bool_),
        "change": np.full(b, np.inf),
        "condition": np.full(b, np.inf),
    }


def associated(state: S, mass: FloatArray, moment: FloatArray) -> S:
    """The state with soft targets from each row's mass (b, m) and moment (b, m, d), at
    its pose.
    """
    moved = state.pose.apply(state.problem.source)
    has_mass = mass > 0.0
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        soft = np.where(has_mass[..., None], moment / np.where(has_mass, mass, 1.0)[..., None], moved)
        # A mean lies among its points, up to rounding.
        soft = np.clip(soft, -validate.LARGEST, validate.LARGEST)
        used = has_mass & (mass >= state.options.least_support)
        gap = moved - soft
        squares = np.einsum("bmd,bmd->bm", gap, gap)
        objective = np.where(used, mass * squares, 0.0).sum(axis=1)
    status, reason = mark(
        state.status, state.reason, ~used.any(axis=1), Status.DEGENERATE,
        "no source point has enough support within reach",
    )  # fmt: skip
    return changed(
        state, soft=soft, support=np.minimum(mass, 1.0), used=used, objective=objective, status=status, reason=reason
    )


def step(state: S, associate: Associate[S]) -> S:
    """Fit to the soft targets, shrink σ, associate again. It converges when σ has
    reached its end and a step moves the points by at most `tolerance` of their RMS
    radius.
    """
    options = state.options
    weights = np.where(state.used, state.support, 0.0)
    pose, free, condition = fit_pairs(state.pose, state.problem.source, state.soft, weights)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        gap = pose.apply(state.problem.source) - state.pose.apply(state.problem.source)
        change = rms_motion(gap) / state.radius
    ended = state.sigma <= state.last
    sigma = np.where(ended, state.sigma, np.maximum(options.shrink * state.sigma, state.last))
    after = associate(
        changed(state, pose=pose, sigma=sigma, change=change, condition=condition)
    )
    rest = ended & (change <= options.tolerance)
    status, reason = after.status, after.reason
    for words in sorted({str(w) for w in free[rest & (free != "")]}):
        status, reason = mark(status, reason, rest & (free == words), Status.DEGENERATE, words)
    status, reason = mark(status, reason, rest, Status.CONVERGED, "the pose has come to rest at the last width")
    return changed(after, status=status, reason=reason)

