"""A wall, a corridor, a hall and the room of the NDT chapters."""

from solvers.scenes.walls import CORRIDOR, HALL, NDT_ROOM, PILLAR, WALL, corridor, hall, ndt_room, sampled, single_wall

__all__ = ["CORRIDOR", "HALL", "NDT_ROOM", "PILLAR", "WALL", "corridor", "hall", "ndt_room", "sampled", "single_wall"]
