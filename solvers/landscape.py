"""Objectives over the plane of translations."""

from solvers.methods.mmd.capped_landscape import CappedField, capped_field
from solvers.methods.mmd.landscape import MmdField, Path, mmd_field

__all__ = ["CappedField", "MmdField", "Path", "capped_field", "mmd_field"]
