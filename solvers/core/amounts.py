"""Counts with their nouns, for messages."""

from __future__ import annotations


def amount(count: int, singular: str, plural: str = "") -> str:
    """A count with its noun in the singular or plural; `plural` may be left out if it is the singular with an s."""
    return f"{count:,} {singular if count == 1 else plural or f'{singular}s'}"
