"""The reach of NDT with one cell size and from coarse to fine: success against starting angle and offset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sitegen.plots._numbers import at
from sitegen.plots._rates import close, clouds, interval, wilson
from sitegen.plots._sizes import sizes
from solvers import Pose, register
from solvers.scenes.walls import ndt_room
from solvers.studies.seeds import seeds

TITLE = "Success of NDT against starting angle and offset, one cell size and coarse to fine"
SIZES = sizes(330, 600)
SECONDS = 7

RUNS = 30
CELLS = {"one": (0.8,), "fine": (3.2, 1.6, 0.8)}
NAMES = {"one": "one cell size", "fine": "coarse to fine"}
ANGLES = tuple(range(-60, 61, 10))
OFFSETS = tuple(round(0.25 * k, 2) for k in range(11))
DIRECTION = np.array([0.83205, -0.5547])
PARTS = (
    *((run, angle, 0.0) for run in CELLS for angle in ANGLES),
    *((run, 0, offset) for run in CELLS for offset in OFFSETS if offset),
)


@dataclass(frozen=True)
class Result:
    """by_angle, by_offset: successes by run ('one', 'fine'), then by start; out of `runs`."""

    runs: int
    angles: tuple[int, ...]
    offsets: tuple[float, ...]
    by_angle: tuple[tuple[int, ...], ...]
    by_offset: tuple[tuple[int, ...], ...]


def part(run: str, angle: int, offset: float) -> int:
    """The successes in the NDT room with four grids and steps of at most 0.5 u and 0.2 rad, from a start that is turned
    by `angle` or moved by `offset` down to the right."""
    scenes = [ndt_room(seed=seed) for seed in seeds(RUNS)]
    source, target = clouds(scenes)
    start = Pose.from_angle(np.radians(angle), offset * DIRECTION)
    result = register(source, target, "ndt", start=start, cells=CELLS[run], max_shift=0.5, max_turn=0.2)
    return close(result.pose, scenes[0].truth)


def whole(parts: Mapping[tuple[str, int, float], int]) -> Result:
    """Collect the successes of all parts."""
    by_angle = tuple(tuple(parts[run, angle, 0.0] for angle in ANGLES) for run in CELLS)
    by_offset = tuple(tuple(parts[run, 0, offset] for offset in OFFSETS) for run in CELLS)
    return Result(RUNS, ANGLES, OFFSETS, by_angle, by_offset)


def turned(result: Result, run: str, angle: int) -> float:
    """The percentage of seeds near the truth from an angle; run: 'one' or 'fine'."""
    return 100.0 * result.by_angle[at(CELLS, run, "run")][at(result.angles, angle, "angle")] / result.runs


def shifted(result: Result, run: str, offset: float) -> float:
    """The percentage of seeds near the truth from an offset in u; run: 'one' or 'fine'."""
    return 100.0 * result.by_offset[at(CELLS, run, "run")][at(result.offsets, offset, "offset")] / result.runs


def runs(result: Result) -> int:
    """The number of seeds behind each dot."""
    return result.runs


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for i, run in enumerate(CELLS):
        angles = [a for a, k in zip(result.angles, result.by_angle[i], strict=True) if k == result.runs]
        offsets = [o for o, k in zip(result.offsets, result.by_offset[i], strict=True) if k == result.runs]
        span = f"from {min(angles)}° to {max(angles)}°".replace("-", "−") if len(angles) > 1 else "from 0° alone"
        clauses.append(f"{NAMES[run]}: every seed {span}, and up to {max(offsets):g} u")
    return (
        f"Two charts of the share of {result.runs} seeds for which NDT ended within 5° and 0.2 u of the truth: against "
        f"the starting angle, with no offset, and against the starting offset, with no turn. "
        f"{'; '.join(clauses)}. Coarse to fine reaches farther in both charts, but its reach is limited as well."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Success with its interval for each start."""
    rows = []
    for i, angle in enumerate(result.angles):
        counts = (interval(row[i], result.runs) for row in result.by_angle)
        rows.append([f"{angle}°".replace("-", "−"), *counts])
    for i, offset in enumerate(result.offsets):
        rows.append([f"{offset:g} u", *(interval(row[i], result.runs) for row in result.by_offset)])
    return ["start", *(f"{NAMES[run]} ({', '.join(f'{h:g}' for h in CELLS[run])} u)" for run in CELLS)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw success by angle and by offset, with both runs in each chart."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label, measured

    wide = [(46, 46, 310, 220), (402, 46, 290, 220)]
    by_angle, by_offset = axes_in(figure, narrow, wide, [(46, 46, 288, 190), (46, 342, 288, 190)])
    roles = dict(zip(CELLS, ("ink", "accent"), strict=True))
    charts = (
        (by_angle, result.angles, result.by_angle, "Turned at the start"),
        (by_offset, result.offsets, result.by_offset, "Moved at the start"),
    )
    for axes, starts, counts, title in charts:
        axes.set_title(title, fontweight="bold", pad=12)
        axes.grid(axis="y")
        axes.spines["left"].set_visible(False)
        axes.set_ylim(0.0, 1.0)
        axes.set_yticks([0.0, 0.5, 1.0], ["0 %", "50 %", "100 %"])
        for run, row in zip(CELLS, counts, strict=True):
            low, high = zip(*(wilson(k, result.runs) for k in row), strict=True)
            measured(axes, starts, [k / result.runs for k in row], low, high, roles[run], joined=True)
    by_angle.axvline(0.0, color=COLOURS["truth"], linewidth=1.25, alpha=0.5)
    by_angle.set(xlabel="starting angle", xlim=(-63, 63))
    by_angle.set_xticks([-60, -30, 0, 30, 60], ["−60°", "−30°", "0°", "30°", "60°"])
    by_offset.set(xlabel="starting offset, u", xlim=(-0.08, 2.58), xticks=[0.0, 0.5, 1.0, 1.5, 2.0, 2.5])
    label(by_angle, -38.0, 0.5, "coarse\nto fine", "accent", ha="right", dx=-8)
    label(by_angle, 0.0, 0.2, "one\ncell size", "ink", ha="center")
    label(by_offset, 1.62, 0.8, NAMES["fine"], "accent", dx=12)
    label(by_offset, 0.6, 0.2, NAMES["one"], "ink", dx=-4, ha="right")
