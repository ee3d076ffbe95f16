"""The fish of the four representations."""

from solvers.scenes.fish import FISH, FISH_SETTINGS, POINTS, SIDE, SMALLER, START_DEGREES, START_SHIFT, fish, fish_start

__all__ = ["FISH", "FISH_SETTINGS", "POINTS", "SIDE", "SMALLER", "START_DEGREES", "START_SHIFT", "fish", "fish_start"]
