"""A hall in space."""

from solvers.scenes.hall_3d import FLOOR, HEIGHT, Hall, hall

__all__ = ["FLOOR", "HEIGHT", "Hall", "hall"]
