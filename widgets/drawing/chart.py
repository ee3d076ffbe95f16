"""Small charts: a Panel in data coordinates, with ticks, axis names and a mark at the current value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from widgets.drawing.picture import (
    SUPERSCRIPT,
    Anchor,
    Array,
    Label,
    Mark,
    Panel,
    Path,
    Points,
    Role,
    Segments,
    View,
    number,
    small,
)

PAD = (46.0, 28.0, 14.0, 40.0)  # the name of the y axis is above the window, where no grid line crosses it
ABOVE = 10.0  # px from the window's top up to that name's baseline
WIDTH = 320.0  # px, of a chart in a column
LINE = 16.0  # px between the baselines of two names
LETTER = 7.0  # px, the approximate width of a letter
DECADES = 6  # most that are labelled
SPANS = (8, 16)  # steps at which an axis of steps may end, so that a short run fills it


@dataclass(frozen=True, eq=False)
class Series:
    """One line of a chart: x and y (n,); NaN leaves a gap. `name` is written at its last value."""

    x: ArrayLike
    y: ArrayLike
    role: Role
    name: str = ""
    dashed: bool = False
    dots: bool = False


@dataclass(frozen=True)
class Axis:
    """An axis: its label and its range, in the values of the series.

    ticks: (place, text) of each tick, instead of round values, for an axis that is labelled with something else.
    log: values are clipped to the range and drawn at their decimal logarithms; the places of `ticks` are logarithms.
    """

    label: str
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...] = ()
    log: bool = False

    def placed(self, values: ArrayLike) -> Array:
        """The places along the axis at which values are drawn."""
        raw = np.asarray(values, dtype=float)
        return np.log10(np.clip(raw, self.low, self.high)) if self.log else raw

    @property
    def ends(self) -> tuple[float, float]:
        """The places at which the axis begins and ends."""
        low, high = self.placed([self.low, self.high])
        return float(low), float(high)

    def words(self) -> tuple[list[float], list[str]]:
        """The places of the axis's ticks, and the text of each."""
        if self.ticks:
            return [at for at, _ in self.ticks], [name for _, name in self.ticks]
        if self.log:
            exponents = decades(*self.ends)
            return exponents, powers(exponents)
        round_values = ticks(*self.ends)
        return round_values, [_tick(value) for value in round_values]


def steps_axis(taken: int, most: int) -> tuple[int, Axis]:
    """The span of an axis that holds the steps taken, `most` at most, and that axis. Places along it are fractions of
    the span, so that the panel's window does not change.
    """
    span = next((span for span in SPANS if taken <= span), most)
    return span, Axis("step", 0.0, 1.0, tuple((i / 4, f"{i * span / 4:.0f}") for i in range(5)))


def chart(
    name: str,
    label: str,
    series: Sequence[Series],
    x: Axis,
    y: Axis,
    *,
    now: float | None = None,
    size: tuple[float, float] = (WIDTH, 200.0),
    caption: str = "",
) -> Panel:
    """A line chart. now: the place along x, as drawn, of a dashed vertical line; size: width and height, px."""
    view, around = _frame(x, y, size)
    marks: list[Mark] = [*around]
    if now is not None:
        marks.append(Segments([now, view.y0], [now, view.y1], "guide", dashed=True))
    lines: list[tuple[Series, Array]] = []
    for one in series:
        xy = np.stack([x.placed(one.x), y.placed(one.y)], axis=1)
        marks += [Path(part, one.role, dashed=one.dashed, thick=True) for part in _unbroken(xy)]
        finite = xy[~np.isnan(xy).any(axis=1)]
        if one.dots and len(finite):
            marks.append(Points(finite, one.role, radius=2.5))
        if len(finite):
            lines.append((one, finite))
    marks += _end_names(view, lines, PAD[0] + LETTER * len(y.label))
    return Panel(name, label, view, tuple(marks), grid=False, caption=caption)


@lru_cache(maxsize=64)
def _frame(x: Axis, y: Axis, size: tuple[float, float]) -> tuple[View, tuple[Mark, ...]]:
    """A chart without its lines. Equal axes give the same object, so that the host renders it once."""
    view = View(*x.ends, *y.ends, *size, PAD)
    (xs, x_names), (ys, y_names) = x.words(), y.words()
    return view, (*axes(view, xs, ys, y_names, x_names=x_names), *axis_names(view, x.label, y.label))


def _unbroken(xy: Array) -> list[Array]:
    """The runs of xy (n, 2) without NaN that have at least two points."""
    gaps = np.flatnonzero(np.isnan(xy).any(axis=1))
    parts = np.split(xy, gaps)
    runs = [part if i == 0 else part[1:] for i, part in enumerate(parts)]
    return [run for run in runs if len(run) > 1]


@dataclass(frozen=True)
class _EndName:
    """A name at a line's end: its left and right in px, the baseline it would like, and the highest it may have."""

    label: Label
    left: float
    right: float
    height: float
    top: float


def _end_names(view: View, lines: list[tuple[Series, Array]], label_end: float) -> list[Mark]:
    """Each line's name at its last value, to the right of it if there is room: above it, below it if only there it
    covers no line, and a line higher if two would meet.

    lines: each series with its places (n, 2). label_end: px to the end of the y axis's name; a line's name that would
    meet it goes below its value.
    """
    drawn = [view.px(xy) for _, xy in lines]
    floor = float(view.px([[view.x0, view.y0]])[0, 1])
    names = []
    for (one, places), line in zip(lines, drawn, strict=True):
        if not one.name:
            continue
        x, y = (float(v) for v in line[-1])
        across = LETTER * len(one.name)
        anchor: Anchor = "end" if x + 4 + across > view.width else "start"
        begins = x - across if anchor == "end" else x
        top = LINE if begins > label_end else PAD[1] - ABOVE + LINE
        above, below = y - 7, y + LINE
        covers = [_meets(drawn, begins, begins + across, baseline) for baseline in (above, below)]
        is_better_below = below + 3 <= floor and covers == [True, False]
        height = above if above >= top and not is_better_below else below
        label = Label(places[-1], one.name, one.role, anchor, dx=-4 if anchor == "end" else 4, dy=-y)
        names.append(_EndName(label, begins, begins + across, height, top))
    names.sort(key=lambda name: -name.height)
    heights = _apart(names)
    return [replace(name.label, dy=name.label.dy + height) for name, height in zip(names, heights, strict=True)]


def _meets(lines: Sequence[Array], left: float, right: float, baseline: float) -> bool:
    """Whether a line, px (n, 2) with x rising, passes through a name's letters."""
    x = np.linspace(left, right, 17)
    y = np.stack([np.interp(x, line[:, 0], line[:, 1], left=np.nan, right=np.nan) for line in lines])
    return bool(((y > baseline - 11.0) & (y < baseline + 3.0)).any())


def _apart(names: Sequence[_EndName]) -> list[float]:
    """Baselines, lowest on the screen first, moved up until no two names that overlap across are closer than a line.

    A name that would be above its top is moved down again, with all those below it.
    """
    spread = [name.height for name in names]
    near = [
        [j for j, other in enumerate(names) if one.left < other.right and other.left < one.right] for one in names
    ]
    for i in range(len(names)):
        spread[i] = min([spread[i], *(spread[j] - LINE for j in near[i] if j < i)])
    for i in reversed(range(len(names))):
        spread[i] = max([spread[i], names[i].top, *(spread[j] + LINE for j in near[i] if j > i)])
    return spread


def axes(
    view: View,
    xs: Sequence[float],
    ys: Sequence[float],
    y_names: Sequence[str],
    right: float | None = None,
    x_names: Sequence[str] | None = None,
) -> list[Mark]:
    """The two axes with their ticks, and a faint line at each of `ys`; the x axis ends at `right` or with the window.

    x_names: the text for each of `xs`, instead of its value.
    """
    below = [_tick(x) for x in xs] if x_names is None else x_names
    end = view.x1 if right is None else right
    frame = Path([[view.x0, view.y1], [view.x0, view.y0], [end, view.y0]], "guide")
    across = Segments([[view.x0, y] for y in ys], [[end, y] for y in ys], "guide", weight=[0.3] * len(ys))
    return [
        across,
        frame,
        *(Label([x, view.y0], name, "guide", "middle", dy=15) for x, name in zip(xs, below, strict=True)),
        *(Label([view.x0, y], name, "guide", "end", dx=-6, dy=4) for y, name in zip(ys, y_names, strict=True)),
    ]


def axis_names(view: View, x_label: str, y_label: str, right: float | None = None) -> list[Mark]:
    """The names of the axes, that of y above the window, where no grid line crosses it."""
    return [
        Label([view.x1 if right is None else right, view.y0], x_label, "guide", "end", dy=32),
        Label([view.x0, view.y1], y_label, "guide", "start", dy=-ABOVE),
    ]


def ticks(low: float, high: float, about: int = 4) -> list[float]:
    """Round values within [low, high], about `about` of them."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(m for m in (1, 2, 5, 10) if m * power >= raw * (1 - 1e-9))
    first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
    return [float(v) for v in np.round(np.arange(first, last + 1) * step, 10)]


def decades(low: float, high: float) -> list[float]:
    """Whole exponents within [low, high], only every second or third if there are many."""
    first, last = np.ceil(low - 1e-9), np.floor(high + 1e-9)
    return [float(v) for v in np.arange(first, last + 1, max(1.0, np.ceil((last - first + 1) / DECADES)))]


def powers(exponents: Sequence[float]) -> list[str]:
    """Powers of ten written out, or all as powers if one of them would be too long."""
    if all(-3 <= e <= 3 for e in exponents):
        return [_tick(10.0**e) for e in exponents]
    return ["1" if e == 0 else "10" + str(round(e)).translate(SUPERSCRIPT) for e in exponents]


def _tick(value: float) -> str:
    if 1e-12 < abs(value) < 1e-4:
        return ("−" if value < 0 else "") + small(abs(value))
    return number(value, next((d for d in range(4) if abs(round(value, d) - value) < 1e-9), 4))
