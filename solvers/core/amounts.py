"""Counts and places in words, for messages."""

from __future__ import annotations

from math import floor, log10

from solvers.core.arrays import FloatArray


def amount(count: int, singular: str, plural: str = "") -> str:
    """A count with its noun in the singular or plural; `plural` may be left out if it is the singular with an s."""
    return f"{count:,} {singular if count == 1 else plural or f'{singular}s'}"


def place(point: FloatArray, radius: float) -> str:
    """A point's coordinates (d,): two decimals, or more if a hundredth of the cloud's radius is smaller than that."""
    decimals = max(2, 2 - floor(log10(radius)))
    return f"({', '.join(f'{x:.{decimals}f}' for x in point)})"
