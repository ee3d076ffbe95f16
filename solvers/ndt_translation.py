"""NDT's score over translations, and Newton's climb on it."""

from solvers.methods.ndt.translation import Climb, Path, climb

__all__ = ["Climb", "Path", "climb"]
