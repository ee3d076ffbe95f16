"""Drives with a laser: a real one, and simulated ones with a known truth."""

from solvers.scenes.drive import Drive, chained, interlaced, telecom_loop
from solvers.scenes.simulated_drive import simulated_drive

__all__ = ["Drive", "chained", "interlaced", "simulated_drive", "telecom_loop"]
