"""The derivative of MMD-Reg's optimum by the points: the implicit derivative, and the full Hessian that it needs.

In the plane, with θ = (t_x, t_y, φ), `T(p) = R(φ) p + t`, `F(θ; X, Y) = ½ ‖r‖²` and r
the residual of `mmd.mmd`, an isolated optimum has `∇_θ F = 0`, and by the implicit
function theorem it follows the data by

    ∂θ*/∂data = −[∇²_θ F]⁻¹ ∇²_{θ, data} F.

The Hessian is the full one, `∇²F = JᵀJ + Σ_k r_k ∇²r_k`: partly overlapping clouds leave a residual at the optimum,
and JᵀJ alone then gives a wrong derivative. In complex form, with `r_k = (mean e^{iω_kᵀq} − mean e^{iω_kᵀy})/√D`,

    ∂_a∂_b r_k = mean [iω_kᵀ∂_a∂_b q − (ω_kᵀ∂_a q)(ω_kᵀ∂_b q)] e^{iω_kᵀq} / √D,
    ∂_a∂_b F = Re Σ_k (∂_b r̄_k ∂_a r_k + r̄_k ∂_a∂_b r_k).

There is no such derivative where the Hessian is singular (a circle's rotation) and no accurate one where it is nearly
so; at a saddle or off the optimum the formula means something else. All these cases are refused, with the reason in
words.

Source: the implicit function theorem (e.g. Krantz & Parks 2002, ch. 1), as
differentiable solvers use it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.extent import at_one_place
from solvers.core.pose import Pose
from solvers.methods.mmd.landscape import one_cloud

ComplexArray: TypeAlias = NDArray[np.complex128]

STATIONARY = 1e-6
"""How far a Newton step from the pose may move the source points, as a fraction of their RMS radius, for the pose to
count as the optimum."""
WORST_CONDITION = 1e8
"""The largest condition number, in units that make the parameters comparable, for which a derivative is returned."""


@dataclass(frozen=True, eq=False)
class Derivatives:
    """F, its gradient (3,) and its full Hessian (3, 3) in θ = (t_x, t_y, φ): world units and radians, φ about the
    world's origin. gauss_newton: (3, 3) JᵀJ, the Hessian's approximation in a Gauss-Newton step.
    """

    value: float
    gradient: FloatArray
    hessian: FloatArray
    gauss_newton: FloatArray


@dataclass(frozen=True, eq=False)
class ImplicitDerivative:
    """by_source: (3, m, 2), by_target: (3, n, 2), how θ* = (t_x, t_y, φ) moves with
    each coordinate of each point; both None where refused. reason: why it was refused,
    else empty. condition: of the Hessian, with translations and turns about the moved
    centroid made comparable by the RMS radius. at: the objective's derivatives at the
    pose.
    """

    by_source: FloatArray | None
    by_target: FloatArray | None
    reason: str
    condition: float
    at: Derivatives


@dataclass(frozen=True, eq=False)
class _Parts:
    """The terms of the sums. E: (m, D) e^{iω_kᵀq}; along: (3, m, D) ω_kᵀ∂_a q; radial: (m, D) ω_kᵀR p; r: (D,) the
    complex residual; first: (3, D) its ∂_a; the factor 1/√D is in r and first.
    """

    R: FloatArray
    frequencies: FloatArray
    E: ComplexArray
    along: FloatArray
    radial: FloatArray
    r: ComplexArray
    first: ComplexArray


def derivatives(pose: Pose, source: ArrayLike, target: ArrayLike, frequencies: ArrayLike) -> Derivatives:
    """F and its derivatives at a planar pose.

    source: (m, 2), target: (n, 2), frequencies: (D, 2) in radians per unit
    (`MmdState.frequencies / ℓ`). Raises ValueError for anything but planar clouds and a planar pose.
    """
    p, q, w = _checked(pose, source, target, frequencies)
    return _derivatives(_parts(pose, p, q, w))


def implicit_derivative(
    pose: Pose, source: ArrayLike, target: ArrayLike, frequencies: ArrayLike
) -> ImplicitDerivative:
    """How the optimum `pose` moves with the points of both clouds; arguments and errors
    as in `derivatives`.

    Refused with a reason where the pose is not the optimum (a Newton step would move
    the points by more than `STATIONARY`), where the Hessian is not positive definite,
    and where its condition exceeds `WORST_CONDITION`.
    """
    p, q, w = _checked(pose, source, target, frequencies)
    parts = _parts(pose, p, q, w)
    at = _derivatives(parts)
    # Comparable parameters: u = S θ, with the turn about the moved centroid and times the RMS radius.
    centre = pose.apply(p).mean(axis=0)
    spread = float(np.sqrt(np.mean(np.sum((p - p.mean(axis=0)) ** 2, axis=1))))
    radius = spread if spread > 0.0 else 1.0
    arm = centre - pose.t
    to_theta = np.eye(3)
    to_theta[:, 2] = np.array([arm[1], -arm[0], 1.0]) / radius
    values = np.linalg.eigvalsh(to_theta.T @ at.hessian @ to_theta)
    low, high = float(values[0]), float(np.abs(values).max())
    condition = high / abs(low) if low != 0.0 else np.inf

    def refused(reason: str) -> ImplicitDerivative:
        return ImplicitDerivative(None, None, reason, condition, at)

    if at_one_place(p):
        return refused("all source points are equal: the rotation is undefined")
    if not condition <= WORST_CONDITION:
        return refused(f"the Hessian is near singular (condition {condition:.1e}): the optimum is not isolated")
    if low < 0.0:
        return refused("the Hessian is not positive definite: the pose is a saddle or a maximum, no optimum")
    newton = np.linalg.solve(at.hessian, -at.gradient)
    step_length = float(np.linalg.norm(np.linalg.solve(to_theta, newton)))
    if step_length > STATIONARY * radius:
        return refused(f"the pose is not the optimum: a Newton step would still move the points by {step_length:.1e} u")

    m, n, D = len(p), len(q), len(w)
    rotated_w = w @ parts.R  # ω_kᵀ R e_j, (D, 2)
    # ∂_a r times ∂_x r plus r times ∂_a ∂_x r, (3, m, 2), the sum over frequencies written as a product.
    left = np.conj(parts.first)[:, None, :] * (1j * parts.E)
    left = left - np.conj(parts.r) * parts.along * parts.E
    by_source = np.real(left @ rotated_w) / (m * np.sqrt(D))
    spun = w @ (np.array([[0.0, -1.0], [1.0, 0.0]]) @ parts.R)  # ω_kᵀ ∂_φ R e_j
    by_source[2] += np.real((np.conj(parts.r) * 1j * parts.E) @ spun) / (m * np.sqrt(D))
    target_waves = np.exp(1j * (q @ w.T))
    by_target = -np.real((np.conj(parts.first)[:, None, :] * (1j * target_waves)) @ w) / (n * np.sqrt(D))
    solve = -np.linalg.inv(at.hessian)
    return ImplicitDerivative(
        np.einsum("ab,bmd->amd", solve, by_source), np.einsum("ab,bnd->and", solve, by_target), "", condition, at
    )


def _checked(
    pose: Pose, source: ArrayLike, target: ArrayLike, frequencies: ArrayLike
) -> tuple[FloatArray, FloatArray, FloatArray]:
    p, q, w = one_cloud(source, "source"), one_cloud(target, "target"), one_cloud(frequencies, "frequencies")
    if validate.pose(pose, 2, "pose").batch:
        raise ValueError(f"pose: expected a single pose, got a batch of {pose.batch}")
    return p, q, w


def _parts(pose: Pose, p: FloatArray, q: FloatArray, w: FloatArray) -> _Parts:
    turned = p @ pose.R.T
    E = np.exp(1j * ((turned + pose.t) @ w.T))
    ones = np.ones((len(p), 1))
    spin = np.column_stack([-turned[:, 1], turned[:, 0]])  # ∂_φ q
    along = np.stack([ones * w[:, 0], ones * w[:, 1], spin @ w.T])
    root = np.sqrt(len(w))
    r = (E.mean(axis=0) - np.exp(1j * (q @ w.T)).mean(axis=0)) / root
    first = (1j * along * E).mean(axis=1) / root
    return _Parts(pose.R, w, E, along, turned @ w.T, r, first)


def _derivatives(parts: _Parts) -> Derivatives:
    r, first, E, along, w = parts.r, parts.first, parts.E, parts.along, parts.frequencies
    root = np.sqrt(len(w))
    gauss_newton = np.real(np.conj(first) @ first.T)
    second = -np.einsum("amk,bmk,mk->abk", along, along, E) / (len(E) * root)
    second[2, 2] -= (1j * parts.radial * E).mean(axis=0) / root  # ∂_φ∂_φ q = −R p
    hessian = gauss_newton + np.real(second @ np.conj(r))
    return Derivatives(0.5 * float(np.real(np.vdot(r, r))), np.real(first @ np.conj(r)), hessian, gauss_newton)
