"""Success rates over seeds, with their intervals."""

from __future__ import annotations

import math

SEEDS_FIRST, SEEDS_STEP = 40, 13

Interval = tuple[float, float]


def seeds(count: int) -> list[int]:
    """The site's seeds: 40, 53, 66 …"""
    return [SEEDS_FIRST + SEEDS_STEP * k for k in range(count)]


def wilson(hits: int, of: int, z: float = 1.959964) -> Interval:
    """Wilson's score interval of a rate from `hits` in `of` tries, by default at 95 % (Wilson 1927)."""
    rate, more = hits / of, z * z / of
    middle = (rate + more / 2.0) / (1.0 + more)
    half = z / (1.0 + more) * math.sqrt(rate * (1.0 - rate) / of + more / (4.0 * of))
    return (0.0 if hits == 0 else max(0.0, middle - half), 1.0 if hits == of else min(1.0, middle + half))


def percent(rate: float) -> str:
    """A rate as words print it."""
    shown = 100.0 * rate
    return f"{shown:.0f} %" if shown >= 9.95 or shown == round(shown) else f"{shown:.1f} %"
