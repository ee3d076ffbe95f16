"""ICP that knows surfaces.

Pairs of nearest points, a precision matrix for each pair, one Gauss-Newton step,
repeat.

The common part of `icp.point_to_plane` and `icp.gicp`, which differ only in the precision matrices. One step solves
for the pairs of the state (`solvers.numerics.gauss_newton`) and pairs again at the new pose (`icp.pair`: gate, trim,
robust weight by Euclidean distance), so a state's pose, pairs, precisions and objective belong together:

    objective = Σ w_i (x_i − q_i)ᵀ M_i (x_i − q_i)    over the pairs used.

It may rise: a Gauss-Newton step is not an exact minimisation, and the pairs are nearest in a different metric from the
residual's. Robust weights are functions of the pair's distance, not of the residual that is squared, so this is not the
iteratively reweighted minimisation of any one loss; their scale is a heuristic, and a gate that suits one residual need
not suit another. Since no quantity is bound to fall, a run may cycle for ever through a few sets of pairs. Such a cycle
is detected (`solvers.numerics.recurrence`) and reported as stalled.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.extent import at_one_place
from solvers.core.method import Problem
from solvers.core.pose import Pose
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed
from solvers.geometry import nearest, normals
from solvers.geometry.nearest import Index, Known
from solvers.geometry.normals import Normals
from solvers.methods.icp import icp
from solvers.methods.icp.icp import Pairing
from solvers.methods.icp.options import IcpOptions
from solvers.numerics import gauss_newton, recurrence, robust
from solvers.numerics.fits import rms_motion, weighted_centroid, weighted_radius
from solvers.numerics.gauss_newton import System

ONE_PARTNER = (
    "every source point has the same partner: nothing but the directions of surfaces holds the rotation; are both "
    "clouds in one unit?"
)
"""The reason given when pairs weighted by two surfaces have come to rest without determining the pose."""


@dataclass(frozen=True)
class SurfaceOptions:
    """Options of `point-to-plane`.

    A run that cycles through the same poses, to `tolerance`, has stalled.

    Parameters
    ----------
    gate : float, default inf
        Pairs farther apart are not used, world units.
    trim : float, default 0.0
        The fraction of the gated pairs to leave out, farthest first, 0 to below 1.
    weight : str, default "none"
        A kernel of `solvers.numerics.robust`: "none", "huber", "tukey", "welsch" or
        "geman-mcclure", of the pair's distance.
    tuning : float, optional
        The kernel's constant. None takes the usual one. It and `scale` have no effect
        if `weight` is "none".
    scale : float, optional
        The kernel's scale s, world units. None takes it from the median distance of the
        pairs used, afresh at every step, and never below 3e-4 of the target's RMS
        radius.
    neighbours : int, default 6
        How many other points make up a point's neighbourhood.
    roundness : float, default 0.9
        λ₁/λ₂ at or above which a neighbourhood has no normal.
    max_shift : float, default inf
        The longest step, world units.
    max_turn : float, default 0.5
        The largest turn in a step, radians.
    free_below : float, default 1e-6
        The fraction of the system's largest eigenvalue below which a direction of
        motion counts as free.
    tolerance : float, default 1e-6
        The run stops when a step's RMS motion of the source points in use is at most
        this fraction of their RMS radius.
    rms_tolerance : float, default 1e-6
        The run also stops when the number of pairs used is unchanged and the RMS of
        their residuals has changed by at most this fraction.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> gated = options.SurfaceOptions(gate=2.6, neighbours=8)
    >>> gated.pairing().gate
    2.6
    >>> register(scene.source, scene.target, "point-to-plane", options=gated).status.name
    'CONVERGED'
    """

    gate: float = np.inf
    trim: float = 0.0
    weight: str = "none"
    tuning: float | None = None
    scale: float | None = None
    neighbours: int = normals.NEIGHBOURS
    roundness: float = normals.ROUNDNESS
    max_shift: float = np.inf
    max_turn: float = 0.5
    free_below: float = 1e-6
    tolerance: float = 1e-6
    rms_tolerance: float = 1e-6

    def __post_init__(self) -> None:
        self.pairing()
        robust.check_options(self.weight, self.tuning, self.scale)
        validate.count(self.neighbours, "neighbours", 1)
        validate.number(self.roundness, "roundness", 1e-100, 1.0)
        for name, value in (("max_shift", self.max_shift), ("max_turn", self.max_turn)):
            if not validate.reach(value, name) > 0.0:
                raise ValueError(f"{name}: expected a positive number, got {value!r}")
        validate.number(self.free_below, "free_below", 0.0, 1.0)

    def pairing(self) -> IcpOptions:
        """The options for pairing points."""
        return IcpOptions(
            self.gate, self.trim, self.weight, self.tuning, self.scale, self.tolerance, self.rms_tolerance
        )


@dataclass(frozen=True, eq=False)
class SurfaceState:
    """A pose, the pairs at it, their precisions, and the system that the next step
    solves.

    normals: of the target. covariances: of source (b, m, d, d) and target (b, n, d, d) points, if the method has any.
    scale: (b,) the fixed s of the robust weight, or None. pairing: its `rms` and `objective` are those of this module's
    residuals; pairs whose target point has no normal are not used if the method needs one. precision: (b, m, d, d) of
    the pairs, at `pose`. system: the normal equations of these pairs at `pose`, with the condition number and the weak
    direction. change: (b,) as in `icp.IcpState`. taken: (b,) steps. anchor: (b, m, d) the moved points of an earlier
    step, to detect cycles.
    """

    problem: Problem = field(metadata=CONSTANT)
    index: Index = field(metadata=CONSTANT)
    normals: Normals = field(metadata=CONSTANT)
    covariances: tuple[FloatArray, FloatArray] | None = field(metadata=CONSTANT)
    scale: FloatArray | None = field(metadata=CONSTANT)
    options: SurfaceOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    pairing: Pairing
    precision: FloatArray
    system: System
    change: FloatArray
    taken: IntArray
    anchor: FloatArray

    __repr__ = brief


def start(
    problem: Problem,
    options: SurfaceOptions,
    index: Index,
    surface: Normals,
    covariances: tuple[FloatArray, FloatArray] | None,
) -> SurfaceState:
    """The state at the starting pose; degenerate where no pair can be used."""
    b = problem.size
    scale = None if options.scale is None else np.full(b, options.scale)
    surfaces = _Surfaces(index, surface, covariances)
    pairing, precision, system = _at(problem, options, surfaces, scale, problem.start)
    status, reason = statuses((b,)), reasons((b,))
    if covariances is None:
        none = np.asarray(surface.flagged.all(axis=1))
        status, reason = mark(status, reason, none, Status.DEGENERATE, "no target point has a normal")
    status, reason = mark(status, reason, pairing.count == 0, Status.DEGENERATE, _no_pairs(options))
    return SurfaceState(
        problem=problem, index=index, normals=surface, covariances=covariances, scale=scale, options=options,
        pose=problem.start, objective=pairing.objective, status=status, reason=reason,
        pairing=pairing, precision=precision, system=system, change=np.full(b, np.inf),
        taken=np.zeros(b, dtype=np.int64), anchor=pairing.moved,
    )  # fmt: skip


def step(state: SurfaceState) -> SurfaceState:
    """Solve the system of the current pairs, then pair again."""
    options, old = state.options, state.pairing
    xi = gauss_newton.solve(state.system, options.max_shift, options.max_turn)
    pose = gauss_newton.apply(xi, state.system, state.pose)
    surfaces = _Surfaces(state.index, state.normals, state.covariances)
    pairing, precision, system = _at(state.problem, options, surfaces, state.scale, pose, old.known)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        change = rms_motion(pairing.moved - old.moved, pairing.weights) / system.radius
        again = rms_motion(pairing.moved - state.anchor, pairing.weights) / system.radius <= options.tolerance
        still = np.abs(pairing.rms - old.rms) <= options.rms_tolerance * old.rms
    at_rest = change <= options.tolerance
    steady = still & (pairing.count == old.count) & (options.rms_tolerance > 0.0)
    status, reason = mark(state.status, state.reason, pairing.count == 0, Status.DEGENERATE, _no_pairs(options))
    free = system.free.any(axis=1) & (at_rest | steady)
    for i in np.flatnonzero(free):
        words = gauss_newton.freedom(system, int(i))
        status, reason = mark(status, reason, np.arange(len(free)) == i, Status.DEGENERATE, words)
    ends: BoolArray = at_rest | steady | again
    if ends.any():
        status, reason = mark(status, reason, ends & _one_partner(state, pairing), Status.DEGENERATE, ONE_PARTNER)
    status, reason = mark(status, reason, at_rest, Status.CONVERGED, "the pose has come to rest")
    status, reason = mark(status, reason, steady, Status.CONVERGED, "the RMS has come to rest")
    status, reason = mark(status, reason, again, Status.STALLED, recurrence.AGAIN)
    taken = state.taken + 1
    return changed(
        state, pose=pose, objective=pairing.objective, status=status, reason=reason, pairing=pairing,
        precision=precision, system=system, change=change, taken=taken,
        anchor=recurrence.anchor(taken, pairing.moved, state.anchor),
    )  # fmt: skip


def _one_partner(state: SurfaceState, pairing: Pairing) -> BoolArray:
    """Whether all pairs in use share one target point although the target has others, (b,). Covariances then give the
    system full rank; without them it is the system of one plane, which leaves a direction free.
    """
    if state.covariances is None:
        return np.zeros(state.problem.size, dtype=np.bool_)
    first = np.where(pairing.used, pairing.rows, state.index.points.shape[1]).min(axis=1)
    last = np.where(pairing.used, pairing.rows, -1).max(axis=1)
    return np.asarray((first == last) & (pairing.count > 1) & ~at_one_place(state.index.points))


def precisions(cov_p: FloatArray, cov_q: FloatArray, R: FloatArray) -> FloatArray:
    """`(Σ_q + R Σ_p Rᵀ)⁻¹` of pairs with covariances (b, m, d, d) and rotations (b, d,
    d), (b, m, d, d).
    """
    rotation = R[:, None]
    return _inverse(cov_q + rotation @ cov_p @ rotation.swapaxes(-1, -2))


def _inverse(S: FloatArray) -> FloatArray:
    """The inverses of symmetric positive definite (..., d, d)."""
    if S.shape[-1] != 2:
        return np.asarray(np.linalg.inv(S), dtype=np.float64)
    out = np.empty_like(S)
    out[..., 0, 0], out[..., 1, 1] = S[..., 1, 1], S[..., 0, 0]
    out[..., 0, 1] = out[..., 1, 0] = -S[..., 0, 1]
    out /= (S[..., 0, 0] * S[..., 1, 1] - np.square(S[..., 0, 1]))[..., None, None]
    return out


@dataclass(frozen=True, eq=False)
class _Surfaces:
    """The clouds as surfaces, as in `SurfaceState`: the target's index and normals and, if the method has any, the
    covariances of the source's and the target's points.
    """

    index: Index
    normals: Normals
    covariances: tuple[FloatArray, FloatArray] | None


def _at(
    problem: Problem,
    options: SurfaceOptions,
    surfaces: _Surfaces,
    scale: FloatArray | None,
    pose: Pose,
    known: Known | None = None,
) -> tuple[Pairing, FloatArray, System]:
    """The pairs at a pose, their precisions, and their normal equations."""
    gate = np.full(problem.size, options.gate)
    pairing = icp.pair(problem, surfaces.index, gate, scale, options.pairing(), pose, known)
    partners = nearest.picked(surfaces.index.points, pairing.rows)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        precision, weights = _weighed(surfaces, pairing, pose)
        used = weights > 0.0
        left = np.where(used[..., None], pairing.moved - partners, 0.0)
        squares = np.einsum("bmi,bmij,bmj->bm", left, precision, left)
        squares = np.maximum(squares, 0.0)  # along a tangent, rounding may leave them below zero
        objective = np.where(used, weights * squares, 0.0).sum(axis=1)
        total = weights.sum(axis=1)
        rms = np.sqrt(objective / np.where(total > 0.0, total, 1.0))
        # Over the pairs in use: an unpaired point does not matter, wherever it lies.
        size = np.asarray(pose.scale)
        centre = gauss_newton.turned(pose.R, weighted_centroid(problem.source, weights) * size[:, None]) + pose.t
        radius = weighted_radius(problem.source, weights) * size
    radius = np.where((radius > 0.0) & np.isfinite(radius), radius, 1.0)
    pairing = changed(
        pairing, used=used, weights=weights, count=used.sum(axis=1), rms=rms, objective=objective
    )
    system = gauss_newton.system(
        pairing.moved, partners, precision, weights, centre, radius, options.free_below
    )
    return pairing, precision, system


def _weighed(surfaces: _Surfaces, pairing: Pairing, pose: Pose) -> tuple[FloatArray, FloatArray]:
    """The precisions (b, m, d, d) of pairs, and their weights (b, m): zero where a normal is needed and missing."""
    if surfaces.covariances is not None:
        of_source, of_target = surfaces.covariances
        return precisions(of_source, nearest.picked(of_target, pairing.rows), pose.R), pairing.weights
    n = nearest.picked(surfaces.normals.vectors, pairing.rows)
    flagged = nearest.picked(surfaces.normals.flagged, pairing.rows)
    return n[..., :, None] * n[..., None, :], np.where(flagged, 0.0, pairing.weights)


def _no_pairs(options: SurfaceOptions) -> str:
    if np.isfinite(options.gate):
        return f"no pair that could be used lies within the gate of {options.gate:g} u"
    return "no pair can be used"
