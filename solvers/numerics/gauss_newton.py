"""One Gauss-Newton step on fixed pairs, each with its own precision matrix, and the
directions that the pairs do not determine.

For pairs (x, q), x the moved point, the cost is `Σ w (x − q)ᵀ M (x − q)`. M = I gives
point to point, `n nᵀ` point to plane (the residual `nᵀ(x − q)`, squared), and an inverse
covariance GICP. A small motion about the cloud's centre c takes x to
`x + v + ω × (x − c)`, so with K the generator of rotations at x − c, `J = [I, K/ρ]`:

    H ξ = −g,   H = Σ w Jᵀ M J / Σ w,   g = Σ w Jᵀ M (x − q) / Σ w,   ξ = (v, ρω).

All of ξ is in world units because the angle is multiplied by ρ, the cloud's RMS radius;
with c at the cloud's own centre, the eigenvalues of H depend neither on units nor on the
origin. Otherwise its condition number would: a room moved by 100 u would seem a million
times harder. The step turns by exactly ω, about c, and then moves by v.

A direction is free if its eigenvalue is below a fraction of the largest: the pairs say
nothing about it, and the step leaves it alone (the least-norm solution) instead of
following rounding.

Sources: Chen & Medioni 1992 (point to plane); Low 2004, Linear least-squares
optimization for point-to-plane ICP surface registration (the linear system); Gelfand et
al. 2003, Geometrically stable sampling for the ICP algorithm (the eigenvectors of H as
slides, centred and scaled); Zhang, Kaess & Singh 2016, On degeneracy of
optimization-based state estimation problems (the solution kept out of the weak
directions).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.amounts import place
from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.brief import brief
from solvers.core.pose import Pose
from solvers.core.rotations import planar, spatial
from solvers.geometry.spectral import symmetric_eigen


@dataclass(frozen=True, eq=False)
class System:
    """The normal equations of b problems at a pose; p = 3 unknowns in the plane, 6 in
    space: v, then ρω.

    information: (b, p, p) H. gradient: (b, p) g. eigenvalues: (b, p) of H, smallest
    first, and directions: (b, p, p) its unit eigenvectors, one per column: the first is
    the weak direction. condition: (b,) the largest eigenvalue over the smallest,
    infinite if that is not positive. free: (b, p) which directions the pairs do not
    determine. centre: (b, d) and radius: (b,) ρ are what ξ refers to: a point x moves by
    `v + ω × (x − centre)`.
    """

    information: FloatArray
    gradient: FloatArray
    eigenvalues: FloatArray
    directions: FloatArray
    condition: FloatArray
    free: BoolArray
    centre: FloatArray
    radius: FloatArray

    __repr__ = brief


def system(
    moved: FloatArray,
    partners: FloatArray,
    precision: FloatArray,
    weights: FloatArray,
    centre: FloatArray,
    radius: FloatArray,
    free_below: float = 1e-6,
) -> System:
    """The normal equations of the pairs moved, partners (b, m, d) with precisions (b,
    m, d, d), weights (b, m), about the centre (b, d) and with the RMS radius (b,) of
    the moved cloud. free_below: the fraction of the largest eigenvalue below which a
    direction is free. Without any weight all directions are free.
    """
    b, m, d = moved.shape
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        used = weights > 0.0
        share = weights / np.maximum(weights.max(axis=1, keepdims=True), np.finfo(np.float64).tiny)
        share = share / np.maximum(share.sum(axis=1, keepdims=True), 1.0)
        J = jacobian(moved - centre[:, None], radius)
        # Rows of zero weight may lie anywhere, even where squares overflow.
        MJ = np.where(used[..., None, None], share[..., None, None] * (precision @ J), 0.0)
        J = np.where(used[..., None, None], J, 0.0)
        left = np.where(used[..., None], moved - partners, 0.0)
        flat = MJ.reshape(b, m * d, -1)
        H = J.reshape(b, m * d, -1).swapaxes(1, 2) @ flat
        g = (left.reshape(b, 1, m * d) @ flat)[:, 0]
        H = 0.5 * (H + H.swapaxes(1, 2))
        values, vectors = symmetric_eigen(H)
        low, high = values[:, 0], values[:, -1]
        condition = np.where(low > 0.0, high / np.where(low > 0.0, low, 1.0), np.inf)
        free = ~(values > np.maximum(free_below * high, 0.0)[:, None])
    return System(H, g, values, vectors, np.where(np.isnan(condition), np.inf, condition), free, centre, radius)


def jacobian(lever: FloatArray, radius: FloatArray) -> FloatArray:
    """`[I, K/ρ]`, (b, m, d, p), at the levers x − c (b, m, d); d is 2 or 3."""
    b, m, d = lever.shape
    J = np.zeros((b, m, d, d * (d + 1) // 2))
    for k in range(d):
        J[..., k, k] = 1.0
    arm = lever / radius[:, None, None]
    if d == 2:
        J[..., 0, 2], J[..., 1, 2] = -arm[..., 1], arm[..., 0]
        return J
    for k in range(3):
        # ω × a has in row k the entries ω_i a_j − ω_j a_i, (i, j) following k.
        i, j = (k + 1) % 3, (k + 2) % 3
        J[..., k, 3 + i], J[..., k, 3 + j] = arm[..., j], -arm[..., i]
    return J


def solve(system: System, max_shift: float = np.inf, max_turn: float = np.inf) -> FloatArray:
    """The step ξ (b, p) outside the free directions, shortened as a whole if ‖v‖ exceeds
    `max_shift` (world units) or ‖ω‖ exceeds `max_turn` (radians): one factor for both,
    since capping each by itself would bend the step.
    """
    d = system.centre.shape[1]
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        along = (system.gradient[:, None] @ system.directions)[:, 0]
        along = np.where(system.free, 0.0, along / np.where(system.free, 1.0, system.eigenvalues))
        xi = -(system.directions @ along[..., None])[..., 0]
        shift = np.linalg.norm(xi[:, :d], axis=1) / max_shift
        turn = np.linalg.norm(xi[:, d:], axis=1) / system.radius / max_turn
        capped: FloatArray = xi / np.maximum(1.0, np.maximum(shift, turn))[:, None]
    return capped


def apply(xi: FloatArray, system: System, pose: Pose) -> Pose:
    """The poses (b,) after the motion ξ: turned by ω about the system's centre, then
    moved by v; the scale is kept.
    """
    d = pose.dim
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        turn = rotation(xi[:, d:] / system.radius[:, None])
        t = system.centre + turned(turn, pose.t - system.centre) + xi[:, :d]
    return Pose.trusted(turn @ pose.R, t, pose.scale)


def turned(R: FloatArray, v: FloatArray) -> FloatArray:
    """R v for matrices (b, d, d) and one vector each, (b, d). Its rounding does not depend
    on the batch, while that of a matrix product with one column may.
    """
    product: FloatArray = (R * v[:, None, :]).sum(axis=-1)
    return product


def rotation(omega: FloatArray) -> FloatArray:
    """The rotation by ω: angle (..., 1) in the plane, rotation vector (..., 3) in
    space; radians. (..., d, d).
    """
    return planar(omega[..., 0]) if omega.shape[-1] == 1 else spatial(omega)


def freedom(system: System, i: int) -> str:
    """What problem i's pairs leave free, in words; empty if they determine the pose."""
    count = int(system.free[i].sum())
    p, d = system.gradient.shape[1], system.centre.shape[1]
    if count == 0:
        return ""
    if count == p:
        return "the pairs determine no direction of motion"
    if count > 1:
        return f"the pairs leave {count} of {p} directions of motion free"
    v, a = system.directions[i, :d, 0], system.directions[i, d:, 0]
    # A turn about a point ten radii away looks like a slide.
    if np.linalg.norm(a) < 0.1:
        direction = ", ".join(f"{x:.2f}" for x in v / np.linalg.norm(v))
        return f"the pairs leave the slide along ({direction}) free"
    if d == 2:
        # The twist's fixed point: v + ω J (x − c) = 0.
        omega = a[0] / system.radius[i]
        x = system.centre[i] + np.array([-v[1], v[0]]) / omega
        return f"the pairs leave the turn about {place(x, system.radius[i])} free"
    direction = ", ".join(f"{x:.2f}" for x in a / np.linalg.norm(a))
    return f"the pairs leave a turn about the direction ({direction}) free"
