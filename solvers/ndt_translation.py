"""NDT's score over translations, and Newton's climb on it."""

from solvers.methods.ndt.translation import Climb, climb

__all__ = ["Climb", "climb"]
