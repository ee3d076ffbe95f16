"""The race on a thousand seeds: success of nine methods in six settings, and errors with their intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sitegen.plots._numbers import at
from sitegen.plots._rates import interval, wilson
from sitegen.plots._sizes import sizes
from sitegen.plots._sweep import LABELS, hits, read

TITLE = "The race on a thousand seeds: success of nine methods in six settings"
READS = ("content/data/sweep/table.json",)
SIZES = sizes(312, 860)

NAMES = {
    "clean": "Clean", "noise": "Noise", "gradient": "Gradient", "striped": "Striped", "outliers": "Outliers",
    "combo": "Combo",
}  # fmt: skip


@dataclass(frozen=True)
class Result:
    """By method, then by setting. close: runs near the truth, out of `seeds`; the others: medians with bootstrap
    intervals (median, low, high)."""

    seeds: int
    methods: tuple[str, ...]
    settings: tuple[str, ...]
    close: tuple[tuple[int, ...], ...]
    rotation: tuple[tuple[tuple[float, ...], ...], ...]
    translation: tuple[tuple[tuple[float, ...], ...], ...]
    steps: tuple[tuple[tuple[float, ...], ...], ...]


def compute() -> Result:
    """Read the sweep's file."""
    data = read("table")
    settings = tuple(data["axes"]["setting"])
    rows = [[data["contestants"][method]["cells"][setting] for setting in settings] for method in LABELS]

    def all_of(name: str) -> tuple[tuple[tuple[float, ...], ...], ...]:
        return tuple(tuple(tuple(cell[name]) for cell in row) for row in rows)

    close = tuple(tuple(hits(cell["bits"]) for cell in row) for row in rows)
    return Result(data["seeds"], tuple(LABELS), settings, close, all_of("rre"), all_of("rte"), all_of("steps"))


def success(result: Result, method: str, setting: str) -> float:
    """The percentage of seeds that ended within 5° and 0.2 u of the truth."""
    return 100.0 * int(_of(result, result.close, method, setting)) / result.seeds


def rotation(result: Result, method: str, setting: str) -> float:
    """The median rotation error, degrees."""
    return float(_of(result, result.rotation, method, setting)[0])


def _of(result: Result, values: Any, method: str, setting: str) -> Any:
    return values[at(result.methods, method, "method")][at(result.settings, setting, "setting")]


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for i, setting in enumerate(result.settings):
        rates = [(row[i] / result.seeds, LABELS[m]) for row, m in zip(result.close, result.methods, strict=True)]
        high = [label for rate, label in rates if rate >= 0.95]
        low = [label for rate, label in rates if rate < 0.05]
        parts = [f"above 95 %: {', '.join(high) or 'none'}", f"below 5 %: {', '.join(low) or 'none'}"]
        clauses.append(f"{NAMES[setting].lower()}, {'; '.join(parts)}")
    return (
        f"Six charts, one for each setting of the room: the share of {result.seeds:,} seeds that ended within 5° "
        f"and 0.2 u of the truth, a row for each of nine methods, from 45° and 1.43 u; RANSAC ignores the start. "
        f"{'. '.join(part[0].upper() + part[1:] for part in clauses)}. The table lists all rates and median errors."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Success with Wilson's interval, medians with bootstrap intervals."""
    rows = []
    for setting in result.settings:
        for method in result.methods:
            rates = interval(_of(result, result.close, method, setting), result.seeds)
            turn, shift, steps = (
                _of(result, values, method, setting) for values in (result.rotation, result.translation, result.steps)
            )
            rows.append([NAMES[setting], LABELS[method], rates, _range(turn, 2), _range(shift, 3), _range(steps, 0)])
    heads = ["setting", "method", "near the truth", "median rotation error, °", "median translation error, u"]
    return [*heads, "median steps"], rows


def _range(values: tuple[float, ...], digits: int) -> str:
    middle, low, high = (f"{value:.{digits}f}" for value in values)
    return middle if low == high else f"{middle} ({low} to {high})"


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw rows of bars with their intervals, in a chart for each setting."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label

    wide = [(128 + 99 * i, 44, 84, 232) for i in range(6)]
    small = [(126 + 116 * (i % 2), 44 + 274 * (i // 2), 98, 214) for i in range(6)]
    boxes = zip(axes_in(figure, narrow, wide, small), result.settings, strict=True)
    for i, (axes, setting) in enumerate(boxes):
        axes.set_title(NAMES[setting], fontweight="bold", pad=10)
        for side in ("left", "bottom"):
            axes.spines[side].set_visible(False)
        axes.tick_params(length=0)
        axes.axvline(0.0, color=COLOURS["edge"], linewidth=1.0)
        for k, method in enumerate(result.methods):
            count = _of(result, result.close, method, setting)
            rate, (low, high) = count / result.seeds, wilson(count, result.seeds)
            axes.barh(k, rate, height=0.56, color=COLOURS["accent"], alpha=0.3)
            axes.hlines(k, low, high, color=COLOURS["accent"], linewidth=3.0, zorder=3)
            label(axes, high, k, f"{100 * rate:.0f}", dx=4, fontsize=12.0)
        first = i % 2 == 0 if narrow else i == 0
        axes.set_yticks(range(len(LABELS)), LABELS.values() if first else [""] * len(LABELS))
        axes.set(xlim=(0.0, 1.42), ylim=(len(LABELS) - 0.5, -0.5), xticks=[])
        if i == 0:
            label(axes, 0.0, len(LABELS) - 0.5, f"% of {result.seeds:,} seeds near the truth", "soft", dy=-14)
