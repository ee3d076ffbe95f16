"""What is not of the kind that a function works on is refused here, by a ValueError that names the argument."""

from __future__ import annotations

from typing import TypeVar

from solvers.core.pose import Pose

_Kind = TypeVar("_Kind")


def of_kind(value: object, kind: type[_Kind], name: str) -> _Kind:
    """`value` when it is of this class."""
    if not isinstance(value, kind):
        way = "; Pose.from_matrix makes one of a matrix, and result.pose is a result's" if kind is Pose else ""
        raise ValueError(f"{name}: expected a {kind.__name__}, got {type(value).__name__}{way}")
    return value
