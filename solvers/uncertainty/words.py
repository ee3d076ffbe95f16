"""Describing a spread in words: its free directions, or its widest if there is one."""

from __future__ import annotations

import numpy as np

from solvers.core.amounts import place
from solvers.core.arrays import AnyArray, FloatArray

EQUAL = 1e-6  # of the largest deviation: with a smaller difference, rounding alone decides which direction is widest
SLIDE = 0.1  # turning part of a unit direction: a turn about a point ten radii away, which looks like a slide


def said(direction: AnyArray, centre: FloatArray, radius: float, deviations: FloatArray) -> str:
    """A spread with these deviations (3,), the first of them along `direction`, in words."""
    free = int(np.isinf(deviations).sum())
    if free > 1:
        return f"{free} of 3 directions of motion are free"
    motion = named(direction, centre, radius)
    if free:
        return f"{motion} is free"
    if deviations[0] == 0.0:
        return "no spread"
    equal = int((deviations[0] - deviations <= EQUAL * deviations[0]).sum())
    if equal == 3:
        turn = f"{np.degrees(deviations[0] / radius):.2g}° for the turn about {place(centre, radius)}"
        return f"equal in all directions, σ = {deviations[0]:.2g} u; {turn}"
    if equal == 2:
        return f"two directions are equally wide, σ = {deviations[0]:.2g} u"
    omega = abs(float(direction[0]))
    if omega < SLIDE:
        return f"widest: {motion}, σ = {deviations[0]:.2g} u"
    return f"widest: {motion}, σ = {np.degrees(deviations[0] * omega / radius):.2g}°"


def named(direction: AnyArray, centre: FloatArray, radius: float) -> str:
    """A direction (radius · angle, x, y) in words: a slide, or a turn about a point."""
    omega, v = float(direction[0]), direction[1:]
    if abs(omega) < SLIDE:
        along = ", ".join(f"{x:.2f}" for x in v / np.linalg.norm(v))
        return f"the slide along ({along})"
    x = centre + np.array([-v[1], v[0]]) * radius / omega
    return f"the turn about {place(x, radius)}"
