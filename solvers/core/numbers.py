"""Arguments as arrays of real numbers; anything else raises a ValueError that names the argument."""

from __future__ import annotations

import reprlib
import sys
from collections.abc import Sequence
from os import PathLike
from typing import TypeGuard, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from solvers.core.arrays import AnyArray, FloatArray

LARGEST = 1e150
"""The largest coordinate or weight accepted: beyond it squares overflow float64."""

_Values = TypeVar("_Values")


def unmasked(values: _Values, name: str) -> _Values | AnyArray:
    """`values`, a masked array without masked numbers as a plain one. Raises ValueError if any are masked, in a list of
    arrays too: the mask would be lost, and what it hides used."""
    ma = sys.modules.get("numpy.ma")  # a caller with a masked array has imported it; the page's numpy lacks it
    if ma is None or not hasattr(ma, "MaskedArray"):  # another thread may have imported half of it
        return values
    if not isinstance(values, ma.MaskedArray):
        for entry in values if isinstance(values, list | tuple) else ():
            if isinstance(entry, ma.MaskedArray):
                unmasked(entry, name)
        return values
    if ma.is_masked(values):
        masked = int(ma.getmaskarray(values).sum())
        count, rows = ("1 number", "its row") if masked == 1 else (f"{masked} numbers", "their rows")
        raise ValueError(f"{name}: a masked array hides {count}; leave {rows} out")
    plain: AnyArray = values.data
    return plain


def array(values: ArrayLike, name: str) -> AnyArray:
    """`values` as an array of any dtype; raises ValueError for masked numbers, for rows of unequal length, and for an
    object that refuses to be an array."""
    values = unmasked(values, name)
    try:
        return np.asarray(values)
    except ValueError:
        hint = "; pass clouds of unequal size one by one" if unequal(values) else ""
        raise ValueError(f"{name}: rows of unequal length do not make an array{hint}") from None
    except (TypeError, RuntimeError) as error:  # the object's own, such as a tensor's on a graphics card
        raise ValueError(f"{name}: {type(values).__name__} gives no array: {error}") from error


def numbers(values: ArrayLike, name: str, text: str = "") -> FloatArray:
    """`values` as a float64 array; infinity and NaN pass. `text` goes into the message if a text or path was given."""
    a = array(values, name)
    if a.dtype.kind not in "iuf":
        raise ValueError(f"{name}: expected real numbers, got {_description(values, a, text)}")
    return a.astype(np.float64, copy=False)


def copied(values: ArrayLike, name: str) -> FloatArray:
    """`values` as a read-only float64 copy."""
    own: FloatArray = np.array(numbers(values, name), order="C")
    own.flags.writeable = False
    return own


def unequal(values: object) -> TypeGuard[Sequence[ArrayLike]]:
    """Whether this is a list of clouds (n, d) that differ in n, and so do not fit in one array."""
    if not isinstance(values, list | tuple):
        return False
    counts = set()
    for cloud in values:
        try:
            shape = np.shape(cloud)
        except ValueError:
            return False
        if len(shape) != 2:  # such as a row of a single cloud
            return False
        counts.add(shape[0])
    return len(counts) > 1


def _description(values: object, a: AnyArray, text: str) -> str:
    """What was given instead of numbers, and how to convert it."""
    if isinstance(values, str | bytes | PathLike):
        return f"{type(values).__name__}{text}"
    if a.dtype.names:
        return f"dtype {a.dtype}; stack its fields, numpy.stack([a[f] for f in a.dtype.names], axis=-1)"
    if a.dtype.kind == "O" and any(isinstance(entry, list | tuple | np.ndarray) for entry in a.flat):
        return f"dtype {a.dtype}, an array of sequences; list(…) makes a list of clouds of it"
    if a.dtype.kind in "USO":
        is_sequence = a.ndim and isinstance(values, list | tuple | np.ndarray)
        if is_sequence:
            return f"dtype {a.dtype}; .astype(float) makes numbers of them"
        return f"{type(values).__name__}{_where(a)}"
    return f"dtype {a.dtype}; .astype(float) makes numbers of it" if a.dtype.kind == "b" else f"dtype {a.dtype}"


def _where(a: AnyArray) -> str:
    """The place of a table's first entry that is not a number, such as a data frame's text; empty if there is none."""
    entries = np.ndenumerate(a) if a.ndim == 2 else ()
    for (row, column), entry in entries:
        if not isinstance(entry, int | float | np.number):
            return f", where row {row}, column {column} is {reprlib.repr(entry)}"
    return ""


def finite(a: FloatArray, name: str, hint: str = "") -> FloatArray:
    """Return `a` if every number is finite, else raise ValueError, its message ended by `hint`."""
    bad = a.size - int(np.count_nonzero(np.isfinite(a)))
    if bad:
        subject = f"{a.item():g} is" if a.size == 1 else f"{bad} of {a.size} numbers {'is' if bad == 1 else 'are'}"
        raise ValueError(f"{name}: {subject} not finite{hint}")
    return a


def moderate(a: FloatArray, name: str, hint: str = "") -> FloatArray:
    """Return `a` if every number is finite and none exceeds `LARGEST`, else raise ValueError, `hint` as in `finite`."""
    # One pass: NaN fails every comparison, so `not (max <= LARGEST)` catches NaN,
    # infinity and numbers whose squares would overflow.
    if a.size and not np.abs(a).max() <= LARGEST:
        finite(a, name, hint)
        raise ValueError(f"{name}: beyond {LARGEST:g} squares overflow, but there is {np.abs(a).max():.3g}")
    return a
