"""A ring round the clouds, on which every heading has its place."""

from __future__ import annotations

import numpy as np

from widgets.drawing.picture import Array


def place(turn: Array | float, radius: Array | float) -> Array:
    """Where a heading (radians, the truth being 0) lies on the ring at a radius: the truth is at the top."""
    turn = np.asarray(turn, dtype=float)
    return np.asarray(np.stack([-np.sin(turn), np.cos(turn)], axis=-1) * np.asarray(radius)[..., None])
