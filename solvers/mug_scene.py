"""A mug with a handle, in 3-D."""

from solvers.scenes.mug import (
    AXIS,
    GRIP,
    HEIGHT,
    PAIRS,
    RADIUS,
    TRUTH,
    TUBE,
    Mug,
    mug,
    mug_pairs,
    mug_start,
)

__all__ = ["AXIS", "GRIP", "HEIGHT", "PAIRS", "RADIUS", "TRUTH", "TUBE", "Mug", "mug", "mug_pairs", "mug_start"]
