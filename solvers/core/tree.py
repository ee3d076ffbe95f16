"""Taking problems out of a batch and putting them back: plain functions on frozen
dataclasses of arrays.

Every array field has the problems as its leading axis b; a nested dataclass (a Pose,
say) and a tuple are followed into; anything else (None, a number, a text) is shared by
all problems and left alone. Two kinds of field are declared: `field(metadata=CONSTANT)`
and `field(metadata=SHARED)`. A field keeps its dtype and its trailing shape throughout
a run; what varies in number (the cells of a grid, the pairs kept) is padded or masked.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from solvers.core.arrays import BoolArray, IntArray
from solvers.core.pose import Pose

T = TypeVar("T")


CONSTANT = MappingProxyType({"constant": True})
"""`field(metadata=CONSTANT)`: fixed when the run starts (the problem, a precomputed map). Taken, not put back."""

SHARED = MappingProxyType({"constant": True, "shared": True})
"""`field(metadata=SHARED)`: one value for all problems although it is a dataclass or a tuple (the options)."""


def take(tree: T, rows: IntArray | BoolArray) -> T:
    """The part of a state that belongs to the problems `rows` (indices or a mask over
    b).
    """
    return _take(tree, rows)  # type: ignore[no-any-return]


def put(whole: T, rows: IntArray | BoolArray, part: T) -> T:
    """A copy of `whole` in which the problems `rows` stand as in `part`.

    Raises TypeError, naming the field, when a field has changed its dtype or its
    trailing shape.
    """
    return _put(whole, rows, part, type(whole).__name__)  # type: ignore[no-any-return]


def _take(value: Any, rows: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value[rows]
    if isinstance(value, tuple):
        return tuple(_take(item, rows) for item in value)
    if isinstance(value, Pose):
        return Pose.trusted(value.R[rows], value.t[rows], np.asarray(value.scale)[rows])
    if is_dataclass(value) and not isinstance(value, type):
        return replace(
            value,
            **{f.name: _take(getattr(value, f.name), rows) for f in fields(value) if not f.metadata.get("shared")},
        )
    return value


def _put(whole: Any, rows: Any, part: Any, name: str) -> Any:
    if isinstance(whole, np.ndarray):
        if not isinstance(part, np.ndarray) or part.dtype != whole.dtype or part.shape[1:] != whole.shape[1:]:
            raise TypeError(f"{name}: was {_kind(whole)} a problem and has become {_kind(part)}")
        out = whole.copy()
        out[rows] = part
        return out
    if isinstance(whole, tuple):
        return tuple(_put(a, rows, b, f"{name}[{k}]") for k, (a, b) in enumerate(zip(whole, part, strict=True)))
    if isinstance(whole, Pose):
        parts = (_put(getattr(whole, k), rows, getattr(part, k), f"{name}.{k}") for k in ("R", "t", "scale"))
        return Pose.trusted(*parts)
    if is_dataclass(whole) and not isinstance(whole, type):
        return replace(
            whole,
            **{
                f.name: _put(getattr(whole, f.name), rows, getattr(part, f.name), f"{name}.{f.name}")
                for f in fields(whole)
                if not f.metadata.get("constant")
            },
        )
    if (whole is None) != (part is None):
        raise TypeError(f"{name}: was {_kind(whole)} and has become {_kind(part)}")
    return whole


def _kind(value: Any) -> str:
    return f"{value.dtype}{list(value.shape[1:])}" if isinstance(value, np.ndarray) else type(value).__name__
