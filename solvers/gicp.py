"""Generalised ICP: nearest points, each pair weighed by the surfaces that both its points are taken to lie on.

With covariances Σ_p of the source point and Σ_q of the target point the pair's precision is `(Σ_q + R Σ_p Rᵀ)⁻¹`. The
canonical surface covariance is `tangent` along the surface and the smaller `normal` across it,
`Σ = tangent (I − n nᵀ) + normal n nᵀ`, with n from the point's neighbourhood; a point without a normal gets
`tangent I`: as wide in every direction as a surface is along itself. These are a model of what a point's partner may
be, not a measured uncertainty, and a bad normal does not widen them.

The precision is frozen within one Gauss-Newton step and evaluated anew after it. Two limits hold exactly, and are
tests: equal isotropic covariances give point to point's Gauss-Newton step (not Kabsch's closed form, with which it
shares its fixed points only); `Σ_p = 0` and `Σ_q = ε n nᵀ + τ (I − n nᵀ)` tend to point to plane as τ → ∞. The
canonical covariances with ε → 0 do not: where the two normals differ, precision is left along the tangent.

Source: Segal, Haehnel & Thrun 2009, Generalized-ICP. Different: one Gauss-Newton step for each pairing, where the paper
minimises to the end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers import nearest, surface_icp, validate
from solvers.arrays import FloatArray
from solvers.normals import Normals, normals
from solvers.stepper import Method, Problem
from solvers.surface_icp import SurfaceOptions, SurfaceState


@dataclass(frozen=True)
class GicpOptions(SurfaceOptions):
    """tangent, normal: the variances along the surface and across it, squared world units, both above 0 and within
    1e-9 to 1e9 of each other; their common scale changes the objective and not the steps. The others as in
    `solvers.surface_icp.SurfaceOptions`."""

    tangent: float = 1.0
    normal: float = 0.01

    def __post_init__(self) -> None:
        super().__post_init__()
        validate.number(self.tangent, "tangent", 1e-100, 1e100)
        validate.number(self.normal, "normal", 1e-9 * self.tangent, 1e9 * self.tangent)


def surface_covariances(surface: Normals, tangent: float, normal: float) -> FloatArray:
    """The canonical covariances (b, n, d, d) of points with these normals."""
    n = surface.vectors
    return tangent * np.eye(n.shape[-1]) + (normal - tangent) * (n[..., :, None] * n[..., None, :])


def start(problem: Problem, options: GicpOptions) -> SurfaceState:
    """The pairs at the starting pose, with the canonical covariances of both clouds."""
    index = nearest.build(problem.target)
    surface = normals(index, options.neighbours, options.roundness)
    own = normals(nearest.build(problem.source), options.neighbours, options.roundness)
    covariances = tuple(surface_covariances(x, options.tangent, options.normal) for x in (own, surface))
    return surface_icp.start(problem, options, index, surface, (covariances[0], covariances[1]))


GICP = Method(
    name="gicp",
    summary="nearest points, each pair weighed by the surfaces of both clouds, one Gauss-Newton step at a time",
    source="Segal, Haehnel & Thrun 2009",
    start=start,
    step=surface_icp.step,
    options=GicpOptions,
    weighted=True,
    dims=(2, 3),
)
