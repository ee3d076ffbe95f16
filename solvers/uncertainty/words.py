"""What is free or widest of a spread, in words."""

from __future__ import annotations

import numpy as np

from solvers.core.arrays import AnyArray, FloatArray


def said(direction: AnyArray, centre: FloatArray, radius: float, deviations: FloatArray) -> str:
    """Of a spread with these deviations (3,), the first of them along `direction`."""
    free = int(np.isinf(deviations).sum())
    if free > 1:
        return f"{free} of 3 directions of motion are free"
    motion = named(direction, centre, radius)
    return f"{motion} is free" if free else f"widest: {motion}, σ = {deviations[0]:.2g} u"


def named(direction: AnyArray, centre: FloatArray, radius: float) -> str:
    """A direction (radius · angle, x, y) in words: a slide, or a turn about a point."""
    omega, v = float(direction[0]), direction[1:]
    # A turn about a point ten radii away is a slide to the eye.
    if abs(omega) < 0.1:
        along = ", ".join(f"{x:.2f}" for x in v / np.linalg.norm(v))
        return f"the slide along ({along})"
    x = centre + np.array([-v[1], v[0]]) * radius / omega
    return f"the turn about ({x[0]:.2f}, {x[1]:.2f})"
