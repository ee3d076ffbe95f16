"""What is not a rotation or a scale is refused here, given as arrays or as a homogeneous matrix."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core.arrays import FloatArray

ROUNDING = 1e-12
"""How far from 1 a scale may be and still be told as 1."""
SHEARED = 1e-6
"""How far R Rᵀ may be from the identity: what is written with six digits still passes."""


def check(R: FloatArray, scale: FloatArray) -> None:
    """Refuse what is neither rigid motion nor similarity. What is not finite passes: its run tells what it became."""
    if np.any(scale <= 0.0):
        raise ValueError(f"scale: must be positive, but the smallest is {scale.min():.6g}")
    if not np.isfinite(R).all():
        return
    d = R.shape[-1]
    off = np.abs(R @ R.swapaxes(-1, -2) - np.eye(d)).max(initial=0.0)
    if off > SHEARED:
        raise ValueError(
            f"R: expected a rotation, but R Rᵀ differs from I by {off:.2g}; Pose.from_matrix takes a scale out"
        )
    if np.any(np.linalg.det(R) < 0.0):
        raise ValueError("R: expected a rotation, but one is a reflection")


def apart(matrix: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """R, t and scale of homogeneous matrices."""
    M = np.asarray(matrix, dtype=np.float64)
    if M.ndim < 2 or M.shape[-1] != M.shape[-2] or M.shape[-1] < 3:
        raise ValueError(f"matrix: expected shape (..., d + 1, d + 1) with d of at least 2, got {M.shape}")
    if not np.isfinite(M).all():
        raise ValueError("matrix: holds numbers that are not finite")
    d = M.shape[-1] - 1
    if np.any(M[..., d, :d] != 0.0) or np.any(M[..., d, d] != 1.0):
        raise ValueError(f"matrix: expected the last row {[0] * d + [1]}, as of a homogeneous matrix")
    A = M[..., :d, :d]
    det = np.linalg.det(A)
    if np.any(det <= 0.0):
        flaw = "a reflection" if np.any(det < 0.0) else "singular"
        raise ValueError(f"matrix: expected a rotation times a scale, but one is {flaw}")
    scale = det ** (1.0 / d)
    # Numbers close to 1, such as a rotation's own determinant, are rounding.
    scale = np.where(np.abs(scale - 1.0) < ROUNDING, 1.0, scale)
    R = A / scale[..., None, None]
    off = np.abs(R @ R.swapaxes(-1, -2) - np.eye(d)).max(initial=0.0)
    if off > SHEARED:
        raise ValueError(f"matrix: expected a rotation times a scale, but R Rᵀ differs from I by {off:.2g}")
    return R, M[..., :d, d], scale
