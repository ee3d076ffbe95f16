"""Generalised ICP.

Nearest points, each pair weighted by the surfaces that its two points are assumed to
lie on.

With covariances Σ_p of the source point and Σ_q of the target point, the pair's
precision is `(Σ_q + R Σ_p Rᵀ)⁻¹`. The canonical surface covariance is `tangent` along
the surface and the smaller `normal` across it, `Σ = tangent (I − n nᵀ) + normal n nᵀ`,
with n from the point's neighbourhood; a point without a normal gets `tangent I`, as
wide in every direction as a surface is along itself. These covariances model where a
point's partner may lie; they are not a measured uncertainty, and a bad normal does not
widen them. A source point of weight 0 is in no pair but is still a neighbour of others:
points that lie on no surface are better left out of the cloud.

The precision is frozen within one Gauss-Newton step and re-evaluated after it. Two
limits hold exactly, and are tested: equal isotropic covariances give the Gauss-Newton
step of point-to-point ICP (not Kabsch's closed form, with which it shares only the
fixed points); `Σ_p = 0` and `Σ_q = ε n nᵀ + τ (I − n nᵀ)` tend to point-to-plane as τ →
∞. The canonical covariances with ε → 0 do not: where the two normals differ, some
precision remains along the tangent.

Difference: one Gauss-Newton step per pairing, where the paper minimises to convergence.

References
----------
.. [1] A. Segal, D. Haehnel, S. Thrun, "Generalized-ICP", 2009.
   doi:10.15607/RSS.2009.V.021
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core import validate
from solvers.core.arrays import FloatArray
from solvers.core.method import Method, Problem
from solvers.geometry import nearest
from solvers.geometry.normals import Normals, normals
from solvers.methods.icp import surface_icp
from solvers.methods.icp.icp import partners
from solvers.methods.icp.surface_icp import SurfaceOptions, SurfaceState


@dataclass(frozen=True)
class GicpOptions(SurfaceOptions):
    """Options of `gicp`.

    A common factor of the two variances changes the objective but not the steps. A run
    that cycles through the same poses, to `tolerance`, has stalled.

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
    tangent : float, default 1.0
        The variance along the surface, squared world units.
    normal : float, default 0.01
        The variance across it, squared world units, 1e-9 to 1e9 times `tangent`.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register
    >>> from solvers.scenes import room
    >>> scene = room("clean")
    >>> flat = options.GicpOptions(gate=2.6, normal=0.01)
    >>> register(scene.source, scene.target, "gicp", options=flat).status.name
    'CONVERGED'
    """

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
    """The state at the starting pose, with the canonical covariances of both clouds."""
    index = nearest.build(problem.target)
    surface = normals(index, options.neighbours, options.roundness)
    own = normals(nearest.build(problem.source), options.neighbours, options.roundness)
    of_source = surface_covariances(own, options.tangent, options.normal)
    of_target = surface_covariances(surface, options.tangent, options.normal)
    return surface_icp.start(problem, options, index, surface, (of_source, of_target))


GICP = Method(
    name="gicp",
    summary="nearest points, each pair weighed by the surfaces of both clouds, one Gauss-Newton step at a time",
    source="Segal, Haehnel & Thrun 2009",
    start=start,
    step=surface_icp.step,
    partners=partners,
    options=GicpOptions,
    weighted=True,
    dims=(2, 3),
)
