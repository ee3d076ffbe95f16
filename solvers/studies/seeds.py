"""The seeds of the race and of the studies: 40, 53, 66 …"""

from __future__ import annotations


def seeds(count: int) -> tuple[int, ...]:
    """The first `count` seeds. With 25, `solvers.race.SEEDS`."""
    return tuple(40 + 13 * k for k in range(count))
