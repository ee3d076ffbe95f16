"""Fewer points, evenly: thinned clouds, slabs, spacing."""

from solvers.geometry.downsample import FINEST, slab, spacing, thinned

__all__ = ["FINEST", "slab", "spacing", "thinned"]
