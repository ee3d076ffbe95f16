"""Taking problems out of a batch and putting them back: plain functions on frozen
dataclasses of arrays.

Every array field has the problems as its leading axis b; a nested dataclass (a Pose,
say) and a tuple are followed into; anything else (None, a number, a text) is shared by
all problems and left alone. Two kinds of field are declared: `field(metadata=CONSTANT)`
and `field(metadata=SHARED)`. A field keeps its dtype and its trailing shape throughout
a run; what varies in number (the cells of a grid, the pairs kept) is padded or masked.

An array that all problems share (by `np.broadcast_to`, such as one cloud with many
starts) stays one: its rows are not copied, and `once` computes what depends on it once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from solvers.core.arrays import AnyArray, BoolArray, IntArray
from solvers.core.pose import Pose

A = TypeVar("A")
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
    """A copy of `whole` in which the problems `rows` are those of `part`.

    Raises TypeError, naming the field, when a field has changed its dtype or its
    trailing shape.
    """
    return _put(whole, rows, part, type(whole).__name__)  # type: ignore[no-any-return]


def once(make: Callable[[A], T], batch: A) -> T:
    """`make(batch)`, for a `make` that treats each problem by itself. If all problems share
    one array, as one cloud with many starts does, it is called once and they share the result.
    """
    count = _repeats(batch)
    if count < 2:
        return make(batch)
    return _spread(make(_take(batch, slice(1))), count)  # type: ignore[no-any-return]


def distinct(values: AnyArray) -> AnyArray:
    """An array (b, …) without its repeats: one row if all problems share it, else unchanged."""
    return values[:1] if len(values) > 1 and values.strides[0] == 0 else values


def uneven(state: object, count: int) -> tuple[str, tuple[int, ...]] | None:
    """The name and the shape of an array field that does not hold one entry for each of `count` problems, if any."""
    for name in _plan(type(state))[0]:  # type: ignore[arg-type]
        value = state.__dict__[name]
        if isinstance(value, np.ndarray) and value.shape[:1] != (count,):
            return name, value.shape
    return None


def changed(state: T, **values: Any) -> T:
    """`dataclasses.replace` for a state, whose fields need no checks: it skips
    `__init__`, which costs more than the rest of a small step.
    """
    new = object.__new__(type(state))
    new.__dict__.update(state.__dict__)
    new.__dict__.update(values)
    return new


@cache
def _plan(kind: type) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The fields of a dataclass that are taken, and those that are put back."""
    if not is_dataclass(kind):
        return (), ()
    of = fields(kind)
    names = tuple(f.name for f in of if not f.metadata.get("shared"))
    return names, tuple(f.name for f in of if not f.metadata.get("constant"))


def _repeats(value: Any) -> int:
    """How many problems share all arrays of a batch; 0 if any array has rows of its own."""
    if isinstance(value, np.ndarray):
        return len(value) if value.strides[0] == 0 else 0
    parts = [part for part in value.__dict__.values() if part is not None]
    return min(map(_repeats, parts), default=0)


def _spread(value: Any, count: int) -> Any:
    """A batch of one problem, repeated `count` times without copying."""
    if isinstance(value, np.ndarray):
        return np.broadcast_to(value, (count, *value.shape[1:]))
    names, _ = _plan(type(value))  # type: ignore[arg-type]
    return changed(value, **{k: _spread(value.__dict__[k], count) for k in names}) if names else value


def _take(value: Any, rows: Any) -> Any:
    if isinstance(value, np.ndarray):
        first = distinct(value)
        if first is value:
            return value[rows]
        # Rows of a shared array are that array: nothing is copied.
        return np.broadcast_to(first, (len(np.arange(len(value))[rows]), *value.shape[1:]))
    if isinstance(value, tuple):
        return tuple(_take(item, rows) for item in value)
    if isinstance(value, Pose):
        return Pose.trusted(value.R[rows], value.t[rows], np.asarray(value.scale)[rows])
    names, _ = _plan(type(value))  # type: ignore[arg-type]
    if not names:
        return value
    own = value.__dict__
    return changed(value, **{name: _take(own[name], rows) for name in names})


def _put(whole: Any, rows: Any, part: Any, name: str) -> Any:
    if isinstance(whole, np.ndarray):
        if not isinstance(part, np.ndarray) or part.dtype != whole.dtype or part.shape[1:] != whole.shape[1:]:
            raise TypeError(f"{name}: was {_kind(whole)} per problem and has become {_kind(part)}")
        out = whole.copy()
        out[rows] = part
        return out
    if isinstance(whole, tuple):
        return tuple(_put(a, rows, b, f"{name}[{k}]") for k, (a, b) in enumerate(zip(whole, part, strict=True)))
    if isinstance(whole, Pose):
        parts = (_put(getattr(whole, k), rows, getattr(part, k), f"{name}.{k}") for k in ("R", "t", "scale"))
        return Pose.trusted(*parts)
    _, back = _plan(type(whole))  # type: ignore[arg-type]
    if back:
        own, new = whole.__dict__, part.__dict__
        return changed(whole, **{k: _put(own[k], rows, new[k], f"{name}.{k}") for k in back})
    if (whole is None) != (part is None):
        raise TypeError(f"{name}: was {_kind(whole)} and has become {_kind(part)}")
    return whole


def _kind(value: Any) -> str:
    return f"{value.dtype}{list(value.shape[1:])}" if isinstance(value, np.ndarray) else type(value).__name__
