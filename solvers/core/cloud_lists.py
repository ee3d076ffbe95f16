"""Lists of clouds of unequal size, which do not fit in one array and are processed one by one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

_Value = TypeVar("_Value")


def one_by_one(count: int, solve: Callable[[int], _Value]) -> list[_Value]:
    """The results of `solve(k)` for every cloud k of a list; the message of a ValueError that it raises names k."""
    results = []
    for k in range(count):
        try:
            results.append(solve(k))
        except ValueError as error:
            raise ValueError(f"cloud {k} of the list: {error}") from None
    return results


def ndim(value: Any) -> int:
    """The number of axes; −1 if rows of unequal length do not form an array."""
    try:
        return np.ndim(value)
    except ValueError:
        return -1
