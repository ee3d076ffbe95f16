"""Outlines of a robot from above, at the origin and ahead along x."""

from __future__ import annotations

import numpy as np

from widgets.drawing.picture import Array

ARROW = np.array([(1.3, 0.0), (-0.7, 0.8), (-0.3, 0.0), (-0.7, -0.8)])
"""An arrowhead, for maps on which a disc would be small."""


def disc(nose: float, radius: float, gap: float = 0.7, count: int = 25) -> Array:
    """A disc whose rim between −gap and gap radians is replaced by a nose; `count` points on the rim."""
    turn = np.linspace(gap, 2.0 * np.pi - gap, count)
    return np.concatenate([[(nose, 0.0)], radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)])
