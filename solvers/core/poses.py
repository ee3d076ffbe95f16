"""Several poses made one batch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers.core.pose import Pose


def stacked(poses: Sequence[Pose]) -> Pose:
    """Poses of one shape (...) side by side, (k, ...)."""
    return Pose.trusted(
        np.stack([p.R for p in poses]), np.stack([p.t for p in poses]), np.stack([np.asarray(p.scale) for p in poses])
    )


def concatenated(parts: Sequence[Pose]) -> Pose:
    """Poses of shapes (n, ...), which may differ in n, one after the other."""
    return Pose.trusted(
        np.concatenate([p.R for p in parts]),
        np.concatenate([p.t for p in parts]),
        np.concatenate([np.asarray(p.scale) for p in parts]),
    )
