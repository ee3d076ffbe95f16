"""Distribution-to-distribution NDT: a map of both clouds, registered to each other cell by cell.

The score of `solvers.ndt_d2d_score`, climbed as in `solvers.ndt`. The points are left behind once the maps stand, so a
step costs what the cells cost, however many points they summarise; and the moving side's uncertainty counts, too.

Source: Stoyanov, Magnusson, Andreasson & Lilienthal 2012, Fast and accurate scan registration through minimization of
the distance between compact 3D NDT representations.
"""

from __future__ import annotations

from dataclasses import dataclass

from solvers import ndt, ndt_map
from solvers.ndt import NdtOptions, NdtState
from solvers.stepper import Method, Problem


@dataclass(frozen=True)
class D2dOptions(NdtOptions):
    """As `solvers.ndt.NdtOptions`; grids: of the target, the source has one. offset: of the target's grid; the source's
    has a corner at its own origin. cells: of both clouds."""

    grids: int = 1


def _start(problem: Problem, options: D2dOptions) -> NdtState:
    sources = tuple(ndt_map.build(problem.source, h) for h in ndt.levels(problem, options))
    return ndt.start(problem, options, sources)


D2D = Method(
    name="ndt-d2d",
    summary="Gaussians in the cells of both clouds, every pair of them a term, climbed by damped Newton steps",
    source="Stoyanov et al. 2012",
    start=_start,
    step=ndt.step,
    options=D2dOptions,
)
