"""What the soft methods work with, pair by pair: shares, overlaps, and what clutter weighs."""

from solvers.methods.soft.shares import clutter_weight, filterreg_shares, gmmreg_overlaps

__all__ = ["clutter_weight", "filterreg_shares", "gmmreg_overlaps"]
