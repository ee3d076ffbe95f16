"""The two objectives over translations as terrain: fields to draw, and descents on them from many starts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from solvers.methods.mmd.capped_landscape import CappedField, capped_field
from solvers.methods.mmd.landscape import MmdField, Path, mmd_field
from solvers.numerics.fourier_features import unit_frequencies
from solvers.scenes.rooms import Scene
from widgets.drawing.picture import Array, Segments
from widgets.figures.landscape.contours import contours
from widgets.parts.field import STRIDE, Field

Objective = Literal["mmd", "capped"]
SQUARES = 2**11  # of the capped field: few enough to make in a tenth of a frame, and queries are hardly slower
LINES = 8  # intervals between contour lines over the colour scale
TOPS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)


@dataclass(frozen=True, eq=False)
class Terrain:
    """What is minimised over translations, with the source's rotation true. Everything is computed on first use.

    length: ℓ, u. count: D. draw: the seed of the frequencies. cap: τ, u.
    """

    scene: Scene
    objective: Objective
    length: float
    count: int
    draw: int
    cap: float
    window: tuple[float, float, float, float]
    bands: int

    @cached_property
    def mmd(self) -> MmdField:
        """‖mean φ(x + t) − mean φ(y)‖² over t."""
        frequencies = unit_frequencies(np.array([self.draw]), self.count, 2)[0] / self.length
        return mmd_field(self.turned, self.scene.target, frequencies)

    @cached_property
    def capped(self) -> CappedField:
        """The mean of min(squared distance to the nearest, τ²) over t."""
        return capped_field(self.turned, self.scene.target, self.cap, squares=SQUARES)

    @property
    def turned(self) -> Array:
        """The source points with the true rotation."""
        return np.asarray(self.scene.source @ self.scene.truth.R.T)

    @property
    def chosen(self) -> MmdField | CappedField:
        """The objective that is drawn and minimised."""
        return self.mmd if self.objective == "mmd" else self.capped

    @cached_property
    def field(self) -> Field:
        """The chosen objective over the window."""
        return Field(lambda x, y: self.chosen.grid(x, y), self.window, bands=self.bands)

    @cached_property
    def top(self) -> float:
        """The top of the colour scale, which begins at 0: the first round value that the coarse map does not exceed."""
        highest = float(self.field.values(0).max())
        return next((top for top in TOPS if highest <= top), TOPS[-1])

    @cached_property
    def coarse_lines(self) -> Segments:
        """Contour lines of the coarse lattice."""
        middle = slice(STRIDE // 2, None, STRIDE)
        return self._lines(self.field.values(0), self.field.x[middle], self.field.y[middle])

    @cached_property
    def lines(self) -> Segments:
        """Contour lines of the full lattice."""
        return self._lines(self.field.values(self.bands), self.field.x, self.field.y)

    def _lines(self, values: Array, x: Array, y: Array) -> Segments:
        a, b = contours(values, x, y, [self.top * k / LINES for k in range(1, LINES)])
        return Segments(a, b, "ink", weight=np.full(len(a), 0.3))


@dataclass(frozen=True, eq=False)
class Descent:
    """Runs that began together, at starts (k, 2): computed once, on first use."""

    terrain: Terrain
    starts: Array

    @cached_property
    def path(self) -> Path:
        """Levenberg-Marquardt on MMD², gated ICP on the capped distances; translations only."""
        return self.terrain.chosen.path(self.starts)

    @property
    def ends(self) -> Array:
        """Where the runs ended, (k, 2)."""
        return np.asarray(self.path.points[-1])

    def way(self, i: int) -> Array:
        """The course of one run (n, 2), from its start to its end."""
        return np.asarray(self.path.points[: int(self.path.steps[i]) + 1, i])


def minima(values: Array) -> int:
    """How many nodes of a lattice are lower than all eight around them."""
    middle = values[1:-1, 1:-1]
    rows, columns = values.shape
    low = np.ones(middle.shape, dtype=np.bool_)
    for i in range(3):
        for j in range(3):
            if (i, j) != (1, 1):
                low &= middle < values[i : rows - 2 + i, j : columns - 2 + j]
    return int(low.sum())


def places(ends: Array, apart: float) -> int:
    """How many distinct places the ends (k, 2) are at; an end closer than `apart` to an earlier place is not new."""
    distinct: list[Array] = []
    for end in ends:
        if all(np.hypot(*(end - place)) >= apart for place in distinct):
            distinct.append(end)
    return len(distinct)
