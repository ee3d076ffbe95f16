"""Distribution-to-distribution NDT.

Each cloud becomes a map, and the two maps are registered cell by cell.

The score of `ndt.d2d_score`, climbed as in `ndt.ndt`. Once the maps are built the
points are no longer needed, so the cost of a step depends on the number of cells, not
of points. The uncertainty of the moving side counts, too.

References
----------
.. [1] T. Stoyanov, M. Magnusson, H. Andreasson, A. J. Lilienthal, "Fast and accurate
   scan registration through minimization of the distance between compact 3D NDT
   representations", 2012. doi:10.1177/0278364912460895
"""

from __future__ import annotations

from dataclasses import dataclass

from solvers.core.method import Method, Problem
from solvers.methods.ndt import ndt, ndt_map
from solvers.methods.ndt.ndt import NdtOptions, NdtState


@dataclass(frozen=True)
class D2dOptions(NdtOptions):
    """Options of `ndt-d2d`.

    Parameters
    ----------
    cells : float or sequence of float, optional
        One cell size or several, of both clouds, coarse to fine, world units. None is
        twice the target's `ndt_map.default_size`, then that.
    grids : int, default 1
        The number of the target's grids, 1 or 4; the source has one.
    offset : sequence of two floats, default (0.0, 0.0)
        A corner of the target's first grid, world units; the source's grid has a corner
        at its own origin. If either cloud is shifted, the run may end at another pose,
        except for the target with `offset=target.min(axis=0)`.
    max_shift : float, optional
        The longest step, world units. None is half the first cell size.
    max_turn : float, default 0.2
        The largest turn in a step, radians.
    halvings : int, default 4
        How many times a step is halved before the level ends.
    tolerance : float, default 1e-4
        A level also ends when a step's RMS motion of the source points is at most about
        this fraction of their RMS radius: converged if the full Newton step was that
        short, stalled if only its halvings were.
    outliers : float, optional
        The share of outliers, above 0 and below 1, that widens every Gaussian by one
        factor (`ndt.mixture`). None leaves them unchanged, which is the limit of a
        share of one.

    Raises
    ------
    ValueError
        If an option is out of its range.

    Examples
    --------
    >>> from solvers import options, register, scenes
    >>> scene = scenes.room("clean")
    >>> result = register(scene.source, scene.target, "ndt-d2d", options=options.D2dOptions(cells=[1.6, 0.8]))
    >>> result.detail("level")  # the last of the two
    np.int64(1)
    """

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
