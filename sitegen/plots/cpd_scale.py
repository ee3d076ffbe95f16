"""CPD's scale over its steps from several starting angles: it first collapses, then recovers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sitegen.plots._numbers import at
from sitegen.plots._sizes import sizes
from solvers.core.stepper import run
from solvers.metrics import rre
from solvers.scenes.fish import fish, fish_start
from solvers.studies.walkthrough import begin_walk, scene_poses

TITLE = "The scale that similarity CPD has after each step, from four starting angles"
SIZES = sizes(330, 330)

ANGLES = (60, 85, 90, 180)
ROLES = ("accent", "source", "target", "weak")
SPOTS = ((3.2, 0.38), (8.3, 0.3), (15.5, 0.145), (17.5, 0.69))  # step and scale, beside each line
SHOWN = 40  # steps


@dataclass(frozen=True)
class Result:
    """scales: by angle, after 0, 1, … steps. off: the final rotation error in degrees."""

    angles: tuple[int, ...]
    scales: tuple[tuple[float, ...], ...]
    off: tuple[float, ...]


def compute() -> Result:
    """Run the clean scene of the walkthrough, seed 40, from its initial shift."""
    scales, off = [], []
    for angle in ANGLES:
        scene, starts = fish(), [fish_start(angle)]
        batch, course = run(begin_walk("cpd", [scene], starts))
        scales.append(tuple(round(float(s), 6) for s in np.asarray(course.poses.scale)[:, 0]))
        off.append(round(float(np.degrees(rre(scene_poses(batch, starts), scene.truth))[0]), 3))
    return Result(ANGLES, tuple(scales), tuple(off))


def least(result: Result, angle: int) -> float:
    """The smallest scale on the way."""
    return min(result.scales[at(result.angles, angle, "angle")])


def last(result: Result, angle: int) -> float:
    """The final scale."""
    return result.scales[at(result.angles, angle, "angle")][-1]


def words(result: Result) -> str:
    """The picture in words."""
    clauses = [
        f"from {angle}° it falls to {min(row):.2g} and ends at {row[-1]:.2f}, {off:.0f}° off"
        for angle, row, off in zip(result.angles, result.scales, result.off, strict=True)
    ]
    return (
        "A chart of the scale of similarity CPD over its steps in the clean scene of the walkthrough, where the true "
        f"scale is 1, on a logarithmic scale: {'; '.join(clauses)}."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """The least and the last scale, and the error, for each start."""
    rows = [
        [f"{angle}°", f"{min(row):.3f}", f"{row[-1]:.3f}", f"{off:.1f}°", str(len(row) - 1)]
        for angle, row, off in zip(result.angles, result.scales, result.off, strict=True)
    ]
    return ["starting angle", "least scale", "last scale", "rotation error", "steps"], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw a line for each start; dashed if its end is wrong."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label, titled

    (axes,) = axes_in(figure, narrow, [(50, 30, 640, 240)], [(46, 30, 290, 240)])
    axes.axhline(1.0, color=COLOURS["truth"], linewidth=1.25, alpha=0.6)
    titled(axes, "", "step", "scale")
    axes.set_yscale("log")
    axes.set(xlim=(0, SHOWN), ylim=(0.015, 1.3))
    axes.set_yticks([0.02, 0.05, 0.1, 0.2, 0.5, 1.0], ["0.02", "0.05", "0.1", "0.2", "0.5", "1"])
    axes.set_yticks([], minor=True)
    for angle, row, off, role, spot in zip(result.angles, result.scales, result.off, ROLES, SPOTS, strict=True):
        course = row[: SHOWN + 1]
        axes.plot(range(len(course)), course, "--" if off > 90 else "-", color=COLOURS[role], linewidth=1.75)
        label(axes, *spot, f"{angle}°", role, dx=8 if angle < 180 else 0)
    label(axes, SHOWN, 0.03, "dashed: ends half a turn off", "soft", ha="right")
