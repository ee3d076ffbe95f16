"""The reach of plain ICP: success against the starting angle, in four settings of the room."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sitegen.plots._numbers import at
from sitegen.plots._rates import close, clouds, interval, wilson
from sitegen.plots._sizes import sizes
from solvers import register
from solvers.scenes.rooms import room, room_start
from solvers.studies.seeds import seeds

TITLE = "Success of ICP against the starting angle, four settings of the room"
SIZES = sizes(300, 470)
SECONDS = 12

SETTINGS = {"clean": "Clean", "striped": "Striped sampling", "outliers": "Outliers", "combo": "Noise and outliers"}
ANGLES = tuple(range(-90, 91, 10))
RUNS = 40
PARTS = tuple(itertools.product(SETTINGS, ANGLES))


@dataclass(frozen=True)
class Result:
    """successes: by setting, then by angle; out of `runs`."""

    runs: int
    angles: tuple[int, ...]
    settings: tuple[str, ...]
    successes: tuple[tuple[int, ...], ...]


def part(setting: str, angle: int) -> int:
    """The successes of point-to-point ICP without gate or trim, from a start turned about the world's origin, not
    moved."""
    scenes = [room(setting, seed=seed) for seed in seeds(RUNS)]
    source, target = clouds(scenes)
    result = register(source, target, "icp", start=room_start(angle, 0.0))
    return close(result.pose, scenes[0].truth)


def whole(parts: Mapping[tuple[str, int], int]) -> Result:
    """Collect the successes of all parts."""
    rows = tuple(tuple(parts[setting, angle] for angle in ANGLES) for setting in SETTINGS)
    return Result(RUNS, ANGLES, tuple(SETTINGS), rows)


def success(result: Result, setting: str, angle: int) -> float:
    """The percentage of the seeds that ended near the truth."""
    return 100.0 * _row(result, setting)[at(result.angles, angle, "angle")] / result.runs


def _row(result: Result, setting: str) -> tuple[int, ...]:
    return result.successes[at(result.settings, setting, "setting")]


def runs(result: Result) -> int:
    """The number of seeds behind each dot."""
    return result.runs


def sure(result: Result, setting: str, side: int) -> int:
    """The largest angle to that side (1 or −1) up to which every seed succeeded from every angle; 0 if there is
    none."""
    row = dict(zip(result.angles, _row(result, setting), strict=True))
    reach = [side * angle for angle in result.angles if side * angle >= 0]
    good = 0
    for angle in sorted(reach):
        if row[side * angle] < result.runs:
            break
        good = angle
    return side * good


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for setting in result.settings:
        low, high = (sure(result, setting, side) for side in (-1, 1))
        best_count = max(_row(result, setting))
        possible = [angle for angle, hits in zip(result.angles, _row(result, setting), strict=True) if hits]
        ends = f"from {_degrees(low)} to {_degrees(high)}"
        best = f"all of {result.runs} {ends}" if best_count == result.runs else f"{best_count} at best"
        span = f"from {_degrees(min(possible))} to {_degrees(max(possible))}"
        clauses.append(f"{SETTINGS[setting].lower()}: {best}, some {span}")
    first, last = _degrees(result.angles[0]), _degrees(result.angles[-1])
    return (
        f"Four small charts of the share of {result.runs} seeds for which ICP ended within 5° and 0.2 u of the truth, "
        f"against the starting angle from {first} to {last} in steps of 10°, "
        f"rotated about the world's origin. {'; '.join(clauses)}. The plateau is wide without outliers and ends "
        "steeply; outliers make it narrow and its ends gentle."
    )


def _degrees(angle: int) -> str:
    return f"{angle}°".replace("-", "−")


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Success with its interval for each angle and setting."""
    rows = []
    for i, angle in enumerate(result.angles):
        rows.append([_degrees(angle), *(interval(row[i], result.runs) for row in result.successes)])
    return ["starting angle", *(SETTINGS[setting] for setting in result.settings)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw a chart for each setting, all with the same axes."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, measured

    wide = [(44 + 170 * i, 50, 148, 190) for i in range(4)]
    small = [(44 + 156 * (i % 2), 50 + 214 * (i // 2), 138, 140) for i in range(4)]
    for i, (axes, setting, row) in enumerate(
        zip(axes_in(figure, narrow, wide, small), result.settings, result.successes, strict=True)
    ):
        axes.set_title(SETTINGS[setting], fontweight="bold", pad=12)
        axes.axvline(0.0, color=COLOURS["truth"], linewidth=1.25, alpha=0.5)
        axes.grid(axis="y")
        axes.spines["left"].set_visible(False)
        low, high = zip(*(wilson(k, result.runs) for k in row), strict=True)
        measured(axes, result.angles, [k / result.runs for k in row], low, high, "accent", joined=True)
        axes.set(xlim=(-96, 96), ylim=(0.0, 1.0), xticks=[-90, -45, 0, 45, 90])
        axes.set_xticks([-90, -45, 0, 45, 90], ["−90°", "", "0°", "", "90°"])
        first = i % 2 == 0 if narrow else i == 0
        axes.set_yticks([0.0, 0.5, 1.0], ["0 %", "50 %", "100 %"] if first else ["", "", ""])
        if i >= (2 if narrow else 0):
            axes.set_xlabel("starting angle")
