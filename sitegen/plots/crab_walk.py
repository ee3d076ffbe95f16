"""Why point pairs crab: a scan that is too far back along a long wall, moved by point pairs and by planes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sitegen.plots._numbers import at
from sitegen.plots._sizes import sizes
from solvers.api import register
from solvers.scenes.walls import sampled

TITLE = "A scan closes in on an end wall, by point pairs and by planes"
SIZES = sizes(310, 545)

CORNER = ((0.0, 0.0), (8.0, 0.0), (8.0, 2.0))  # u: a long wall, and a short one at its end
SPACING, BACK, STEPS = 0.1, 0.6, 12
METHODS = ("icp", "point-to-plane")
SHOWN = (0, 1, 2, 3, 4, 6, STEPS)

Corner = tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Result:
    """By method: the gap to the end wall after each step (u, the last value once a run has stopped), and the position
    of the scan's corner after the steps SHOWN. facing: the fraction of the points on the end wall."""

    gaps: tuple[tuple[float, ...], ...]
    corners: tuple[tuple[Corner, ...], ...]
    facing: float


def compute() -> Result:
    """Register the sampled corner, pushed back along its long wall, with itself."""
    corner = np.array(CORNER)
    cloud = sampled(corner, SPACING)
    gaps, corners = [], []
    for method in METHODS:
        poses = register(cloud - [BACK, 0.0], cloud, method, max_steps=STEPS).history.poses
        last = len(poses.t) - 1
        steps = [min(step, last) for step in range(STEPS + 1)]
        gaps.append(tuple(round(float(BACK - poses.t[step, 0]), 5) for step in steps))
        walls = [(corner - [BACK, 0.0]) @ poses.R[steps[step]].T + poses.t[steps[step]] for step in SHOWN]
        corners.append(tuple(tuple(tuple(round(float(v), 5) for v in xy) for xy in wall) for wall in walls))
    return Result(tuple(gaps), tuple(corners), float((cloud[:, 0] > CORNER[1][0] - 1e-9).mean()))


def gap(result: Result, method: str, step: int) -> float:
    """The remaining gap to the end wall after `step` steps, u."""
    return result.gaps[at(METHODS, method, "methods")][step]


def words(result: Result) -> str:
    """The picture in words."""
    clauses = [f"{abs(gap(result, 'icp', step)):.2f} u after {step}" for step in SHOWN[1:]]
    return (
        f"A long wall and an end wall, sampled every {SPACING:g} u, and the same points pushed back by {BACK:g} u along"
        f" the long wall; {100 * result.facing:.0f} % of them are on the end wall. With point pairs the scan's end wall"
        f" comes nearer in ever smaller steps but stays off: {', '.join(clauses)} steps. With planes the first step"
        f" leaves {abs(gap(result, 'point-to-plane', 1)):.2f} u. A dashed curve shrinks by the fraction of points on"
        f" the end wall at each step; the gap of point pairs comes down a little above it, and then stays."
    )


def table(result: Result) -> tuple[list[str], list[list[str]]]:
    """The gaps."""
    rows = [[str(step), *(f"{abs(gap(result, method, step)):.3f} u" for method in METHODS)] for step in SHOWN]
    return ["steps", "gap, point pairs", "gap, planes"], rows


def draw(result: Result, figure: Any, narrow: bool) -> None:
    """Draw the scan's walls after some steps, for both methods, and the gap over the steps."""
    from sitegen.figures.matplotlib_svg import COLOURS
    from sitegen.plots._look import axes_in, label, titled

    wide = [(20, 40, 200, 220), (250, 40, 200, 220), (516, 62, 190, 198)]
    tall = [(10, 40, 160, 176), (185, 40, 160, 176), (40, 316, 296, 184)]
    *rooms, chart = axes_in(figure, narrow, wide, tall)
    for axes, name, corners in zip(rooms, ("Point pairs", "Planes"), result.corners, strict=True):
        titled(axes, name)
        axes.set_axis_off()
        axes.plot(*np.transpose(CORNER), color=COLOURS["target"], linewidth=5.0, alpha=0.55, solid_capstyle="butt")
        for k, corner in enumerate(corners):
            axes.plot(*np.transpose(corner), color=COLOURS["source"], linewidth=1.5, alpha=(k + 2) / (len(corners) + 1))
        axes.set(xlim=(6.1, 8.16), ylim=(-0.12, 2.15))
    x, y = result.corners[0][0][2]
    align, aside = ("right", 6) if narrow else ("center", 0)  # narrow: the label "start" goes to the left of its wall
    label(rooms[0], x, y, "start", "source", dx=-aside, dy=9, ha=align)
    label(rooms[0], 8.0, 2.0, "end wall", "target", dx=2 * aside, dy=9, ha=align)

    steps = np.arange(STEPS + 1)
    titled(chart, "The gap", "step", "gap to the end wall, u")
    chart.plot(steps, BACK * (1.0 - result.facing) ** steps, "--", color=COLOURS["soft"], linewidth=1.5)
    for gaps, role in zip(result.gaps, ("source", "accent"), strict=True):
        chart.plot(steps, gaps, "o-", color=COLOURS[role], markersize=3.5, linewidth=1.75, clip_on=False)
    label(chart, 7, result.gaps[0][7], "point pairs", "source", dy=11)
    label(chart, 3, 0.0, "planes", "accent", dy=11)
    chart.set(xlim=(0, STEPS), ylim=(-0.02, 0.62), xticks=[0, 4, 8, 12], yticks=[0.0, 0.2, 0.4, 0.6])
