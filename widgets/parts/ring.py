"""The ring round the clouds, with a place for every heading."""

from __future__ import annotations

import numpy as np

from widgets.drawing.picture import Array


def place(turn: Array | float, radius: Array | float) -> Array:
    """The point of a heading (radians) on a ring of this radius; the truth, 0, is at the top."""
    turn = np.asarray(turn, dtype=float)
    return np.asarray(np.stack([-np.sin(turn), np.cos(turn)], axis=-1) * np.asarray(radius)[..., None])
