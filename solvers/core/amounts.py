"""Counts with their nouns, for messages."""

from __future__ import annotations


def amount(count: int, one: str, several: str = "") -> str:
    """A count with its noun in the singular or plural; `several` is the plural if it is not `one` with an s."""
    return f"{count:,} {one if count == 1 else several or f'{one}s'}"
