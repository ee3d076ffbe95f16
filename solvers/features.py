"""Random Fourier features, and the exact squared MMD that they approximate."""

from solvers.numerics.fourier_features import (
    BLOCK,
    cos_sin,
    exact_squared_mmd,
    feature_sums,
    mean_features,
    mean_kernel,
    unit_frequencies,
)

__all__ = ["BLOCK", "cos_sin", "exact_squared_mmd", "feature_sums", "mean_features", "mean_kernel", "unit_frequencies"]
