"""Objectives over the plane of translations."""

from solvers.methods.mmd.landscape import CappedField, MmdField, Path, capped_field, mmd_field

__all__ = ["CappedField", "MmdField", "Path", "capped_field", "mmd_field"]
