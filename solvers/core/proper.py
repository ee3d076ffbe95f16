"""The parts of a pose: broadcast to one batch shape, and rejected if not a rotation, a translation or a scale."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from solvers.core.arrays import FloatArray
from solvers.core.kinds import several, shown
from solvers.core.numbers import finite, numbers

ROUNDING = 1e-12
"""How far a matrix's scale may be from 1, or R Rᵀ from the identity, by rounding alone."""
SHEARED = 2e-6
"""How far R Rᵀ may be from the identity, and the scale of a rigid motion from 1, to be accepted: numbers written with
six digits pass, and so does float32."""
ROUNDED = 0.05
"""Up to this, R Rᵀ may differ from the identity because its numbers were written with few digits, down to two."""
NEAREST = "; if R was rounded, U @ Vt of U, _, Vt = np.linalg.svd(R) is the nearest rotation"


def of_one_batch(R: ArrayLike, t: ArrayLike, scale: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """R (..., d, d), t (..., d) and scale (...) broadcast to the same leading axes, as read-only copies."""
    R, t = np.asarray(R, dtype=np.float64), np.asarray(t, dtype=np.float64)
    scale = np.asarray(scale, dtype=np.float64)
    if R.ndim < 2 or R.shape[-1] != R.shape[-2]:
        raise ValueError(f"R: expected shape (..., d, d), got {R.shape}")
    d = R.shape[-1]
    if t.ndim < 1 or t.shape[-1] != d:
        raise ValueError(f"t: expected shape (..., {d}) to go with R, got {t.shape}")
    batch = scale.shape
    if not R.shape[:-2] == t.shape[:-1] == batch:  # rarely needed, and slow
        try:
            batch = np.broadcast_shapes(R.shape[:-2], t.shape[:-1], scale.shape)
        except ValueError:
            raise ValueError(
                f"R, t, scale: leading axes {R.shape[:-2]}, {t.shape[:-1]} and {scale.shape} do not broadcast"
            ) from None
    return _frozen(R, (*batch, d, d)), _frozen(t, (*batch, d)), _frozen(scale, batch)


def _frozen(values: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    # Broadcasting costs more than the copy, and is rarely needed. Always in C order: a product of the same numbers in
    # another memory order can round differently.
    out = np.array(values if values.shape == shape else np.broadcast_to(values, shape), dtype=np.float64, order="C")
    out.flags.writeable = False
    return out


def fits(axes: tuple[int, ...], batch: tuple[int, ...], name: str) -> None:
    """Raise ValueError for leading axes that do not broadcast against a pose's."""
    if axes and batch and axes != batch:
        try:
            np.broadcast_shapes(batch, axes)
        except ValueError:
            raise ValueError(f"{name}: leading axes {axes} do not broadcast with {batch}") from None


def identities(d: int, batch: tuple[int, ...]) -> FloatArray:
    """The identity matrix (d, d) over leading axes; raises ValueError if one of them is wrong."""
    axes = several(batch, "batch", "sizes, such as (3,)")
    for size, name, least in (d, "d", 1), *((axis, "batch", 0) for axis in axes):
        if isinstance(size, bool) or not isinstance(size, int | np.integer) or size < least:
            raise ValueError(f"{name}: expected an integer of at least {least}, got {shown(size)}")
    return np.broadcast_to(np.eye(d), (*axes, d, d))


def check(t: FloatArray, scale: FloatArray) -> None:
    """Raise ValueError for numbers that are not finite, and for a scale that is not positive."""
    finite(t, "t")
    finite(scale, "scale")
    if np.any(scale <= 0.0):
        raise ValueError(f"scale: must be positive, but the smallest is {scale.min():.6g}")


def rotation(R: FloatArray) -> FloatArray:
    """R with its rounding to few digits corrected, as a read-only array; raises ValueError if it is not a rotation."""
    finite(R, "R")
    off = _sheared(R)
    if (off > SHEARED).any():
        # In the plane rounding only scales a rotation; in space it shears it too, which `from_matrix` refuses as well.
        advice = NEAREST if R.shape[-1] > 2 and off.max() < ROUNDED else "; Pose.from_matrix takes a scale out"
        raise ValueError(f"R: expected a rotation, but R Rᵀ differs from I by {off.max():.2g}{advice}")
    if np.any(np.linalg.det(R) < 0.0):
        raise ValueError("R: expected a rotation, but one is a reflection")
    return R if (off <= ROUNDING).all() else _frozen(_straightened(R, off), R.shape)


def _sheared(R: FloatArray) -> FloatArray:
    """How far R Rᵀ is from the identity, (...)."""
    return np.asarray(np.abs(R @ R.swapaxes(-1, -2) - np.eye(R.shape[-1])).max(axis=(-2, -1), initial=0.0))


def _straightened(R: FloatArray, off: FloatArray) -> FloatArray:
    """R where it is a rotation to rounding, else the nearest rotation. Uncorrected, its transpose would not be its
    inverse, an error of metres in national grid coordinates. Two Newton steps remove a deviation of 2e-6.
    """
    near = R
    for _ in range(2):
        near = near @ (1.5 * np.eye(R.shape[-1]) - 0.5 * near.swapaxes(-1, -2) @ near)
    return np.where((off > ROUNDING)[..., None, None], near, R)


def apart(matrix: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Split homogeneous matrices into R, t and scale."""
    M = numbers(matrix, "matrix")
    if M.ndim < 2 or M.shape[-1] != M.shape[-2] or M.shape[-1] < 3:
        raise ValueError(f"matrix: expected shape (..., d + 1, d + 1) with d of at least 2, got {M.shape}")
    finite(M, "matrix")
    d = M.shape[-1] - 1
    if np.any(M[..., d, :d] != 0.0) or np.any(M[..., d, d] != 1.0):
        raise ValueError(f"matrix: expected the last row {[0] * d + [1]}, as of a homogeneous matrix")
    A = M[..., :d, :d]
    # Dividing by a power of two near the largest entry changes no digit. Without it the determinant of a small matrix
    # would be zero, and that of a large one infinite.
    exponent = np.frexp(np.abs(A).max(axis=(-2, -1), initial=0.0))[1]
    A = np.ldexp(A, -exponent[..., None, None])
    det = np.linalg.det(A)
    if np.any(det <= 0.0):
        flaw = "a reflection" if np.any(det < 0.0) else "singular"
        raise ValueError(f"matrix: expected a rotation times a scale, but one is {flaw}")
    unit = det ** (1.0 / d)
    with np.errstate(over="ignore", under="ignore"):
        scale = np.ldexp(unit, exponent)
    if not np.isfinite(scale).all():
        raise ValueError("matrix: expected a rotation times a scale, but one has a scale beyond floating point")
    # Scales this close to 1, such as that of a rounded rotation, are 1.
    near = np.abs(scale - 1.0) < ROUNDING
    scale, unit = np.where(near, 1.0, scale), np.where(near, np.ldexp(1.0, np.where(near, -exponent, 0)), unit)
    R = A / unit[..., None, None]
    off = _sheared(R)
    if (off > SHEARED).any():
        flaw = f"R Rᵀ differs from I by {off.max():.2g}{NEAREST if off.max() < ROUNDED else ''}"
        raise ValueError(f"matrix: expected a rotation times a scale, but {flaw}")
    return _straightened(R, off) if (off > ROUNDING).any() else R, M[..., :d, d], scale
