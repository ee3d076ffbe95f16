"""Reducing clouds: thinned copies, horizontal slabs, and point spacing."""

from solvers.geometry.downsample import FINEST, slab, spacing, thinned

__all__ = ["FINEST", "slab", "spacing", "thinned"]
