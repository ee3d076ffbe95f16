"""The pairwise terms of the soft methods: shares, overlaps, and the weight of clutter."""

from solvers.methods.soft.shares import clutter_weight, filterreg_shares, gmmreg_overlaps

__all__ = ["clutter_weight", "filterreg_shares", "gmmreg_overlaps"]
