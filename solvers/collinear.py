"""Collinear pairs, and the rotation that they leave free."""

from solvers.geometry.collinear import poses_about_line

__all__ = ["poses_about_line"]
