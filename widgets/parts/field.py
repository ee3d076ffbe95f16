"""A field over a window, computed only as finely as requested: a coarse lattice at once, the full one in bands.

Level 0 is a lattice of every `STRIDE`-th column and row; levels 1 … bands add the full lattice, band by band from the
top, with the coarse one still below; level `bands` is complete. Values are remembered, and the coarse ones are part of
the full lattice, so no value is computed twice and a level is the same however it was reached. A state holds its Field;
an action that does not change the field passes it on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from widgets.drawing.chart import ticks
from widgets.drawing.picture import Array, Heat, Label, Mark, Path, View, number
from widgets.drawing.svg import HEAT_LEVELS

STRIDE = 3
PAD = (54.0, 32.0, 80.0, 50.0)  # px around a field's window for its numbers and, at the right, the scale
BAR = (12.0, 26.0, 46.0)  # px from the window to the scale's left and right side, and from the latter to its name's end
Index = NDArray[np.int64]
Strong = Literal["high", "low"]


class Field:
    """Values at the centres of side × side tiles of a window (x0, x1, y0, y1).

    of: returns the values at all (x[i], y[j]), an array (len(y), len(x)), for any x and y; a row must not depend on
    other rows. side: a multiple of 3. bands: the number of slices for what is left after the coarse lattice.
    """

    def __init__(
        self,
        of: Callable[[Array, Array], Array],
        window: tuple[float, float, float, float],
        side: int = 63,
        bands: int = 4,
    ) -> None:
        if side % STRIDE:
            raise ValueError(f"side: expected a multiple of {STRIDE}, got {side}")
        self.window, self.side, self.bands = window, side, bands
        self.x, self.y = (a + (np.arange(side) + 0.5) * (b - a) / side for a, b in (window[:2], window[2:]))
        self._of = of
        self._values: Array = np.full((side, side), np.nan)
        self._level = -1
        self._heats: dict[tuple[str | float, ...], Heat] = {}  # the host does not render the same mark object twice

    @property
    def known(self) -> int:
        """The finest level already computed; 0 also if nothing is."""
        return max(self._level, 0)

    def values(self, level: int) -> Array:
        """The field at a level: (side / 3, side / 3) at level 0, (side, side) above, row 0 at y0."""
        for step in range(self._level + 1, level + 1):
            self._compute(step)
        self._level = max(self._level, level)
        middle = slice(STRIDE // 2, None, STRIDE)
        coarse = self._values[middle, middle]
        if level == 0:
            return coarse.copy()
        values = coarse.repeat(STRIDE, axis=0).repeat(STRIDE, axis=1)
        fine = self._edge(level)
        values[fine:] = self._values[fine:]
        return values

    def highest(self, level: int) -> tuple[Array, float]:
        """The place (2,) of a level's highest value, and that value. NaN counts as lowest."""
        values = np.nan_to_num(self.values(level), nan=-np.inf)
        # Rounded, so that ties are broken the same way natively and in the browser.
        row, column = np.unravel_index(int(np.argmax(np.round(values, 9))), values.shape)
        if level == 0:
            row, column = STRIDE * row + STRIDE // 2, STRIDE * column + STRIDE // 2
        elif row < self._edge(level):  # a tile of a coarse block: take the block's middle, where its value was computed
            row, column = row // STRIDE * STRIDE + STRIDE // 2, column // STRIDE * STRIDE + STRIDE // 2
        return np.array([self.x[column], self.y[row]]), float(self._values[row, column])

    def heat(self, level: int, low: float, high: float, strong: Strong = "high") -> Heat:
        """The field's mark at a level, with its highest or its lowest values in the strongest colour."""
        key = strong, level, low, high
        if key not in self._heats:
            values = self.values(level)
            self._heats[key] = (
                Heat(values, self.window, low, high) if strong == "high" else Heat(-values, self.window, -high, -low)
            )
        return self._heats[key]

    def roots(self, level: int, high: float) -> Heat:
        """The mark of the values' square roots, from 0: it also separates low values, which fill most of the map."""
        key = "roots", level, high
        if key not in self._heats:
            self._heats[key] = Heat(np.sqrt(np.fmax(self.values(level), 0.0)), self.window, 0.0, np.sqrt(high))
        return self._heats[key]

    def _edge(self, level: int) -> int:
        """The lowest row of the full lattice at a level, a multiple of 3."""
        coarse = self.side // STRIDE
        return STRIDE * (coarse - coarse * level // self.bands)

    def _compute(self, level: int) -> None:
        """Compute what a level adds to the one before, without the coarse values again."""
        columns = rows = np.arange(self.side)
        coarse_columns = columns % STRIDE == STRIDE // 2
        if level == 0:
            self._put(columns[coarse_columns], rows[coarse_columns])
            return
        band = rows[self._edge(level) : self._edge(level - 1)]
        coarse_rows = band % STRIDE == STRIDE // 2
        self._put(columns[~coarse_columns], band[coarse_rows])
        self._put(columns, band[~coarse_rows])

    def _put(self, columns: Index, rows: Index) -> None:
        if len(rows):
            self._values[np.ix_(rows, columns)] = self._of(self.x[columns], self.y[rows])


@cache
def scale_marks(
    view: View, span: tuple[float, float], name: str, decimals: int = 1, strong: Strong = "high", roots: bool = False
) -> tuple[Mark, ...]:
    """The bar of a field's colours with its numbers, in the padding at the right of the view, with `name` above it.

    span: the least and the greatest value. roots: colours follow the square roots of values, and so do the places of
    numbers.

    Returns the same objects each time, so that the host does not render them again.
    """
    low, high = span

    def across(px: float) -> float:
        return view.x1 + px / view.scale

    def up(value: float) -> float:
        part = (value - low) / (high - low)
        return view.y0 + (view.y1 - view.y0) * (part**0.5 if roots else part)

    left, right, window = across(BAR[0]), across(BAR[1]), (across(BAR[0]), across(BAR[1]), view.y0, view.y1)
    steps = (np.arange(HEAT_LEVELS) + 0.5) / HEAT_LEVELS
    steps = steps if strong == "high" else 1.0 - steps
    rim = [[left, view.y0], [right, view.y0], [right, view.y1], [left, view.y1]]
    marks: list[Mark] = [Heat(steps[:, None], window, 0.0, 1.0), Path(rim, "guide", closed=True)]
    for v in ticks(low, high):  # the top one a little lower, since the name comes close to it on a phone
        dy = 4.0 if v < high else 11.0
        marks.append(Label([right, up(v)], number(v, decimals), "guide", dx=7, dy=dy))
    return (*marks, Label([right, view.y1], name, "guide", "end", dx=BAR[2], dy=-10))


@cache
def axis_marks(view: View, x_label: str, y_label: str) -> tuple[Mark, ...]:
    """A frame around a field's window, numbers along its left and lower side, and the names of both axes."""
    rim = [[view.x0, view.y0], [view.x1, view.y0], [view.x1, view.y1], [view.x0, view.y1]]
    marks: list[Mark] = [Path(rim, "guide", closed=True)]
    for x in ticks(view.x0, view.x1):
        marks.append(Label([x, view.y0], number(x, 1), "guide", "middle", dy=20))
    for y in ticks(view.y0, view.y1):
        marks.append(Label([view.x0, y], number(y, 1), "guide", "end", dx=-8, dy=4))
    return (
        *marks,
        Label([view.x1, view.y0], x_label, "guide", "end", dy=44),
        Label([view.x0, view.y1], y_label, "guide", dy=-10),
    )


def within(line: Array, window: tuple[float, float, float, float]) -> list[Array]:
    """The parts of a polyline (n, 2) inside the window, cut at its border, each (k, 2) with k ≥ 2."""
    low, high = np.array([window[0], window[2]]), np.array([window[1], window[3]])
    a, step = line[:-1], np.diff(line, axis=0)
    safe = np.where(step == 0.0, 1.0, step)
    to = np.stack([(low - a) / safe, (high - a) / safe])
    constant = step == 0.0
    inside = constant & (a >= low) & (a <= high)
    enter = np.where(constant, np.where(inside, 0.0, 2.0), to.min(axis=0)).max(axis=1).clip(0.0, None)
    leave = np.where(constant, 1.0, to.max(axis=0)).min(axis=1).clip(None, 1.0)
    parts: list[list[Array]] = []
    for k in np.flatnonzero(enter < leave):
        if not parts or enter[k] > 0.0 or not np.array_equal(parts[-1][-1], a[k]):
            parts.append([a[k] + enter[k] * step[k]])
        parts[-1].append(a[k] + leave[k] * step[k] if leave[k] < 1.0 else line[k + 1])
    return [np.array(part) for part in parts]
