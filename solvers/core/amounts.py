"""How many of a thing there are, in words."""

from __future__ import annotations


def amount(count: int, one: str, several: str = "") -> str:
    """A count with its noun in the singular or the plural, `several` where that is not `one` with an s."""
    return f"{count:,} {one if count == 1 else several or f'{one}s'}"
