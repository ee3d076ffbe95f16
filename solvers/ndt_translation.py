"""Climbing NDT's score by Newton steps over translations alone."""

from solvers.methods.ndt.translation import Climb, climb

__all__ = ["Climb", "climb"]
