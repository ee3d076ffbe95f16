"""FilterReg: a Gaussian mixture on the fixed cloud, queried through a filter.

A query at a moving point returns where that point belongs.

Compared with CPD the roles are swapped: the N fixed points y_j are the components, the
M moving points x_i = T p_i the observations. With the moments at a query,
`m⁰ = Σ_j K_ij`, `m¹ = Σ_j K_ij y_j`, `m² = Σ_j K_ij ‖y_j‖²`,
`K_ij = exp(−‖x_i − y_j‖² / 2σ²)`, which a filter computes for all queries at once,

    target μ_i = m¹/m⁰,   weight W_i = m⁰ / (m⁰ + c),
    c = (2πσ²)^{d/2} w N / ((1 − w) V),

w the weight of the clutter and V the volume it is spread over. Here the clutter is
among the moving points. By default V is `6 r²`, the square in which evenly spread
points have the fixed cloud's RMS radius r: a choice of this package, which makes the
result independent of the unit of length. The stages of a step (`STAGES`) are

1. density: the fixed points' values 1, y, ‖y‖² are entered into the filter
   (`solvers.numerics.kernel_filters`)
2. filter: blurred with width σ; both are repeated only when σ has changed
3. query: m⁰, m¹, m² at the moving points, hence μ and W
4. twist: one Gauss-Newton step of `Σ W_i ‖x_i − μ_i‖²` in (v, ω), turned by ω exactly;
   and σ: by a schedule, or as `σ² = Σ W_i (‖x_i‖² − 2 x_i·m¹/m⁰ + m²/m⁰) / (d Σ W_i)`
   with the moved points and the current moments

The objective is the negative log-likelihood of the moving points under mixture and
clutter, with the filter's m⁰. It need not fall: a linearised step, an approximate
filter or a scheduled σ is not exact EM.

Planar. The variance is per coordinate: its divisor is the dimension, 2. Left out:
articulated and deformable models, point-to-plane residuals, features besides the
coordinates.

References
----------
.. [1] W. Gao, R. Tedrake, "FilterReg: robust and efficient probabilistic point-set
   registration using Gaussian filter and twist parameterization", 2019.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import AnyArray, BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.numerics import gauss_newton, kernel_filters
from solvers.numerics.fits import clutter_constant, pair_width, rms_motion, rms_radius, spread_volume, typical_radius

STAGES = ("density", "filter", "query", "twist")
"""What one step does, in order, by the names that a walkthrough shows."""

VARIANCES = ("estimated", "scheduled")

_RESOLVED = {"lattice": 0.01}
"""The relative change in σ below which a filter's estimate is noise: the lattice is rebuilt at every σ, and its
estimate then differs by 0.5 % RMS even at the same pose.
"""

_NOTHING = "the clutter explains every moving point: no weight is left"


@dataclass(frozen=True)
class FilterRegOptions:
    """Options of `filterreg`.

    A σ too small for the filter is raised to the smallest that it supports.

    Parameters
    ----------
    filter : str, default "lattice"
        "grid", "lattice" or "exact" (`solvers.numerics.kernel_filters`).
    variance : str, default "estimated"
        "estimated" at every step, or "scheduled".
    first : float, optional
        The first σ, world units. If σ is estimated, None is the RMS difference per
        coordinate over all pairs, leaving out points more than 20 times as far out as
        their cloud's median point; if scheduled, 0.3 of the target's RMS radius.
    last : float, optional
        The least σ, world units. None is 0.001 of the target's RMS radius if σ is
        estimated, 0.03 if scheduled.
    shrink : float, default 0.9
        The factor by which a scheduled σ shrinks after every step, above 0, at most 1.
    clutter : float, default 0.25
        w, the weight of clutter among the moving points, 0 < w < 1.
    volume : float, optional
        V, the area over which the clutter is spread, u². None is `6 r²`, r the target's
        RMS radius: the square that evenly spread points of that radius fill. CPD's
        convention, with the roles swapped, is M, the number of source points.
    tolerance : float, default 1e-4
        The run stops when a step's RMS motion of the source points is at most this
        fraction of their RMS radius, and σ is at its last value or has changed by at
        most this fraction. With the lattice, an estimated σ within 1 % of the previous
        one counts as equal, and the previous one is kept.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> wide = options.FilterRegOptions(variance="scheduled", last=0.2)
    >>> register(scene.source, scene.target, "filterreg", options=wide).detail("sigma")
    np.float64(0.2)
    """

    filter: str = "lattice"
    variance: str = "estimated"
    first: float | None = None
    last: float | None = None
    shrink: float = 0.9
    clutter: float = 0.25
    volume: float | None = None
    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        validate.one_of(self.filter, kernel_filters.KINDS, "filter")
        validate.one_of(self.variance, VARIANCES, "variance")
        validate.widths(self.first, self.last)
        if self.volume is not None:
            validate.number(self.volume, "volume", 1e-100, 1e100)
        if not 0.0 < validate.number(self.shrink, "shrink") <= 1.0:
            raise ValueError(f"shrink: expected a factor above 0, up to 1, got {self.shrink!r}")
        if not 0.0 < validate.number(self.clutter, "clutter") < 1.0:
            raise ValueError(f"clutter: expected a weight above 0 and below 1, got {self.clutter!r}")
        validate.number(self.tolerance, "tolerance", 0.0)


@dataclass(frozen=True, eq=False)
class FilterRegState:
    """A pose, σ, and the filter's results there.

    volume: (b,) V, u². sigma: (b,) world units, last: (b,) its least. filters: (b,) of `kernel_filters.Filter`. moved:
    (b, m, 2) x. mass: (b, m) m⁰. targets: (b, m, 2) μ, or the point itself if no component is within the filter's
    reach. spread: (b, m) m²/m⁰ − ‖μ‖², the variance of the components about the target, both coordinates together.
    weights: (b, m) W. twist: (b, 3) of the last step, (v, ω) about the weighted centroid; world units and radians.
    condition: (b,) of its system. change: (b,) how far it moved the points, root mean square, over their RMS radius
    `radius`.
    """

    problem: Problem = field(metadata=CONSTANT)
    radius: FloatArray = field(metadata=CONSTANT)
    last: FloatArray = field(metadata=CONSTANT)
    volume: FloatArray = field(metadata=CONSTANT)
    options: FilterRegOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    sigma: FloatArray
    filters: AnyArray
    moved: FloatArray
    mass: FloatArray
    targets: FloatArray
    spread: FloatArray
    weights: FloatArray
    twist: FloatArray
    condition: FloatArray
    change: FloatArray

    __repr__ = brief


def _start(problem: Problem, options: FilterRegOptions) -> FilterRegState:
    b, m, _ = problem.source.shape
    size, pose = typical_radius(problem.target), Pose.trusted(problem.start.R, problem.start.t)
    scheduled = options.variance == "scheduled"
    with np.errstate(over="ignore", under="ignore"):
        moved = pose.apply(problem.source)
        if options.first is not None:
            first = np.full(b, options.first)
        else:
            first = 0.3 * size if scheduled else pair_width(moved, problem.target)
        last = (0.03 if scheduled else 1e-3) * size if options.last is None else np.full(b, options.last)
        if options.first is not None and options.last is None:
            last = np.minimum(last, first)
        last = np.maximum(last, kernel_filters.least_sigma(problem.target))
    volume = spread_volume(problem.target) if options.volume is None else np.full(b, options.volume)
    zeros = np.zeros((b, m))
    state = FilterRegState(
        problem=problem, radius=rms_radius(problem.source), last=last, volume=volume, options=options, pose=pose,
        objective=np.zeros(b), status=statuses((b,)), reason=reasons((b,)), sigma=np.zeros(b),
        filters=np.empty(b, dtype=object), moved=moved, mass=zeros, targets=moved, spread=zeros, weights=zeros,
        twist=np.zeros((b, 3)), condition=np.full(b, np.inf), change=np.full(b, np.inf),
    )  # fmt: skip
    return _ask(state, pose, _within(first, last))


def _within(sigma: FloatArray, last: FloatArray) -> FloatArray:
    # Keep σ in a range in which squares can still be summed.
    return np.clip(np.where(np.isfinite(sigma), sigma, last), last, np.maximum(last, 1e149))


def _ask(state: FilterRegState, pose: Pose, sigma: FloatArray) -> FilterRegState:
    """The state at another pose and σ: rebuild the filters where σ has changed, and query them; degenerate if no
    weight is left.
    """
    problem, options = state.problem, state.options
    n, m = problem.target.shape[1], problem.source.shape[1]
    filters = state.filters.copy()
    other = np.flatnonzero(sigma != state.sigma)
    filters[other] = kernel_filters.build_each(options.filter, problem.target[other], sigma[other])
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        moved = pose.apply(problem.source)
        sums = kernel_filters.query_each(filters.tolist(), moved)
        mass = sums.mass
        has_mass = mass > 0.0
        total = np.where(has_mass, mass, 1.0)
        mean = sums.first / total[..., None]
        centre = np.stack([f.centre for f in filters])[:, None]
        spread = sums.second / total - np.square(mean).sum(axis=2)
        targets = np.where(has_mass[..., None], centre + mean, moved)
        c = np.clip(clutter_constant(options.clutter, n, state.volume, 2, sigma), 1e-300, 1e300)[:, None]
        weights = mass / (mass + c)
        # −Σ_i log p(x_i), p(x_i) = (1 − w)/N (2πσ²)^{−d/2} (m⁰ + c)
        scale = np.log(n / (1.0 - options.clutter)) + np.log(2.0 * np.pi) + 2.0 * np.log(sigma)
        objective = m * scale - np.log(mass + c).sum(axis=1)
        real = has_mass & (spread > 0.0) & np.isfinite(spread)
    empty: BoolArray = weights.sum(axis=1) <= 1e-12 * m
    status, reason = mark(state.status, state.reason, empty, Status.DEGENERATE, _NOTHING)
    return changed(
        state, pose=pose, objective=objective, status=status, reason=reason, sigma=sigma, filters=filters, moved=moved,
        mass=mass, targets=targets, spread=np.where(real, spread, 0.0), weights=weights,
    )  # fmt: skip


def _step(state: FilterRegState) -> FilterRegState:
    options, W = state.options, state.weights
    b, m, d = state.moved.shape
    share = W / W.sum(axis=1, keepdims=True)
    centre = (share[:, None] @ state.moved)[:, 0]
    identity = np.broadcast_to(np.eye(d), (b, m, d, d))
    system = gauss_newton.system(state.moved, state.targets, identity, W, centre, state.radius)
    xi = gauss_newton.solve(system)
    pose = gauss_newton.apply(xi, system, state.pose)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        moved = pose.apply(state.problem.source)
        step = moved - state.moved
        change = rms_motion(step) / state.radius
        if options.variance == "scheduled":
            sigma = _within(state.sigma * options.shrink, state.last)
        else:
            # ‖x‖² − 2 x·μ + m²/m⁰ = ‖x − μ‖² + (m²/m⁰ − ‖μ‖²), without the cancellation
            squares = np.square(moved - state.targets).sum(axis=2) + state.spread
            estimate = _within(np.sqrt((share * squares).sum(axis=1) / d), state.last)
            same = np.abs(estimate - state.sigma) <= _RESOLVED.get(options.filter, 0.0) * state.sigma
            sigma = np.where(same, state.sigma, estimate)
        still = np.abs(sigma - state.sigma) <= options.tolerance * state.sigma
    after = _ask(state, pose, sigma)
    rest = (change <= options.tolerance) & still
    free = system.free.any(axis=1)
    status, reason = after.status, after.reason
    for i in np.flatnonzero(rest & free):
        words = gauss_newton.freedom(system, int(i))
        status, reason = mark(status, reason, np.arange(b) == i, Status.DEGENERATE, words)
    status, reason = mark(status, reason, rest, Status.CONVERGED, "pose and σ have come to rest")
    twist = np.concatenate([xi[:, :d], xi[:, d:] / state.radius[:, None]], axis=1)
    return changed(after, status=status, reason=reason, twist=twist, condition=system.condition, change=change)


FILTERREG = Method(
    name="filterreg",
    summary="the fixed points as a Gaussian mixture, queried through a filter; the moving ones take twist steps",
    source="Gao & Tedrake 2019",
    start=_start,
    step=_step,
    options=FilterRegOptions,
    max_steps=200,
)
