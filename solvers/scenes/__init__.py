"""Seeded scenes with a known truth: those of `rooms` are exported here; the others have modules of their own."""

from solvers.scenes.rooms import (
    BIRD,
    KABSCH_SCENES,
    KABSCH_START,
    KABSCH_TRUTH,
    MAST,
    ROOM,
    ROOM_SETTINGS,
    ROOM_START_DIRECTION,
    Scene,
    kabsch_scene,
    room,
    room_start,
)

__all__ = [
    "BIRD",
    "KABSCH_SCENES",
    "KABSCH_START",
    "KABSCH_TRUTH",
    "MAST",
    "ROOM",
    "ROOM_SETTINGS",
    "ROOM_START_DIRECTION",
    "Scene",
    "kabsch_scene",
    "room",
    "room_start",
]
