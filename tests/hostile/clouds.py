"""Seeded clouds that no scanner produces: few points, one place, one line, one cell, far apart, in any unit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

SIZES = (1, 2, 3, 4, 5, 6, 6, 8, 12, 40)
UNITS = (1e-300, 1e-200, 1e-150, 1e-100, 1e-30, 1e-12, 1e-6, 1e-3, 1.0, 1.0, 1e3, 1e6, 1e12, 1e30, 1e75, 1e100, 1e149)
READABLE = (1e-8, 1e-6, 1e-3, 1.0, 1.0, 1.0, 1e3, 1e6, 1e9)
APART = (0.0, 0.0, 0.0, 0.1, 1.0, 3.0, 10.0, 1e3, 1e6, 1e9, 1e12)
LARGEST = 1e150  # the largest coordinate that solvers accept

Array = np.ndarray[tuple[int, int], np.dtype[np.float64]]


def cloud(rng: np.random.Generator, n: int, d: int) -> Array:
    """A cloud of one of eleven kinds: n points with d coordinates, about one unit wide."""
    base = rng.standard_normal((n, d))
    line = np.linspace(-1.0, 1.0, n)[:, None]
    kinds = (
        base,
        base,
        np.repeat(base[:1], n, axis=0),
        line * rng.standard_normal(d),
        line * np.eye(d)[0],
        line * np.eye(d)[0] + 1e-13 * base,
        base[rng.integers(0, max(1, n // 2), n)],
        1e-3 * base,
        np.round(base),
        np.where(rng.random((n, d)) < 0.3, 1e100, base),
        5e-324 * np.round(base),
    )
    return kinds[rng.integers(len(kinds))]


def pairs(seed: int, units: tuple[float, ...] = UNITS) -> Iterator[tuple[Array, Array]]:
    """An endless stream of source (m, d) and target (n, d), with d from 2 to 4: unrelated, equal, mirrored, side by
    side or worlds apart, and sometimes each in its own unit. In four dimensions there are at least four points, since
    fewer are refused as a transposed cloud."""
    rng = np.random.default_rng(seed)
    while True:
        d = int(rng.choice((2, 2, 2, 3, 4)))
        least = 4 if d == 4 else 1
        source, target = (cloud(rng, max(int(rng.choice(SIZES)), least), d) for _ in range(2))
        kinship = rng.random()
        if kinship < 0.4:
            target = source * (np.r_[-1.0, np.ones(d - 1)] if kinship < 0.1 else 1.0)
        unit = float(rng.choice(units))
        second = unit if rng.random() < 0.8 else float(rng.choice(units))
        shift = unit * float(rng.choice(APART)) * rng.standard_normal(d)
        with np.errstate(over="ignore", under="ignore"):
            source, target = unit * source, second * target + shift
        yield source.clip(-LARGEST, LARGEST), target.clip(-LARGEST, LARGEST)
