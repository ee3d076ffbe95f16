"""NDT's score over translations, and Newton's climb on it."""

from solvers.methods.ndt.translation import Path, climb

__all__ = ["Path", "climb"]
