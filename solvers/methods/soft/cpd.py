"""Coherent point drift, rigid and similarity: the moved points are the centres of a
Gaussian mixture that explains the fixed cloud, fitted by expectation and maximisation.

Here Y, of M points, moves and X, of N points, stays fixed: the fixed points are the
observations, the moving points the components. With one standard deviation σ for all
components and a uniform part of weight w for clutter, the responsibility of component m
for observation n is

    P_mn = exp(−‖x_n − T(y_m)‖² / 2σ²) / (Σ_k exp(−‖x_n − T(y_k)‖² / 2σ²) + c),
    c = (2πσ²)^{d/2} w M / ((1 − w) V),

V the volume over which the clutter is spread, uᵈ: `volume`, or by default that of the
square (or cube) in which evenly spread points have the fixed cloud's RMS radius r,
`V = (√(12/d) r)ᵈ`. That is a choice of this package, which makes the result independent
of the unit. The paper writes 1/N for the density, which is `volume=len(target)` for
clouds of unit variance.

One step maximises for the current responsibilities, then computes those at the new
pose, so a state's pose, σ, responsibilities and objective belong together. With
`N_P = Σ P_mn`, the stages of a step (`STAGES`) are

1. responsibilities: P as above, at the state's pose and σ
2. centring: μ_x = Σ P_mn x_n / N_P, μ_y = Σ P_mn y_m / N_P
3. rotation: H = Σ P_mn ỹ_m x̃_nᵀ = U Λ Vᵀ, R = V D Uᵀ
4. translation and scale: s = tr(ΛD) / Σ P_mn ‖ỹ_m‖² (or 1), t = μ_x − s R μ_y
5. variance: σ² = Σ P_mn ‖x_n − T(y_m)‖² / (N_P d), floored

The objective is the negative log-likelihood of the fixed cloud under mixture and
clutter. It never rises: each step is an exact EM step; σ need not fall at every step.
The variance is summed from residuals, never from the difference of traces
`tr(X̃ᵀ d(Pᵀ1) X̃) − …`, which falls below zero on clean data. The sums run over blocks
of the fixed points; P is stored only by `responsibilities`, for figures.

Left out: the affine and non-rigid forms and the fast Gauss transform.

References
----------
.. [1] A. Myronenko, X. Song, "Point set registration: coherent point drift", 2010, fig.
   2 (the rigid algorithm, which has a scale). doi:10.1109/TPAMI.2010.46
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.geometry.rigid import best_rotation
from solvers.numerics import gaussians
from solvers.numerics.fits import clutter_constant, pair_width, rms_radius, spread_volume, typical_radius

STAGES = ("responsibilities", "centring", "rotation", "translation and scale", "variance")
"""The stages of a step, in order, as named in a walkthrough."""

FLOOR = 1e-6
"""The smallest σ, as a fraction of the fixed cloud's RMS radius."""

_EPS = float(np.finfo(np.float64).eps)
_NOTHING = "the clutter explains every fixed point: no responsibility is left"


@dataclass(frozen=True)
class CpdOptions:
    """Options of `cpd-rigid` and `cpd-similarity`.

    Parameters
    ----------
    clutter : float, default 0.1
        The weight w of the uniform part, 0 ≤ w < 1.
    volume : float, optional
        The volume V over which it is spread, in uᵈ. None is `(√(12/d) r)ᵈ`, r the
        target's RMS radius: the square or cube that evenly spread points of that radius
        fill. The paper's convention is the number of target points.
    sigma : float, optional
        The first σ, world units. None takes it from all distances,
        `√(Σ_mn ‖x_n − T y_m‖² / M N d)`, leaving out strays, points more than 20 times
        as far out as the median point.
    tolerance : float, default 1e-5
        The run stops when a step's RMS motion of the moving points is at most this
        fraction of their RMS radius and σ changes by at most this fraction.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> print(register(scene.source, scene.target, "cpd-rigid", options=options.CpdOptions(clutter=0.3)).status)
    converged
    """

    clutter: float = 0.1
    volume: float | None = None
    sigma: float | None = None
    tolerance: float = 1e-5

    def __post_init__(self) -> None:
        if not 0.0 <= validate.number(self.clutter, "clutter") < 1.0:
            raise ValueError(f"clutter: expected a weight from 0 to below 1, got {self.clutter!r}")
        for name, value in (("volume", self.volume), ("sigma", self.sigma)):
            if value is not None:
                validate.number(value, name, 1e-100, 1e100)
        validate.number(self.tolerance, "tolerance", 0.0)


@dataclass(frozen=True, eq=False)
class Frame:
    """Both clouds about their centres and in a common unit, a power of two, in which no coordinate at the start
    exceeds one, so that neither huge nor tiny clouds leave the range of float64.

    moving (b, m, d), fixed (b, n, d), centre_moving and centre_fixed (b, d), unit (b,). lifted (b, m, 1 + d): 1 and
    the moving points, so that one product gives all moments. radius (b,): RMS radius of the moving cloud, in the unit.
    blur (b,): rounding error of the input coordinates, in the unit. floor (b,): the smallest σ, in the unit.
    """

    moving: FloatArray
    lifted: FloatArray
    fixed: FloatArray
    centre_moving: FloatArray
    centre_fixed: FloatArray
    unit: FloatArray
    radius: FloatArray
    blur: FloatArray
    floor: FloatArray

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class CpdState:
    """A pose, σ, and the sums of the responsibilities at them; the objective is the negative log-likelihood there.

    sigma: (b,) world units. mass: (b,) N_P. row: (b, n) Σ_m P_mn, how much of each fixed point is explained by the
    moving points rather than by clutter. change: (b,) how far the last step moved the points, root mean square, over
    their RMS radius. The rest is in the units of `frame`: t of the pose, σ, the moved points, `moments` (b, 1 + d, m)
    Σ_n P_mn and Σ_n P_mn x_n, and `scatter` (b,) Σ P_mn ‖x_n − T y_m‖².
    """

    problem: Problem = field(metadata=CONSTANT)
    frame: Frame = field(metadata=CONSTANT)
    clutter: FloatArray = field(metadata=CONSTANT)  # (b,) c / σᵈ, σ in the frame's unit
    scaled: bool = field(metadata=SHARED)
    options: CpdOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    sigma: FloatArray
    mass: FloatArray
    row: FloatArray
    change: FloatArray
    width: FloatArray  # σ in the frame's unit
    shift: FloatArray  # (b, d) t in the frame
    moved: FloatArray  # (b, m, d)
    moments: FloatArray
    scatter: FloatArray

    __repr__ = brief

    @property
    def column(self) -> FloatArray:
        """(b, m) Σ_n P_mn, how much each moving point explains."""
        return self.moments[:, 0]


def _frame(problem: Problem) -> Frame:
    centre_p, centre_q = (0.5 * c.min(axis=1) + 0.5 * c.max(axis=1) for c in (problem.source, problem.target))
    p, q = problem.source - centre_p[:, None], problem.target - centre_q[:, None]
    start = problem.start.apply(problem.source) - centre_q[:, None]
    sizes = [np.abs(c).max(axis=(1, 2)) for c in (p, q, start)]
    exponent = np.frexp(np.maximum.reduce(sizes))[1]
    p, q = (np.ldexp(c, -exponent[:, None, None]) for c in (p, q))
    largest = [np.abs(c).max(axis=(1, 2)) for c in (problem.source, problem.target)]
    blur = np.ldexp(np.maximum(*largest) * 8.0 * _EPS, -exponent)
    floor = np.maximum(FLOOR * typical_radius(q), 1e-12)
    return Frame(p, gaussians.powers(p), q, centre_p, centre_q, np.ldexp(1.0, exponent), rms_radius(p), blur, floor)


def _start(problem: Problem, options: CpdOptions, scaled: bool) -> CpdState:
    b, m, d = problem.source.shape
    n = problem.target.shape[1]
    with np.errstate(over="ignore", under="ignore"):
        frame = _frame(problem)
        start = problem.start
        arm = (start.R @ frame.centre_moving[..., None])[..., 0] * np.asarray(start.scale)[:, None]
        shift = (arm + start.t - frame.centre_fixed) / frame.unit[:, None]
        moved = Pose.trusted(start.R, shift, start.scale).apply(frame.moving)
        width = pair_width(moved, frame.fixed) if options.sigma is None else options.sigma / frame.unit
        # The volume, also in the frame's unit.
        option = options.volume
        with np.errstate(divide="ignore", over="ignore"):  # values out of float64's range are clipped
            volume = spread_volume(frame.fixed) if option is None else np.clip(option / frame.unit**d, 1e-300, 1e300)
        c = clutter_constant(options.clutter, m, volume, d)
    nothing = np.zeros(b)
    state = CpdState(
        problem=problem, frame=frame, clutter=c, scaled=scaled, options=options,
        pose=start, objective=nothing, status=statuses((b,)), reason=reasons((b,)), sigma=nothing, mass=nothing,
        row=np.zeros((b, n)), change=np.full(b, np.inf), width=nothing, shift=shift, moved=moved,
        moments=np.zeros((b, 1 + d, m)), scatter=nothing,
    )  # fmt: skip
    state = _expect(state, start, shift, moved, np.maximum(width, frame.floor), state.change)
    status, reason = mark(state.status, state.reason, _empty(state), Status.DEGENERATE, _NOTHING)
    return changed(state, status=status, reason=reason)


def _expect(
    state: CpdState, pose: Pose, shift: FloatArray, moved: FloatArray, width: FloatArray, change: FloatArray
) -> CpdState:
    """The state at another pose and σ, with the sums of its responsibilities and its likelihood (the E-step)."""
    frame = state.frame
    n, d = frame.fixed.shape[1:]
    with np.errstate(over="ignore", under="ignore"):
        sigma = width * frame.unit
        c = np.minimum(state.clutter * width**d, 1e300)
        P = gaussians.shares(frame.fixed, moved, width, c)
        # −Σ_n log p(x_n), p(x_n) = (1 − w)/M (2πσ²)^{−d/2} (Σ_m exp(…) + c)
        per_point = np.log(moved.shape[1] / (1.0 - state.options.clutter)) + 0.5 * d * np.log(2.0 * np.pi)
        objective = n * (per_point + d * (np.log(width) + np.log(frame.unit))) - P.log_sum
    return changed(
        state, pose=pose, objective=objective, sigma=sigma, mass=P.moments[:, 0].sum(axis=1), row=P.row,
        change=change, width=width, shift=shift, moved=moved, moments=P.moments, scatter=P.scatter,
    )  # fmt: skip


def _empty(state: CpdState) -> BoolArray:
    empty: BoolArray = state.mass <= 1e-12 * state.row.shape[1]
    return empty


@dataclass(frozen=True, eq=False)
class _Maximum:
    """The result of the M-step, in the frame's units; `free` where the rotation is undetermined and kept."""

    mean_moving: FloatArray
    mean_fixed: FloatArray
    H: FloatArray
    R: FloatArray
    scale: FloatArray
    turn: FloatArray  # (b, d, d) scale times R
    shift: FloatArray
    moved: FloatArray
    step: FloatArray
    width: FloatArray
    free: BoolArray


def _maximise(state: CpdState) -> _Maximum:
    frame, moments, mass = state.frame, state.moments, state.mass
    # Σ P_mn (1, x_n)ᵀ (1, y_m): no coordinate exceeds 1, so centring afterwards loses no more than the rounding that
    # `free` allows for.
    whole = moments @ frame.lifted
    means = whole / mass[:, None, None]
    mean_x, mean_y = means[:, 1:, 0], means[:, 0, 1:]
    H = (whole[:, 1:, 1:] - mean_x[:, :, None] * whole[:, :1, 1:]).swapaxes(1, 2)
    R, trace, gap = best_rotation(H)
    free = gap <= 8.0 * (_EPS + frame.blur) * mass
    scale = np.ones(len(gap))
    if state.scaled:
        centred = frame.moving - mean_y[:, None]
        spread = np.vecdot(moments[:, 0], np.vecdot(centred, centred))
        scale = trace / np.where(free, 1.0, spread)
    if free.any():
        R = np.where(free[:, None, None], state.pose.R, R)
        scale = np.where(free, state.pose.scale if state.scaled else 1.0, scale)
    turn = scale[:, None, None] * R
    shift = mean_x - (turn @ mean_y[..., None])[..., 0]
    moved = frame.moving @ turn.swapaxes(1, 2) + shift[:, None]
    # Σ P ‖x − z'‖² from Σ P ‖x − z‖², z' = z + δ: nothing here is larger than a
    # residual.
    step = moved - state.moved
    column, first = moments[:, 0, :, None], moments[:, 1:].swapaxes(1, 2)
    cross = column * step - 2.0 * (first - column * state.moved)
    cross *= step
    width = np.sqrt(np.maximum(state.scatter + _total(cross), 0.0) / (mass * step.shape[2]))
    return _Maximum(mean_y, mean_x, H, R, scale, turn, shift, moved, step, np.maximum(width, frame.floor), free)


def _total(x: FloatArray) -> FloatArray:
    """The sums over points and coordinates, (b,)."""
    total: FloatArray = x.reshape(len(x), -1).sum(axis=1)
    return total


def _step(state: CpdState) -> CpdState:
    frame, options = state.frame, state.options
    with np.errstate(over="ignore", under="ignore"):
        to = _maximise(state)
        arm = (to.turn @ frame.centre_moving[..., None])[..., 0]
        t = frame.centre_fixed + to.shift * frame.unit[:, None] - arm
        change = np.sqrt(_total(np.square(to.step)) / to.step.shape[1]) / frame.radius
    rest = (change <= options.tolerance) & (np.abs(to.width - state.width) <= options.tolerance * state.width)
    state = _expect(state, Pose.trusted(to.R, t, to.scale), to.shift, to.moved, to.width, change)
    empty = _empty(state)
    if not (rest | empty).any():
        return state
    status, reason = mark(state.status, state.reason, empty, Status.DEGENERATE, _NOTHING)
    for i in np.flatnonzero(rest & to.free):
        status, reason = mark(status, reason, np.arange(len(rest)) == i, Status.DEGENERATE, _why(state, int(i)))
    least = rest & (to.width <= frame.floor)
    status, reason = mark(status, reason, least, Status.CONVERGED, "the pose has come to rest, σ at its floor")
    status, reason = mark(status, reason, rest, Status.CONVERGED, "pose and σ have come to rest")
    return changed(state, status=status, reason=reason)


def _why(state: CpdState, i: int) -> str:
    """Why the rotation of problem i is undefined, in words."""
    frame = state.frame
    for name, cloud in (("source", frame.moving[i]), ("target", frame.fixed[i])):
        spans = np.linalg.svd(cloud - cloud.mean(axis=0), compute_uv=False)
        if spans[0] <= 8.0 * frame.blur[i] * np.sqrt(len(cloud)):
            return f"all {name} points are equal: the rotation is undefined"
        if spans.size > 2 and spans[1] <= 1e-7 * spans[0]:
            return f"the {name} points are collinear: the rotation about their line is free"
    return "the soft targets fit several rotations equally well: the rotation is undefined"


def responsibilities(state: CpdState, i: int = 0) -> FloatArray:
    """P (m, n) of problem i, moving points in rows; what a column lacks of 1 is clutter's share."""
    frame = state.frame
    with np.errstate(over="ignore", under="ignore"):
        c = min(float(state.clutter[i] * state.width[i] ** frame.fixed.shape[2]), 1e300)
    return gaussians.share_matrix(frame.fixed[i], state.moved[i], float(state.width[i]), c).T


@dataclass(frozen=True, eq=False)
class Stages:
    """The stages of one step of one problem, in world units; the fields follow `STAGES`.

    responsibilities (m, n). mean_moving, mean_fixed (d,); centred_moving (m, d),
    centred_fixed (n, d). correlation H, rotation (d, d). translation (d,).
    """

    responsibilities: FloatArray
    mean_moving: FloatArray
    mean_fixed: FloatArray
    centred_moving: FloatArray
    centred_fixed: FloatArray
    correlation: FloatArray
    rotation: FloatArray
    scale: float
    translation: FloatArray
    sigma_before: float
    sigma: float


def stages(state: CpdState, i: int = 0) -> Stages:
    """The stages of the next step of problem i, from the same functions that perform it."""
    frame, problem, after = state.frame, state.problem, _step(state)
    to = _maximise(state)
    unit = frame.unit[i]
    mean_moving = frame.centre_moving[i] + unit * to.mean_moving[i]
    mean_fixed = frame.centre_fixed[i] + unit * to.mean_fixed[i]
    return Stages(
        responsibilities=responsibilities(state, i), mean_moving=mean_moving, mean_fixed=mean_fixed,
        centred_moving=problem.source[i] - mean_moving, centred_fixed=problem.target[i] - mean_fixed,
        correlation=unit * (unit * to.H[i]), rotation=to.R[i], scale=float(to.scale[i]),
        translation=after.pose.t[i], sigma_before=float(state.sigma[i]), sigma=float(after.sigma[i]),
    )  # fmt: skip


def _start_rigid(problem: Problem, options: CpdOptions) -> CpdState:
    return _start(problem, options, scaled=False)


def _start_similarity(problem: Problem, options: CpdOptions) -> CpdState:
    return _start(problem, options, scaled=True)


def _method(name: str, summary: str, start: Callable[[Problem, Any], CpdState]) -> Method[CpdState]:
    source = "Myronenko & Song 2010"
    return Method(
        name, summary, source, start, _step, CpdOptions, scaled=start is _start_similarity, dims=None, max_steps=200,
        any_extent=True,
    )  # fmt: skip


RIGID = _method(
    "cpd-rigid", "the moving points as a Gaussian mixture that explains the fixed ones, moved rigidly by EM",
    _start_rigid,
)  # fmt: skip
SIMILARITY = _method(
    "cpd-similarity", "the moving points as a Gaussian mixture that explains the fixed ones, moved and scaled by EM",
    _start_similarity,
)  # fmt: skip
