"""Success of nine methods against noise, outliers, overlap and density, one control at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sitegen.plots._numbers import at
from sitegen.plots._rates import wilson
from sitegen.plots._sizes import sizes
from sitegen.plots._sweep import LABELS, hits, read

TITLE = "Success of nine methods against noise, outliers, overlap and density"
READS = ("content/data/sweep/curves.json",)
SIZES = sizes(528, 664)

CONTROLS = {
    "noise": ("Noise σ", "u", 1.0),
    "outliers": ("Outliers", "%", 100.0),
    "overlap": ("Target seen", "%", 100.0),
    "density": ("Source density", "×", 1.0),
}
USUAL = {"noise": 0.02, "outliers": 0.0, "overlap": 1.0, "density": 1.0}


@dataclass(frozen=True)
class Result:
    """successes: by method, control and value; out of `seeds`."""

    seeds: int
    methods: tuple[str, ...]
    values: tuple[tuple[float, ...], ...]
    successes: tuple[tuple[tuple[int, ...], ...], ...]


def compute() -> Result:
    """Read the sweep's file."""
    data = read("curves")
    values = tuple(tuple(data["axes"][control]) for control in CONTROLS)
    successes = tuple(
        tuple(
            tuple(hits(data["contestants"][method]["cells"][f"{control} {value:g}"]["bits"]) for value in row)
            for control, row in zip(CONTROLS, values, strict=True)
        )
        for method in LABELS
    )
    return Result(data["seeds"], tuple(LABELS), values, successes)


def success(result: Result, method: str, control: str, value: float) -> float:
    """The percentage of seeds that ended within 5° and 0.2 u of the truth."""
    k = at(CONTROLS, control, "control")
    row = result.successes[at(result.methods, method, "method")][k]
    return 100.0 * row[at(result.values[k], value, "value")] / result.seeds


def seeds(result: Result) -> int:
    """The number of seeds behind each point."""
    return result.seeds


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for k, (control, (name, unit, factor)) in enumerate(CONTROLS.items()):
        worst = result.values[k][-1] if control != "density" else result.values[k][0]
        rates = [f"{LABELS[method]} {success(result, method, control, worst):.0f} %" for method in result.methods]
        clauses.append(f"{name} at {factor * worst:g} {unit}: {', '.join(rates)}")
    return (
        f"A row of four small charts for each of nine methods: the share of {result.seeds} seeds that ended within 5° "
        f"and 0.2 u of the truth, from 45° and 1.43 u, in the clean room with one control changed at a time. "
        f"{'. '.join(clauses)}."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Success in percent for each value."""
    rows = []
    for k, (name, unit, factor) in enumerate(CONTROLS.values()):
        for i, value in enumerate(result.values[k]):
            rates = (f"{100 * row[k][i] / result.seeds:.0f} %" for row in result.successes)
            rows.append([f"{name} {factor * value:g} {unit}", *rates])
    return ["control", *LABELS.values()], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw a matrix of small curves with a row for each method and a column for each control."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label

    wide = [(134 + 148 * k, 42 + 52 * i, 126, 38) for i in range(9) for k in range(4)]
    small = [(36 + 79 * k, 62 + 66 * i, 66, 36) for i in range(9) for k in range(4)]
    for n, axes in enumerate(axes_in(figure, narrow, wide, small)):
        i, k = divmod(n, 4)
        control, (name, unit, factor) = list(CONTROLS.items())[k]
        counts, values = result.successes[i][k], [factor * value for value in result.values[k]]
        low, high = zip(*(wilson(count, result.seeds) for count in counts), strict=True)
        axes.axvline(factor * USUAL[control], color=COLOURS["guide"], linewidth=1.0, dashes=(4, 3))
        axes.fill_between(values, low, high, color=COLOURS["accent"], alpha=0.25, linewidth=0)
        axes.plot(values, [count / result.seeds for count in counts], color=COLOURS["accent"], clip_on=False)
        axes.set(xlim=(min(values), max(values)), ylim=(0.0, 1.0))
        if control == "overlap":
            axes.set_xlim(max(values), min(values))
        axes.spines["left"].set_visible(False)
        axes.grid(axis="y")
        axes.set_yticks([0.0, 1.0], ["0 %", "100 %"] if k == 0 else ["", ""])
        ends = [axes.get_xlim()[0], axes.get_xlim()[1]]
        last = i == len(LABELS) - 1
        axes.set_xticks(ends, [f"{end:g} {unit}" for end in ends] if last else ["", ""])
        axes.tick_params(axis="x", length=3 if last else 0)
        if last:
            for text, side in zip(axes.get_xticklabels(), ("left", "right"), strict=True):
                text.set_horizontalalignment(side)
        if i == 0:
            label(axes, ends[0], 1.0, name.replace(" ", "\n", 1) if narrow and k > 1 else name, dy=34 if narrow else 20,
                  fontweight="bold", fontsize=12.0 if narrow else 13.0)  # fmt: skip
        if k == 0:
            dx, dy = (0, 12) if narrow else (-134, -19)
            label(axes, ends[0], 1.0, LABELS[result.methods[i]], dx=dx, dy=dy)
