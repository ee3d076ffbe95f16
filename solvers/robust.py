"""Robust kernels: weights, losses, and the scale they are measured in."""

from solvers.numerics.robust import (
    FLOOR,
    KERNELS,
    TUNING,
    check_options,
    least_scale,
    loss,
    mad_scale,
    threshold,
    weights,
)

__all__ = ["FLOOR", "KERNELS", "TUNING", "check_options", "least_scale", "loss", "mad_scale", "threshold", "weights"]
