"""Seeded scenes with a known truth. The room and its kin stand here; each other scene has its module."""

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
