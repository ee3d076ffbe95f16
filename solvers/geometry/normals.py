"""Surface normals: the direction in which a point's neighbourhood is thinnest, if there
is one.

For every point the covariance `C = Σ (x − x̄)(x − x̄)ᵀ / (k + 1)` of itself and its k
nearest others has eigenvalues `λ₁ ≤ … ≤ λ_d`; the normal is the eigenvector of λ₁. It
is well defined only if λ₁ and λ₂ are far apart: a neighbourhood of coincident points has
no meaningful eigenvector, one on a line in space a whole circle of normals, and one that
is as thick as it is wide any normal at all. Those are flagged, and no normal is guessed
for them.

Sources: Hoppe et al. 1992, Surface reconstruction from unorganized points (the
covariance's eigenvector; left out: the consistent orientation, which no method here
needs); Chen & Medioni 1992, Object modelling by registration of multiple range images.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from solvers.core import validate
from solvers.core.arrays import BoolArray, FloatArray
from solvers.core.brief import brief
from solvers.core.extent import ROUNDING
from solvers.core.tree import once
from solvers.geometry.nearest import Index
from solvers.geometry.spectral import symmetric_eigen

NEIGHBOURS = 6
"""The default number of neighbours, not counting the point itself."""

ROUNDNESS = 0.9
"""The default λ₁/λ₂ from which a neighbourhood has no normal: its direction would be the noise's, not the surface's."""



@dataclass(frozen=True, eq=False)
class Normals:
    """The normals of b clouds.

    vectors: (b, n, d) unit, of either sign, the largest component positive; zero where
    flagged. flagged: (b, n) where the neighbourhood is degenerate and has no normal.
    eigenvalues: (b, n, d) of the neighbourhood's covariance, smallest first, in squared
    world units.
    """

    vectors: FloatArray
    flagged: BoolArray
    eigenvalues: FloatArray

    __repr__ = brief


def normals(index: Index, k: int = NEIGHBOURS, roundness: float = ROUNDNESS) -> Normals:
    """The normals of the clouds (b, n, d) of an index, each from a point and its k
    nearest others (all, if fewer).

    roundness: λ₁/λ₂ from which a neighbourhood is flagged, above 0 to 1. It is also
    flagged if λ₂ is no more than rounding. Raises ValueError for k below 1 and for a
    roundness outside its range.
    """
    validate.count(k, "k", 1)
    if not 0.0 < validate.number(roundness, "roundness") <= 1.0:
        raise ValueError(f"roundness: expected a ratio above 0, up to 1, got {roundness!r}")
    return once(partial(_estimate, k=k, roundness=roundness), index)


def _estimate(index: Index, k: int, roundness: float) -> Normals:
    points = index.points
    n = points.shape[1]
    rows, _ = index.nearest_k(points, min(k + 1, n))
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        near = points[np.arange(len(points))[:, None, None], rows]
        # Divided by the cloud's size (a power of two: nothing is rounded), so that no
        # square overflows or underflows.
        unit = np.frexp(index.extent)[1][:, None, None]
        near = np.ldexp(near, -unit[..., None])
        centred = near - near.mean(axis=2, keepdims=True)
        covariance = centred.swapaxes(-1, -2) @ centred / near.shape[2]
        values, vectors = symmetric_eigen(covariance)
        # Coordinates are known to half a unit in the last place of the largest: a
        # spread below a few of these counts as none.
        blur = np.square(ROUNDING * np.abs(near).max(axis=(2, 3)))
        none = (values[..., 1] <= np.maximum(blur, ROUNDING * values[..., -1])) | (
            values[..., 0] >= roundness * values[..., 1]
        )
        values = np.ldexp(np.maximum(values, 0.0), 2 * unit)
    return Normals(np.where(none[..., None], 0.0, vectors[..., 0]), none, values)
