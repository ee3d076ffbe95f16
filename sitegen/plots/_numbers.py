"""Lookups by name or value, for the numbers that chapters take from plots."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from sitegen.problems import hint


def at(values: Collection[Any], value: Any, label: str) -> int:
    """The index of a value among others. Raises ValueError that names the known ones."""
    if value in values:
        return list(values).index(value)
    if isinstance(value, str):
        raise ValueError(f"{label}: unknown {value!r}{hint(value, values)}")
    raise ValueError(f"{label}: expected one of {', '.join(f'{v:g}' for v in values)}; got {value!r}")
