"""Lookups by name or value, for the numbers that chapters take from plots."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from sitegen.problems import hint


def at(values: Collection[Any], value: Any, what: str) -> int:
    """The index of a value among others. Raises ValueError that names the known ones."""
    if value in values:
        return list(values).index(value)
    if isinstance(value, str):
        raise ValueError(f"{what}: unknown {value!r}{hint(value, values)}")
    raise ValueError(f"{what}: expected one of {', '.join(f'{each:g}' for each in values)}; got {value!r}")
