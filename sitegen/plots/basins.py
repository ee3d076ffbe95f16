"""Basins: from which starting rotations and offsets nine methods succeed, in two settings of the room."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sitegen.plots._numbers import at
from sitegen.plots._sizes import sizes
from sitegen.plots._sweep import LABELS, hits, read

TITLE = "Success over starting rotation and offset, nine methods, two settings"
READS = ("content/data/sweep/basins.json",)
SIZES = sizes(446, 930)

LEVELS = 23  # the index of the field's strongest colour


@dataclass(frozen=True)
class Result:
    """successes: by method, setting, offset and angle; out of `seeds`."""

    seeds: int
    methods: tuple[str, ...]
    settings: tuple[str, ...]
    angles: tuple[int, ...]
    offsets: tuple[float, ...]
    successes: tuple[tuple[tuple[tuple[int, ...], ...], ...], ...]


def compute() -> Result:
    """Read the sweep's file."""
    data = read("basins")
    axes = data["axes"]

    def count(method: str, setting: str, offset: float, angle: int) -> int:
        return hits(data["contestants"][method]["cells"][f"{setting} {angle:d} {offset:g}"]["bits"])

    successes = tuple(
        tuple(
            tuple(tuple(count(m, s, offset, angle) for angle in axes["degrees"]) for offset in axes["distance"])
            for s in axes["setting"]
        )
        for m in LABELS
    )
    settings, angles, offsets = (tuple(axes[name]) for name in ("setting", "degrees", "distance"))
    return Result(data["seeds"], tuple(LABELS), settings, angles, offsets, successes)


def share(result: Result, method: str, setting: str) -> float:
    """The percentage of runs, over all starts of the map and all seeds, that ended near the truth."""
    rows = result.successes[at(result.methods, method, "method")][at(result.settings, setting, "setting")]
    return 100.0 * sum(map(sum, rows)) / (result.seeds * len(result.angles) * len(result.offsets))


def seeds(result: Result) -> int:
    """The number of seeds behind each cell of a map."""
    return result.seeds


def words(result: Result) -> str:
    """The picture in words."""
    clauses = [
        f"{LABELS[method]} " + " and ".join(f"{share(result, method, setting):.0f} %" for setting in result.settings)
        for method in result.methods
    ]
    first = f"{result.angles[0]}°".replace("-", "−")
    return (
        f"A map for each of nine methods, in the {' and the '.join(result.settings)} room. Across: the starting "
        f"rotation, {first} to {result.angles[-1]}°. Up: the starting offset, 0 to {result.offsets[-1]:g} u in the "
        f"race's direction. The stronger the colour, the more of {result.seeds} seeds ended within 5° and 0.2 u of the "
        f"truth. Share of all starts in a map that succeeded, in the {' and the '.join(result.settings)} room: "
        f"{', '.join(clauses)}. RANSAC ignores the start; the basins of the others surround zero rotation."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """The share of all starts from which each method succeeds."""
    rows = [[LABELS[m], *(f"{share(result, m, s):.1f} %" for s in result.settings)] for m in result.methods]
    return ["method", *(f"arrived, {setting} room" for setting in result.settings)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw pairs of maps and the colour scale."""
    from sitegen.plots._look import axes_in, label

    width, height = (148, 44) if narrow else (96, 66)
    if narrow:
        pairs = [[(34 + 160 * k, 58 + 90 * i, width, height) for k in range(2)] for i in range(9)]
    else:
        pairs = [
            [(40 + 232 * (i % 3) + 104 * k, 64 + 118 * (i // 3), width, height) for k in range(2)] for i in range(9)
        ]
    boxes = [box for pair in pairs for box in pair]
    scale = (34, 896, 140, 10) if narrow else (40, 414, 140, 10)
    *maps, bar = axes_in(figure, narrow, [*boxes, scale], [*boxes, scale])
    for n, axes in enumerate(maps):
        i, k = divmod(n, 2)
        fields(axes, result.successes[i][k], result.seeds)
        top = len(result.offsets)
        has_name = i < (1 if narrow else 3)
        if has_name:
            label(axes, 0, top, f"{result.settings[k]} room", "soft", dy=10, fontsize=12.0)
        if k == 0:
            label(axes, 0, top, LABELS[result.methods[i]], dy=27 if has_name else 11, fontweight="bold")
        last = i == 8 if narrow else i >= 6
        ticks = ["−90°", "0°", "90°"] if last else ["", "", ""]
        axes.set_xticks([0.5 + result.angles.index(angle) for angle in (-90, 0, 90)], ticks)
        first = k == 0 and (narrow or i % 3 == 0)
        axes.set_yticks([0.5, len(result.offsets) - 0.5], ["0 u", f"{result.offsets[-1]:g} u"] if first else ["", ""])
        axes.tick_params(axis="x", length=3 if last else 0)
    fields(bar, [list(range(result.seeds + 1))], result.seeds)
    bar.set_yticks([])
    bar.set_xticks([0, result.seeds + 1], ["no seed", f"all {result.seeds}"])
    bar.tick_params(length=0)
    for text, side in zip(bar.get_xticklabels(), ("left", "right"), strict=True):
        text.set_horizontalalignment(side)


def fields(axes: Any, rows: Any, total: int) -> None:
    """Draw rows of counts as coloured areas, the first row lowest, with one shape per colour."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    from sitegen.figures.matplotlib_svg import COLOURS

    boxes: dict[int, list[tuple[int, int, int]]] = {}
    for y, row in enumerate(rows):
        begin = 0
        for x in range(1, len(row) + 1):
            if x == len(row) or row[x] != row[begin]:
                boxes.setdefault(round(LEVELS * row[begin] / total), []).append((begin, x, y))
                begin = x
    for level, spans in sorted(boxes.items()):
        shapes = [Path([(a, y), (b, y), (b, y + 1), (a, y + 1), (a, y)], closed=True) for a, b, y in spans]
        shape = Path.make_compound_path(*shapes)
        axes.add_patch(PathPatch(shape, facecolor=COLOURS[f"h{level}"], edgecolor="none", linewidth=0))
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set(xlim=(0, len(rows[0])), ylim=(0, len(rows)))
