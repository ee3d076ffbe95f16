"""Three residuals under four robust weights: success over seeds, from a near and from a midway start."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sitegen.plots._numbers import at
from sitegen.plots._rates import close, clouds, interval, span, wilson
from sitegen.plots._sizes import sizes
from solvers.api import register
from solvers.scenes.rooms import room, room_start
from solvers.studies.seeds import seeds

TITLE = "Success of residuals and robust weights, near and midway start"
SIZES = sizes(350, 640)
SECONDS = 8

STARTS = {"near": (15.0, 0.5), "midway": (45.0, 1.43)}
RESIDUALS = {"point": "Point to point", "plane": "Point to plane", "gicp": "GICP"}
WEIGHTS = {"none": "none", "huber": "Huber", "tukey": "Tukey", "welsch": "Welsch"}
METHOD = {"point": ("icp", {}), "plane": ("point-to-plane", {"free_below": 0.05}), "gicp": ("gicp", {})}
RUNS = 100
PARTS = tuple(itertools.product(STARTS, RESIDUALS, WEIGHTS))


@dataclass(frozen=True)
class Result:
    """successes: by start, residual and weight; out of `runs`."""

    runs: int
    starts: tuple[str, ...]
    residuals: tuple[str, ...]
    weights: tuple[str, ...]
    successes: tuple[tuple[tuple[int, ...], ...], ...]


def part(start: str, residual: str, weight: str) -> int:
    """The successes in the room with noise and outliers ('combo'), without gate or trim; thresholds from the distances'
    median deviation."""
    scenes = [room("combo", seed=seed) for seed in seeds(RUNS)]
    source, target = clouds(scenes)
    method, options = METHOD[residual]
    arguments: dict[str, Any] = {"weight": weight, **options}
    result = register(source, target, method, start=room_start(*STARTS[start]), **arguments)
    return close(result.pose, scenes[0].truth)


def whole(parts: Mapping[tuple[str, str, str], int]) -> Result:
    """Collect the successes of all parts."""
    counts = tuple(tuple(tuple(parts[s, r, w] for w in WEIGHTS) for r in RESIDUALS) for s in STARTS)
    return Result(RUNS, tuple(STARTS), tuple(RESIDUALS), tuple(WEIGHTS), counts)


def success(result: Result, start: str, residual: str, weight: str) -> float:
    """The percentage of the seeds that ended near the truth."""
    return 100.0 * _count(result, start, residual, weight) / result.runs


def runs(result: Result) -> int:
    """The number of seeds behind each dot."""
    return result.runs


def _count(result: Result, start: str, residual: str, weight: str) -> int:
    rows = result.successes[at(result.starts, start, "start")][at(result.residuals, residual, "residual")]
    return rows[at(result.weights, weight, "weight")]


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for start in result.starts:
        turn, offset = STARTS[start]
        parts = []
        for residual in result.residuals:
            unweighted = _count(result, start, residual, "none")
            robust = [_count(result, start, residual, weight) for weight in result.weights if weight != "none"]
            parts.append(f"{RESIDUALS[residual].lower()} {unweighted} without weights and {span(robust)} with")
        clause = f"from the {start} start ({turn:g}° and {offset:g} u) {', '.join(parts)}"
        clauses.append(clause.replace("gicp", "GICP"))
    return (
        f"Two dot charts of the share of {result.runs} seeds that ended within 5° and 0.2 u of the truth, for three "
        f"residuals and four weights, in the room with noise and outliers. Of {result.runs}, {'; '.join(clauses)}."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Success with its interval."""
    rows = []
    for start in result.starts:
        for residual in result.residuals:
            counts = (interval(_count(result, start, residual, weight), result.runs) for weight in result.weights)
            rows.append([start, RESIDUALS[residual], *counts])
    return ["start", "residual", *(f"weight: {WEIGHTS[weight]}" for weight in result.weights)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw a chart for each start; its rows are weights, grouped by residual."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label

    wide = [(128, 50, 256, 250), (438, 50, 256, 250)]
    small = [(74, 50, 258, 226), (74, 356, 258, 226)]
    for i, (axes, start) in enumerate(zip(axes_in(figure, narrow, wide, small), result.starts, strict=True)):
        turn, offset = STARTS[start]
        axes.set_title(f"{start.capitalize()} start: {turn:g}° and {offset:g} u", fontweight="bold", pad=12)
        axes.grid(axis="x")
        axes.spines["left"].set_visible(False)
        axes.spines["bottom"].set_visible(False)
        axes.tick_params(length=0)
        at, ticks, names = 0.0, [], []
        for residual in result.residuals:
            for weight in result.weights:
                hits = _count(result, start, residual, weight)
                low, high = wilson(hits, result.runs)
                plain = weight == "none"
                colour = COLOURS["ghost" if plain else "accent"]
                axes.hlines(at, low, high, color=colour, linewidth=2.0)
                axes.plot(
                    hits / result.runs, at, "o", color=colour, markersize=7, markeredgecolor=COLOURS["paper"],
                    markeredgewidth=1.25, clip_on=False, zorder=3,
                )  # fmt: skip
                ticks.append(at)
                names.append(WEIGHTS[weight])
                at += 1.0
            if i == 0 and not narrow:
                label(axes, 0.0, at - 2.5, RESIDUALS[residual].replace(" to ", "\nto "), dx=-124)
            elif narrow:
                label(axes, 0.0, at - 4.85, RESIDUALS[residual], fontsize=12.0, dx=0)
            at += 1.4 if narrow else 0.7
        axes.set_yticks(ticks, names if i == 0 or narrow else [""] * len(names))
        axes.set(xlim=(0.0, 1.0), ylim=(at - 1.2, -1.3 if narrow else -0.6))
        axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0 %", "", "50 %", "", "100 %"])
        axes.set_xlabel("seeds near the truth")
