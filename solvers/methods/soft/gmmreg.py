"""GMMReg: the L2 distance between two Gaussian mixtures.

One component per point; the distance is minimised while the width shrinks.

With every point a Gaussian of covariance σ² I and uniform weights, the squared L2
distance of the two densities is, in closed form,

    E(T) = ∫ (f_T − g)² = (4πσ²)^{−d/2} (k_xx / M² − 2 k_xy / MN + k_yy / N²),
    k_xy = Σ_ij exp(−‖T p_i − q_j‖² / 4σ²),

so it is a squared maximum mean discrepancy under the Gaussian kernel of length ℓ = √2
σ, up to the factor in front: no association, no expectation step. A rigid motion leaves
k_xx unchanged. A step is a Newton step with gradient and Hessian in closed form,
damped, capped at one ℓ and shortened until E falls. In units of ℓ, with u_ij = x_i −
q_j, `J_i = [I, K/ρ]` (`solvers.numerics.gauss_newton`), and k = K_ij, the gradient of
−k_xy is `Σ k J_iᵀ u_ij` and its Hessian `Σ k (J_iᵀ J_i − J_iᵀ u_ij u_ijᵀ J_i)`, plus
`−Σ k u_ij·(x_i − c)/ρ²` in the angle's entry.

When a stage has come to rest, σ shrinks and E becomes a different function; within a
stage it never rises. Left out: unequal weights and covariances, and the non-rigid
forms. Planar.

References
----------
.. [1] B. Jian, B. C. Vemuri, "Robust point set registration using Gaussian mixture
   models", 2011 (the L2 distance, its gradient, annealing; they minimise by a
   quasi-Newton method). doi:10.1109/TPAMI.2010.223
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray, ReasonArray, StatusArray
from solvers.core.brief import brief
from solvers.core.extent import at_one_place
from solvers.core.method import Method, Problem
from solvers.core.pose import Pose
from solvers.core.rotations import planar
from solvers.core.status import Status, mark, reasons, statuses
from solvers.core.tree import CONSTANT, SHARED, changed, put, take
from solvers.numerics import gauss_newton, gaussians, newton
from solvers.numerics.fits import rms_motion, typical_radius, typical_weights, weighted_centroid, weighted_radius

_HALVINGS = 12
_FINEST = 1e-6  # of the clouds' extent: with a smaller σ no points of the two clouds would interact


@dataclass(frozen=True)
class GmmRegOptions:
    """Options of `gmmreg`.

    A stage also ends when no step lowers E.

    Parameters
    ----------
    first : float, optional
        The first σ, world units. None is 0.4 of the target's RMS radius, or of the
        source's if all target points are equal.
    last : float, optional
        The last σ, world units. None is 0.05 of that radius.
    shrink : float, default 0.5
        The factor by which σ shrinks after every stage, above 0 and below 1.
    coarse : float, default 1e-2
        A stage before the last ends when a step's RMS motion of the source points is at
        most this fraction of their RMS radius.
    tolerance : float, default 1e-6
        The same fraction for the last stage.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> register(scene.source, scene.target, "gmmreg", options=options.GmmRegOptions(last=0.2)).detail("sigma")
    np.float64(0.2)
    """

    first: float | None = None
    last: float | None = None
    shrink: float = 0.5
    coarse: float = 1e-2
    tolerance: float = 1e-6

    def __post_init__(self) -> None:
        validate.widths(self.first, self.last)
        if not 0.0 < validate.number(self.shrink, "shrink") < 1.0:
            raise ValueError(f"shrink: expected a factor above 0 and below 1, got {self.shrink!r}")
        validate.number(self.coarse, "coarse", 0.0)
        validate.number(self.tolerance, "tolerance", 0.0)


@dataclass(frozen=True, eq=False)
class GmmRegState:
    """A pose, σ, and E there (the objective, in 1/u²).

    sigma: (b,) world units, last: (b,) its last value. moved: (b, m, 2). overlap: (b, m) Σ_j K_ij / N, how much of the
    fixed mixture each moving point meets. own: (b,) k_xx / M² + k_yy / N² at σ. gradient: (b, 3) and hessian: (b, 3, 3)
    of −k_xy / MN in ξ = (v, ρω), world units, about the moved cloud's centroid; damping: (b,) λ of the last step.
    change: (b,) how far it moved the points, root mean square, over their RMS radius `radius`. Strays count neither for
    that centroid nor for `change` and `radius`: their weight in `near`, (b, m), is 0.
    """

    problem: Problem = field(metadata=CONSTANT)
    near: FloatArray = field(metadata=CONSTANT)
    radius: FloatArray = field(metadata=CONSTANT)
    last: FloatArray = field(metadata=CONSTANT)
    options: GmmRegOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    sigma: FloatArray
    moved: FloatArray
    overlap: FloatArray
    own: FloatArray
    gradient: FloatArray
    hessian: FloatArray
    damping: FloatArray
    change: FloatArray

    __repr__ = brief


def _start(problem: Problem, options: GmmRegOptions) -> GmmRegState:
    b, m, _ = problem.source.shape
    near, pose = typical_weights(problem.source), Pose.trusted(problem.start.R, problem.start.t)
    radius = weighted_radius(problem.source, near)
    size = np.where(at_one_place(problem.target), radius, typical_radius(problem.target))
    extent = np.maximum(*(np.ptp(c, axis=1).max(axis=1) for c in (problem.source, problem.target)))
    least = np.clip(_FINEST * extent, 1e-140, 1e140)
    first, last = (
        np.clip(share * size if width is None else np.full(b, width), least, 1e149)
        for width, share in ((options.first, 0.4), (options.last, 0.05))
    )
    if options.last is None:
        last = np.minimum(last, first)
    zeros = np.zeros(b)
    state = GmmRegState(
        problem=problem, near=near, radius=radius, last=last, options=options, pose=pose, objective=zeros,
        status=statuses((b,)), reason=reasons((b,)), sigma=first, moved=problem.source, overlap=np.zeros((b, m)),
        own=zeros, gradient=np.zeros((b, 3)), hessian=np.zeros((b, 3, 3)), damping=zeros,
        change=np.full(b, np.inf),
    )  # fmt: skip
    state = _at(_at_width(state, np.maximum(first, last)), pose)
    out_of_reach: BoolArray = state.overlap.max(axis=1) <= 1e-200
    status, reason = mark(
        state.status, state.reason, out_of_reach, Status.DEGENERATE, "no kernel reaches from one cloud to the other"
    )
    return changed(state, status=status, reason=reason)


def _at_width(state: GmmRegState, sigma: FloatArray) -> GmmRegState:
    """The state with another σ, updating only the terms that do not depend on the pose."""
    own = np.zeros(len(sigma))
    for cloud in (state.problem.source, state.problem.target):
        ones = np.ones((*cloud.shape[:2], 1))
        own += gaussians.sums(cloud, cloud, np.sqrt(2.0) * sigma, ones)[..., 0].mean(axis=1) / cloud.shape[1]
    return changed(state, sigma=sigma, own=own)


def _at(state: GmmRegState, pose: Pose) -> GmmRegState:
    """The state at another pose: E, its gradient and its Hessian from the moments of
    the kernel.
    """
    q = state.problem.target
    b, n, d = q.shape
    m = state.moved.shape[1]
    # If the source is a point compared with ℓ, the curvature by the turn is not finite, and no step is taken along it.
    with np.errstate(all="ignore"):
        ell = np.sqrt(2.0) * state.sigma
        moved = pose.apply(state.problem.source)
        # In units of ℓ about the target's mean, so that the moments of differences lose no digits to a distant origin.
        centre = q.mean(axis=1, keepdims=True)
        x, y = (moved - centre) / ell[:, None, None], (q - centre) / ell[:, None, None]
        near = gaussians.sums(x, y, np.ones(b), gaussians.powers(y, 2)) / n
        k, ky = near[..., 0], near[..., 1 : d + 1]
        kyy = near[..., d + 1 :].reshape(b, m, d, d)
        ku = k[..., None] * x - ky
        cross = ky[..., :, None] * x[..., None, :]
        kuu = k[..., None, None] * (x[..., :, None] * x[..., None, :]) - cross - cross.swapaxes(2, 3) + kyy
        arm = x - weighted_centroid(x, state.near)[:, None]
        rho = state.radius / ell
        J = gauss_newton.jacobian(arm, rho)
        gradient = np.einsum("bmdp,bmd->bp", J, ku) / m
        KJ = k[..., None, None] * J - kuu @ J
        hessian = np.einsum("bmdp,bmdq->bpq", J, KJ) / m
        hessian[:, 2, 2] -= (ku * arm).sum(axis=(1, 2)) / (m * rho**2)
        factor = 1.0 / (2.0 * np.pi) / ell / ell
        # Rounding may leave a zero distance just below zero.
        objective = np.maximum(factor * (state.own - 2.0 * k.mean(axis=1)), 0.0)
        gradient, hessian = gradient / ell[:, None], hessian / ell[:, None, None] / ell[:, None, None]
    return changed(
        state, pose=pose, objective=objective, moved=moved, overlap=k, gradient=gradient, hessian=hessian
    )


def moved_by(state: GmmRegState, xi: FloatArray) -> Pose:
    """The state's poses after ξ = (v, ρω), (b, 3): turned by ω about the moved cloud's centroid, then shifted by v."""
    turn = planar(xi[:, 2] / state.radius)
    centre = weighted_centroid(state.moved, state.near)
    t = centre + (turn @ (state.pose.t - centre)[..., None])[..., 0] + xi[:, :2]
    return Pose.trusted(turn @ state.pose.R, t)


def _step(state: GmmRegState) -> GmmRegState:
    options, ell = state.options, np.sqrt(2.0) * state.sigma
    # In units of ℓ again, so that the Hessian is of order one unless it has overflowed.
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        g, H = state.gradient * ell[:, None], state.hessian * ell[:, None, None] * ell[:, None, None]
    xi, damping = newton.damped_step(g, H)
    xi = newton.capped(xi, (np.linalg.norm(xi[:, :2], axis=1), np.abs(xi[:, 2]))) * ell[:, None]
    whole = np.linalg.norm(xi, axis=1) / state.radius
    after, pending = state, np.ones(len(ell), dtype=np.bool_)
    for _ in range(_HALVINGS):
        rows = np.flatnonzero(pending)
        part = take(state, rows)
        trial = _at(part, moved_by(part, xi[rows]))
        better = trial.overlap.mean(axis=1) > part.overlap.mean(axis=1)
        after = put(after, rows[better], take(trial, better))
        pending[rows[better]] = False
        if not pending.any():
            break
        xi = 0.5 * xi
    with np.errstate(over="ignore", under="ignore"):
        step = after.moved - state.moved
        change = rms_motion(step, state.near) / state.radius
    final = state.sigma <= state.last
    limit = np.where(final, options.tolerance, max(options.coarse, options.tolerance))
    rest = change <= limit
    after = changed(after, damping=damping, change=change)

    flat: BoolArray = (state.hessian == 0.0).all(axis=(1, 2)) & final
    status, reason = mark(after.status, after.reason, flat, Status.DEGENERATE, "no direction of motion changes E")
    # At a minimum the Newton step is small, and rounding decides whether E still falls.
    settled = rest & (~pending | (whole <= limit))
    status, reason = mark(status, reason, settled & final, Status.CONVERGED, "the pose has come to rest at the last σ")
    status, reason = mark(status, reason, rest & final, Status.STALLED, "no step lowers E")
    after = changed(after, status=status, reason=reason)
    next_stage = np.flatnonzero(rest & ~final)
    if next_stage.size:
        part = take(after, next_stage)
        part = _at(_at_width(part, np.maximum(options.shrink * part.sigma, part.last)), part.pose)
        after = put(after, next_stage, part)
    return after


GMMREG = Method(
    name="gmmreg",
    summary="the L2 distance between two Gaussian mixtures, minimised by damped Newton steps while the width shrinks",
    source="Jian & Vemuri 2011",
    start=_start,
    step=_step,
    options=GmmRegOptions,
)
