"""Point to plane: the distance to the surface through the nearest target point.

The residual `r_i = n_jᵀ (R p_i + t − q_j)`, n_j the target's normal at q_j, is blind to
sliding along the surface. That removes the spurious pull of a point's accidental
partner along a wall, and it leaves free what the surface does not determine: with one
straight wall, the slide along it; with a circle, the turn about its centre; with a
plane in space, two slides and the turn about its normal. The system's condition number
and weak direction show this, and a run that comes to rest with a free direction is
degenerate.

Each step is one Gauss-Newton step on the linearised residuals
(`solvers.numerics.gauss_newton`, with the precision `n nᵀ`), about the cloud's centre,
with the angle scaled by its RMS radius. Pairs whose target point has no normal are not
used.

References
----------
.. [1] Y. Chen, G. Medioni, "Object modelling by registration of multiple range images",
   1992 (the residual; they intersect the source's normal with the surface instead of
   taking nearest points). doi:10.1016/0262-8856(92)90066-C
.. [2] K.-L. Low, "Linear least-squares optimization for point-to-plane ICP surface
   registration", 2004 (the linearised system).
"""

from __future__ import annotations

from solvers.core.method import Method, Problem
from solvers.geometry import nearest
from solvers.geometry.normals import normals
from solvers.methods.icp import surface_icp
from solvers.methods.icp.icp import partners
from solvers.methods.icp.surface_icp import SurfaceOptions, SurfaceState


def _start(problem: Problem, options: SurfaceOptions) -> SurfaceState:
    index = nearest.build(problem.target)
    surface = normals(index, options.neighbours, options.roundness)
    return surface_icp.start(problem, options, index, surface, None)


POINT_TO_PLANE = Method(
    name="point-to-plane",
    summary="nearest points, their distances measured along the target's normals, one Gauss-Newton step at a time",
    source="Chen & Medioni 1992",
    start=_start,
    step=surface_icp.step,
    partners=partners,
    options=SurfaceOptions,
    weighted=True,
    dims=(2, 3),
)
