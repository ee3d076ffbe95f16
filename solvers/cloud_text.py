"""Clouds from files: CSV, XYZ, PLY and PCD."""

from solvers.io.clouds import MOST_BYTES, MOST_POINTS, CloudText, read

__all__ = ["MOST_BYTES", "MOST_POINTS", "CloudText", "read"]
