"""Success rates over seeds, with their intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from solvers import Pose
from solvers.metrics import rre, rte
from solvers.scenes.rooms import Scene
from solvers.studies.benchmark import is_close

Interval = tuple[float, float]

Z = 1.959964
"""The standard normal's quantile at 97.5 %."""


def wilson(hits: int, of: int) -> Interval:
    """Wilson's score interval of a rate from `hits` in `of` tries, at 95 % (Wilson 1927)."""
    rate, more = hits / of, Z * Z / of
    middle = (rate + more / 2.0) / (1.0 + more)
    half = Z / (1.0 + more) * math.sqrt(rate * (1.0 - rate) / of + more / (4.0 * of))
    return (0.0 if hits == 0 else max(0.0, middle - half), 1.0 if hits == of else min(1.0, middle + half))


def percent(rate: float) -> str:
    """A rate as words print it."""
    value = 100.0 * rate
    return f"{value:.0f} %" if value >= 9.95 or value == round(value) else f"{value:.1f} %"


def close(pose: Pose, truth: Pose) -> int:
    """How many of the poses are near the truth: below 5° and below 0.2 u, as in the race."""
    return int(np.count_nonzero(is_close(np.degrees(rre(pose, truth)), rte(pose, truth))))


def clouds(scenes: Sequence[Scene]) -> tuple[np.ndarray, np.ndarray]:
    """The sources and the targets of scenes of one size, each (k, n, 2)."""
    return np.stack([scene.source for scene in scenes]), np.stack([scene.target for scene in scenes])


def span(counts: Sequence[int]) -> str:
    """The least and the largest of some counts, once where they are one."""
    return f"{min(counts)} to {max(counts)}" if min(counts) < max(counts) else str(counts[0])


def interval(hits: int, of: int) -> str:
    """A rate with its interval, as tables print it."""
    low, high = wilson(hits, of)
    return f"{100 * hits / of:.0f} % ({100 * low:.0f} to {100 * high:.0f} %)"
