"""A door in the hall, drawn as on a plan. It is shut and flush with its wall, so scans cannot see it; it shows the
reader which end of the hall is which."""

from __future__ import annotations

import numpy as np

from solvers import Pose
from solvers.scenes.rooms import Scene
from widgets.drawing.picture import Array, Mark, Path, Role

HINGE = np.array([4.2, 0.5])  # u, on the hall's short wall at the right
WIDE = 1.2  # u
_SWING = np.linspace(0.5 * np.pi, np.pi, 19)


def _plan() -> Array:
    """The leaf, open into the hall, and the arc of its edge back to the wall, as one line (k, 2)."""
    edge = HINGE + WIDE * np.stack([np.cos(_SWING), np.sin(_SWING)], axis=1)
    return np.vstack([edge, HINGE])


def door(scene: Scene, pose: Pose, role: Role) -> tuple[Mark, ...]:
    """The door at a pose; scenes other than the hall have none."""
    if scene.name != "hall":
        return ()
    return (Path(pose.apply(_plan()), role, thick=True),)
