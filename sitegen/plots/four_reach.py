"""The reach of the walkthrough's four methods: success against the moving cloud's starting angle."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sitegen.plots._numbers import at
from sitegen.plots._rates import close, interval, wilson
from sitegen.plots._sizes import sizes
from solvers.core.stepper import run
from solvers.scenes.fish import fish, fish_start
from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE
from solvers.studies.seeds import seeds
from solvers.studies.walkthrough import begin_walk, scene_poses

TITLE = "Success of the four methods against the starting angle, with and without clutter and the smaller cloud"
SIZES = sizes(330, 790)
SECONDS = 35

SETTINGS = {"clean": "Clean", "smaller": "15 % smaller", "clutter": "A fifth clutter"}
METHODS = {"cpd": "CPD", "filterreg": "FilterReg", "mmd": "MMD", "flow": "flow"}
LOOKS = {"cpd": ("source", "o-"), "filterreg": ("target", "s-"), "mmd": ("ink", "^-"), "flow": ("accent", "D-")}
CERTAIN = ("cpd", "filterreg")  # without random draws: the same clouds give the same end
ANGLES = tuple(range(0, 181, 15))
RUNS = 16
APART = 2.2  # degrees between the dots of two methods at one angle
PARTS = tuple(itertools.product(SETTINGS, METHODS, ANGLES))


@dataclass(frozen=True)
class Result:
    """successes: by setting, then by method, then by angle; out of `runs`."""

    runs: int
    angles: tuple[int, ...]
    settings: tuple[str, ...]
    methods: tuple[str, ...]
    successes: tuple[tuple[tuple[int, ...], ...], ...]


def part(setting: str, method: str, angle: int) -> int:
    """The successes of a method, run as in the walkthrough, from the figure's initial shift."""
    name = "clutter" if setting == "clutter" else "clean"
    # Without noise and clutter every seed gives the same clouds, and these two are deterministic: one run stands for
    # all.
    alike = RUNS if setting != "clutter" and method in CERTAIN else 1
    scenes = [fish(name, seed=seed, smaller=setting == "smaller") for seed in seeds(RUNS // alike)]
    starts = [fish_start(angle)] * len(scenes)
    pose, truth = scene_poses(run(begin_walk(method, scenes, starts))[0], starts), scenes[0].truth
    return alike * close(pose, truth)


def whole(parts: Mapping[tuple[str, str, int], int]) -> Result:
    """Collect the successes of all parts."""
    rows = tuple(
        tuple(tuple(parts[setting, method, angle] for angle in ANGLES) for method in METHODS) for setting in SETTINGS
    )
    return Result(RUNS, ANGLES, tuple(SETTINGS), tuple(METHODS), rows)


def success(result: Result, setting: str, method: str, angle: int) -> int:
    """The number of seeds that ended near the truth."""
    row = result.successes[at(result.settings, setting, "setting")][at(result.methods, method, "method")]
    return row[at(result.angles, angle, "angle")]


def runs(result: Result) -> int:
    """The number of seeds behind each dot."""
    return result.runs


def words(result: Result) -> str:
    """The picture in words."""
    clauses = []
    for setting, rows in zip(result.settings, result.successes, strict=True):
        ends = []
        for method, row in zip(result.methods, rows, strict=True):
            sure = [angle for angle, k in zip(result.angles, row, strict=True) if k == result.runs]
            possible = [angle for angle, k in zip(result.angles, row, strict=True) if k]
            whole = f"all from up to {max(sure)}°" if sure else f"{max(row)} at best"
            reach = f"{whole}, some from up to {max(possible)}°" if possible else "0"
            ends.append(f"{METHODS[method]} {reach}")
        clauses.append(f"{SETTINGS[setting].lower()}: {'; '.join(ends)}")
    return (
        f"Three charts of how many of {result.runs} seeds ended within {CLOSE_DEGREES:g}° and {CLOSE_DISTANCE:g} u of "
        f"the truth, against the starting angle from {result.angles[0]}° to {result.angles[-1]}°, for the four methods "
        f"of the walkthrough. {'. '.join(c[0].upper() + c[1:] for c in clauses)}. Without clutter the clouds "
        f"are the same in every draw: {' and '.join(METHODS[name] for name in CERTAIN)} always or never succeed."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """Success with its interval for each setting, angle and method."""
    rows = []
    for setting, counts in zip(result.settings, result.successes, strict=True):
        for i, angle in enumerate(result.angles):
            rows.append([f"{SETTINGS[setting]}, {angle}°", *(interval(row[i], result.runs) for row in counts)])
    return ["starting angle", *(METHODS[method] for method in result.methods)], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw a chart for each setting with the four methods in it, distinguished by colour and marker."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in

    wide = [(46 + 228 * i, 50, 204, 190) for i in range(3)]
    small = [(46, 50 + 236 * i, 290, 150) for i in range(3)]
    charts = axes_in(figure, narrow, wide, small)
    handles: list[Any] = []
    for index, (axes, setting, rows) in enumerate(zip(charts, result.settings, result.successes, strict=True)):
        axes.set_title(SETTINGS[setting], fontweight="bold", pad=12)
        axes.grid(axis="y")
        axes.spines["left"].set_visible(False)
        handles = []
        for j, (method, row) in enumerate(zip(result.methods, rows, strict=True)):
            role, mark = LOOKS[method]
            colour = COLOURS[role]
            x = np.array(result.angles) + APART * (j - 1.5)
            uncertain = [i for i, k in enumerate(row) if 0 < k < result.runs]
            if uncertain:
                low, high = zip(*(wilson(row[i], result.runs) for i in uncertain), strict=True)
                axes.vlines(x[uncertain], low, high, color=colour, linewidth=1.25, capstyle="butt")
            (line,) = axes.plot(
                x, [k / result.runs for k in row], mark, color=colour, markersize=5.0, markeredgewidth=0.0,
                linewidth=1.5, label=METHODS[method], zorder=3, clip_on=False,
            )  # fmt: skip
            handles.append(line)
        axes.set(xlim=(-6, 186), ylim=(0.0, 1.0))
        axes.set_xticks([0, 45, 90, 135, 180], ["0°", "45°", "90°", "135°", "180°"])
        axes.set_yticks([0.0, 0.5, 1.0], ["0 %", "50 %", "100 %"] if narrow or index == 0 else ["", "", ""])
        if not narrow or index == 2:
            axes.set_xlabel("starting angle")
    figure.legend(handles=handles, loc="lower center", ncols=4, frameon=False, columnspacing=1.4, handlelength=1.6)
