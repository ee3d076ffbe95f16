"""What is not of the kind that a function works on is refused here, by a ValueError that names the argument."""

from __future__ import annotations

from typing import TypeVar

_Kind = TypeVar("_Kind")
_WAYS = {"Pose": "; Pose.from_matrix makes one of a matrix, and result.pose is a result's"}


def of_kind(value: object, kind: type[_Kind], name: str) -> _Kind:
    """`value` when it is of this class."""
    if not isinstance(value, kind):
        way = _WAYS.get(kind.__name__, "")
        raise ValueError(f"{name}: expected a {kind.__name__}, got {type(value).__name__}{way}")
    return value
