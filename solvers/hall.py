"""A hall in 3-D."""

from solvers.scenes.hall_3d import FLOOR, HEIGHT, Hall, hall

__all__ = ["FLOOR", "HEIGHT", "Hall", "hall"]
