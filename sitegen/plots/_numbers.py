"""Numbers that chapters ask a plot for, by name and value."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from sitegen.problems import hint


def at(values: Collection[Any], value: Any, what: str) -> int:
    """Where a value stands among others. Raises ValueError that names those that there are."""
    if value in values:
        return list(values).index(value)
    if isinstance(value, str):
        raise ValueError(f"{what}: no {value!r}{hint(value, values)}")
    raise ValueError(f"{what}: {value!r} is none of {', '.join(f'{each:g}' for each in values)}")
