"""When a step of the optimisation is so small that the poses are at rest."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import FloatArray

NEAR = 1e-6  # a step this small, measured as for `tolerance`, is at rest if rounding hides its gain
_ROUNDING = 1e-14
_FAR = 1e6  # times the longest translation: nodes this far from the origin are known less well than steps are measured


def at_rest(
    step: FloatArray, gain: float, objective: float, pulls: FloatArray, stiffness: FloatArray, tolerance: float,
    far: float, reach: float,
) -> bool:  # fmt: skip
    """Whether no node moves by the step (n, 3).

    gain: by which the step should lower the objective. pulls, stiffness: (e, 3) and (e, 3, 3), each edge's share of the
    gradient and of the matrix at one of its nodes. far: the largest coordinate of a node; reach: the longest measured
    translation, which `tolerance` is a fraction of.

    A coordinate is known to half a unit u in its last place. Where that is much next to `reach`, the objective is
    known to √(Σ pull²) u + Σ stiffness u², and a step to about 4 u √n.
    """
    enough = max(tolerance, NEAR if gain <= _ROUNDING * objective else 0.0)
    if far > _FAR * reach:
        blur = float(np.spacing(far))
        hidden = blur * float(np.linalg.norm(pulls[:, :2]))
        hidden += blur**2 * float(np.trace(stiffness[:, :2, :2], axis1=1, axis2=2).sum())
        if gain <= hidden:
            enough = max(enough, 4.0 * blur / reach * float(np.sqrt(len(step))))
    return bool((np.abs(step) <= enough * np.array([reach, reach, 1.0])).all())
