"""Checks of point clouds, weights, pairs, poses and options, which raise a ValueError
that names the argument.

Geometry is never rejected: one point, equal points and collinear points are valid clouds
whose fits are degenerate.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from solvers.core.arrays import FloatArray, IntArray
from solvers.core.kinds import shown
from solvers.core.numbers import LARGEST as LARGEST
from solvers.core.numbers import array, copied, moderate, numbers
from solvers.core.pose import Pose
from solvers.core.proper import SHEARED

MOST = 2**31 - 1
"""The largest count accepted, whatever is counted."""

TRANSPOSED = 3
"""At most this many rows of more than this many coordinates are taken for a transposed cloud: as points, they would not
determine the rotation in any case."""


def cloud(points: ArrayLike, name: str, dim: int | None = None) -> FloatArray:
    """`points` as a finite float64 array of shape (..., n, d), n ≥ 1, d ≥ 2 (d = `dim`
    if given).
    """
    p = numbers(points, name, "; read the file first (solvers.cloud_text.read)")
    width = "d" if dim is None else str(dim)
    if p.ndim < 2:
        raise ValueError(f"{name}: expected shape (..., n, {width}), rows of coordinates, got {p.shape}")
    if p.size == 0:
        raise ValueError(f"{name}: is empty, shape {p.shape}; at least one point is needed")
    n, d = p.shape[-2:]
    if n <= TRANSPOSED < d != dim:
        transpose = f"{name}.T" if p.ndim == 2 else f"numpy.swapaxes({name}, -1, -2)"
        raise ValueError(
            f"{name}: shape {p.shape} is {n} points in {d} dimensions; a cloud has one point per row (pass {transpose})"
        )
    if d < 2 or (dim is not None and d != dim):
        raise ValueError(f"{name}: expected {width if dim else 'at least 2'} coordinates per point, got {d}")
    rows = f"; {name}[numpy.isfinite({name}).all(axis=1)] has the rows without them" if p.ndim == 2 else ""
    return moderate(p, name, rows or "; clouds without these rows are of unequal size: pass them as a list")


def matched(source: ArrayLike, target: ArrayLike, hint: str = "") -> tuple[FloatArray, FloatArray]:
    """Two clouds whose rows correspond: equal n and d, leading axes that broadcast. `hint` ends the message if the
    numbers of rows differ.
    """
    p = cloud(source, "source")
    q = cloud(target, "target", p.shape[-1])
    if p.shape[-2] != q.shape[-2]:
        raise ValueError(
            f"target: row i must be the partner of source row i, but source has {p.shape[-2]} rows and target "
            f"{q.shape[-2]}{hint}"
        )
    batch_shape(source=p.shape[:-2], target=q.shape[:-2])
    return p, q


def weights(values: ArrayLike | None, count: int, name: str = "weights", text: str = "") -> FloatArray:
    """Non-negative finite weights of shape (..., count); None means all ones. `text`: as for `numbers`."""
    if values is None:
        return np.ones(count)
    w = moderate(numbers(values, name, text), name)
    if w.ndim < 1 or w.shape[-1] != count:
        raise ValueError(f"{name}: expected shape (..., {count}), one weight per row, got {w.shape}")
    if np.any(w < 0.0):
        raise ValueError(f"{name}: must not be negative, but the smallest is {w.min():.6g}")
    return w


def pairs(values: ArrayLike, source_count: int, target_count: int) -> IntArray:
    """Index pairs (..., k, 2) of source row and target row, k ≥ 1, within range."""
    k = array(values, "pairs")
    if k.ndim < 2 or k.shape[-1] != 2:
        raise ValueError(f"pairs: expected shape (..., k, 2), source row and target row, got {k.shape}")
    if k.size == 0:
        raise ValueError(f"pairs: is empty, shape {k.shape}; at least one pair is needed")
    if k.dtype.kind not in "iu":
        raise ValueError(f"pairs: expected integers, got {k.dtype}")
    for column, count, cloud_name in ((0, source_count, "source"), (1, target_count, "target")):
        low, high = int(k[..., column].min()), int(k[..., column].max())
        if low < 0 or high >= count:
            raise ValueError(
                f"pairs: column {column} names {cloud_name} row {low if low < 0 else high}, "
                f"but the rows go from 0 to {count - 1}"
            )
    return k.astype(np.int64)


def row(values: ArrayLike, name: str, count: int, item: str) -> FloatArray:
    """Finite numbers (count,), one per `item`, as a read-only copy."""
    data = moderate(copied(values, name), name)
    if data.shape != (count,):
        raise ValueError(f"{name}: expected shape ({count},), one per {item}, got {data.shape}")
    return data


def start(value: Pose | ArrayLike | None, name: str = "start") -> Pose | None:
    """A pose, or the pose of homogeneous matrices (..., d + 1, d + 1)."""
    if value is None or isinstance(value, Pose):
        return value
    matrix = moderate(numbers(value, name), name)
    try:
        return Pose.from_matrix(matrix)
    except ValueError as error:
        message = str(error).removeprefix("matrix: ")
        if matrix.shape[-2:-1] != matrix.shape[-1:]:  # such as [x, y, angle]
            message += "; Pose.from_angle(radians, (x, y)) makes a Pose, in space Pose.from_rotvec"
        raise ValueError(f"{name}: is neither a Pose nor the matrix of one: {message}") from None


def pose(value: Pose | None, dim: int, name: str = "start", words: str = "") -> Pose:
    """A valid pose of the right dimension; None means the identity. `words`: what to say of the dimension instead of
    that of the clouds."""
    if value is None:
        return Pose.identity(dim)
    if value.dim != dim:
        raise ValueError(f"{name}: moves points in {value.dim} dimensions, {words or f'the clouds have {dim}'}")
    scale = np.asarray(value.scale)
    for part, letter in ((value.R, "R"), (value.t, "t"), (scale, "scale")):
        moderate(part, f"{name}.{letter}")
    off = np.abs(value.R @ value.R.swapaxes(-1, -2) - np.eye(dim)).max(initial=0.0)
    if off > 1e-6:
        raise ValueError(f"{name}.R: is not orthogonal, R Rᵀ differs from the identity by {off:.2g}")
    if np.any(np.linalg.det(value.R) < 0.0):
        raise ValueError(f"{name}.R: is a reflection (determinant −1), not a rotation")
    if np.any(scale <= 0.0):
        raise ValueError(f"{name}.scale: must be positive, but the smallest is {scale.min():.6g}")
    return value


def unscaled(value: Pose, name: str, says: str) -> Pose:
    """The pose as a rigid motion. A scale that differs from 1 by rounding, as in a float32 matrix, is set to 1.
    Raises ValueError with `says` for any other scale."""
    scale = np.asarray(value.scale)
    off = np.abs(scale - 1.0)
    if (off > SHEARED).any():
        raise ValueError(f"{name}.scale: {says}, not {scale.flat[off.argmax()]:.9g}")
    return Pose.trusted(value.R, value.t, np.ones(scale.shape)) if off.any() else value


def seeds(values: ArrayLike | np.random.Generator | None, name: str = "seed") -> IntArray:
    """Non-negative seeds of at most 63 bits, (...). A generator gives the next number it
    draws, None an unpredictable one.
    """
    if values is None or isinstance(values, np.random.Generator):
        return np.asarray(np.random.default_rng(values).integers(np.iinfo(np.int64).max))
    s = array(values, name)
    if s.dtype.kind not in "iu" or s.size == 0:
        raise ValueError(f"{name}: expected a non-negative integer or an array of them, got {shown(values)}")
    if s.min() < 0 or s.max() > np.iinfo(np.int64).max:
        raise ValueError(f"{name}: expected non-negative integers of at most 63 bits")
    return s.astype(np.int64)


def few(source: int, target: int, fits: bool, limit: str, size: int) -> None:
    """Raise ValueError if clouds of so many points do not fit into a method's memory. `limit`
    says what does; two clouds of `size` points do in any case.
    """
    if not fits:
        larger, smaller = ("source", "target") if source >= target else ("target", "source")
        raise ValueError(
            f"{larger}: its {max(source, target)} points and the {smaller}'s {min(source, target)} are too many:"
            f" {limit}; solvers.thinning.thinned(points, {size}) makes a cloud smaller"
        )


def count(value: object, name: str, least: int = 0) -> int:
    """An integer of at least `least` and at most `MOST`."""
    value = scalar(value)
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise ValueError(f"{name}: expected an integer, got {shown(value)}")
    plain = int(value)
    if plain < least:
        raise ValueError(f"{name}: must be at least {least}, got {plain}")
    if plain > MOST:
        raise ValueError(f"{name}: must be at most {MOST}")
    return plain


def number(value: object, name: str, low: float = -np.inf, high: float = np.inf) -> float:
    """A finite number within [low, high]."""
    return _number(value, name, low, high, "a finite number")


def widths(first: float | None, last: float | None) -> None:
    """Check a width's first and last value, None for the method's own: `last` must be at most `first`."""
    for name, value in (("first", first), ("last", last)):
        if value is not None:
            number(value, name, 1e-100, 1e100)
    if first is not None and last is not None and last > first:
        raise ValueError(f"last: expected at most first, {first:g}, got {last!r}")


def scalar(value: object) -> object:
    """`value`, with numpy's numbers and arrays without axes converted to Python's types."""
    # Subclasses are left alone: the masked constant is one, and would become 0.
    bare = (type(value) is np.ndarray and not value.ndim) or isinstance(value, np.generic)
    return cast(Any, value).item() if bare else value


def _number(value: object, name: str, low: float, high: float, expected: str) -> float:
    value = scalar(value)
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating):
        raise ValueError(f"{name}: expected a number, got {shown(value)}")
    try:
        plain = float(value)
    except OverflowError:
        raise ValueError(f"{name}: expected a finite number{_between(low, high)}, got one beyond 1e308") from None
    if isinstance(value, int) and abs(value) > 2**63 - 1:  # numpy would make it an object, not a number
        raise ValueError(f"{name}: expected a number, got an integer of more than 63 bits; pass {plain:g}")
    if not np.isfinite(plain) or not low <= plain <= high:
        raise ValueError(f"{name}: expected {expected}{_between(low, high)}, got {plain!r}")
    return plain


def _between(low: float, high: float) -> str:
    """The finite limits, in words."""
    if np.isinf(high):
        return "" if np.isinf(low) else f" of at least {low:g}"
    return f" of at most {high:g}" if np.isinf(low) else f" from {low:g} to {high:g}"


def flag(value: object, name: str) -> bool:
    """True or False; no other truthy or falsy value is accepted."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name}: expected True or False, got {shown(value)}")
    return bool(value)


def limit(value: object, name: str) -> float:
    """A number; it may be infinite, of either sign."""
    value = scalar(value)
    return value if isinstance(value, float) and np.isinf(value) else _number(value, name, -np.inf, np.inf, "a number")


def reach(value: object, name: str, low: float = -np.inf) -> float:
    """A number of at least `low`; it may be infinite."""
    value = scalar(value)
    return np.inf if isinstance(value, float) and value == np.inf else _number(value, name, low, np.inf, "a number")


def one_or_several(value: object, name: str) -> tuple[Any, ...]:
    """One number, or a sequence or an array of at least one, as a tuple."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, str | bytes) or not isinstance(value, Sequence):
        return (value,)
    if not value:
        raise ValueError(f"{name}: expected a number or several, got none")
    return tuple(value)


def one_of(value: object, choices: Collection[str], name: str) -> str:
    """Return `value` if it is one of the `choices`, else raise a ValueError that
    suggests the nearest one.
    """
    if isinstance(value, str) and value in choices:
        return value
    names = sorted(choices)
    near = nearest(value, names) if isinstance(value, str) else ""
    raise ValueError(f"{name}: {shown(value)} is unknown{near}; known: {', '.join(names)}")


def nearest(wrong: str, names: Iterable[str]) -> str:
    """', did you mean …?' with the nearest right name, or an empty string if none is near."""
    choices = list(names)
    # A whole part of a name, such as "cpd" of "cpd-rigid", says more than a few letters in common.
    parts = [name for name in choices if wrong and wrong in name.replace("_", "-").split("-")]
    close = parts or difflib.get_close_matches(wrong, choices, n=1, cutoff=0.5)
    return f", did you mean {' or '.join(map(repr, close))}?" if close else ""


def batch_shape(**shapes: tuple[int, ...]) -> tuple[int, ...]:
    """The shape that the named leading axes broadcast to."""
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        axes = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"{', '.join(shapes)}: leading axes do not broadcast: {axes}") from None
