"""Signs by which a registration is judged where no truth is known: overlap, residuals, conditioning, agreement.

None of them is a proof. Points of one scan share what misled a fit, so a wrong pose that lays wall on wall passes them
all; only what comes from elsewhere, such as a motion prediction, can tell (`solvers.metrics.rre` and `rte` against the
predicted pose). The thresholds are the caller's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solvers import gauss_newton, nearest, validate
from solvers.api import register
from solvers.arrays import BoolArray, FloatArray
from solvers.icp import rms_radius
from solvers.normals import normals
from solvers.pose import Pose


@dataclass(frozen=True, eq=False)
class Evidence:
    """What two clouds say of a pose. A point is explained where the target has a point within reach of it.

    explained: (..., m) of the moved source points, and share: (...) how large a fraction they are. rms: (...) of their
    distances to their nearest target points, world units, 0 where there is none. weakest: (...) the smallest eigenvalue
    of their point-to-plane system (`solvers.gauss_newton`) over the largest: 0 where a motion is free.
    """

    explained: BoolArray
    share: FloatArray
    rms: FloatArray
    weakest: FloatArray


def evidence(source: ArrayLike, target: ArrayLike, pose: Pose, reach: float = 0.3) -> Evidence:
    """Judge poses by the clouds alone: source (..., m, 2), target (..., n, 2), poses (...).

    reach: world units, of the order of spacing and noise. Raises ValueError for what is no cloud, for leading axes that
    differ, and for a reach that is not positive.
    """
    p, q = validate.cloud(source, "source", 2), validate.cloud(target, "target", 2)
    validate.number(reach, "reach", 1e-100, 1e100)
    axes = p.shape[:-2]
    if q.shape[:-2] != axes or pose.batch != axes:
        raise ValueError(f"source, target, pose: their leading axes differ: {axes}, {q.shape[:-2]}, {pose.batch}")
    moved = pose.apply(p).reshape(-1, *p.shape[-2:])
    index = nearest.build(q.reshape(-1, *q.shape[-2:]))
    rows, squares = index.nearest(moved)
    explained = nearest.within(squares, reach)
    rms = np.sqrt(np.where(explained, squares, 0.0).sum(axis=1) / np.maximum(explained.sum(axis=1), 1))
    surface = normals(index)
    known = explained & ~np.take_along_axis(surface.flagged, rows, axis=1)
    n = np.take_along_axis(surface.vectors, rows[..., None], axis=1)
    partners = np.take_along_axis(index.points, rows[..., None], axis=1)
    radius = rms_radius(moved)
    radius = np.where(radius > 0.0, radius, 1.0)
    system = gauss_newton.system(
        moved, partners, n[..., :, None] * n[..., None, :], known.astype(np.float64), moved.mean(axis=1), radius
    )
    largest = system.eigenvalues[:, -1]
    weakest = np.where(largest > 0.0, system.eigenvalues[:, 0] / np.where(largest > 0.0, largest, 1.0), 0.0)
    return Evidence(
        explained.reshape(*axes, -1),
        explained.mean(axis=1).reshape(axes)[()],
        rms.reshape(axes)[()],
        np.clip(weakest, 0.0, 1.0).reshape(axes)[()],
    )


def halves(source: ArrayLike, target: ArrayLike, pose: Pose, method: str = "icp", **options: Any) -> FloatArray:
    """How far apart two runs from the poses (...) end, one on every second source point and one on the others: the RMS
    distance, (...), between where their poses put the source (..., m, d), world units.

    They see the same target, and points of one scan: they agree on a wrong pose as well as on a right one where both
    come to rest there. method, options: as for `solvers.register`, whose ValueErrors it raises, and one for a source of
    a single point.
    """
    p = validate.cloud(source, "source")
    if p.shape[-2] < 2:
        raise ValueError("source: one point has no two halves")
    ends = [
        register(p[..., part::2, :], target, method, start=pose, **options).pose.apply(p) for part in (0, 1)
    ]
    apart: FloatArray = np.sqrt(np.square(ends[0] - ends[1]).sum(axis=-1).mean(axis=-1))
    return apart[()]
