"""The marks of a reader's clouds: the two clouds in their window with a scale bar, and the course of a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers import Pose
from widgets.drawing.chart import WIDTH, Axis, Series, chart
from widgets.drawing.picture import (
    SUPERSCRIPT,
    Array,
    Group,
    Handle,
    Mark,
    Panel,
    Path,
    Points,
    Role,
    degrees,
    number,
)
from widgets.engine.contract import Action
from widgets.figures.own_clouds.clouds import Clouds
from widgets.figures.own_clouds.run import Run
from widgets.parts.robot import ARROW
from widgets.parts.room import PLACING, VIEW
from widgets.parts.scale_bar import scale_bar

ROBOT = 0.22 * ARROW  # window units, however large a scan is


def plain(value: float, decimals: int = 3, most: float = 1e6, digits: int = 2) -> str:
    """A number of any size: fixed decimals from 0.001 up to `most`, otherwise one digit before the point and a power of
    ten."""
    if value == 0.0 or 1e-3 <= abs(value) < most:
        return number(value, decimals)
    mantissa, exponent = f"{value * (1 + 1e-9):.{digits}e}".split("e")
    return f"{mantissa}·10{str(int(exponent)).translate(SUPERSCRIPT)}".replace("-", "−")


def tick(value: float) -> str:
    """The same within the six characters, plus a minus sign, for which a chart's padding has room."""
    decimals = next((places for places, most in ((3, 1e2), (2, 1e3), (1, 1e4)) if abs(value) < most), 0)
    return plain(value, decimals, 1e5, 0)


def moved(clouds: Clouds, pose: Pose) -> Array:
    """The source at a pose, in window coordinates."""
    return clouds.fit.put(pose.apply(clouds.source))


def robot(clouds: Clouds, pose: Pose, role: Role) -> tuple[Mark, ...]:
    """The robot that took a scan of the drive, at its place and heading; nothing for other clouds."""
    if clouds.raw.wheels is None:
        return ()
    outline = clouds.fit.put(pose.t[None]) + ROBOT @ pose.R.T
    return (Path(outline, role, closed=True, filled=True),)


def clouds_panel(run: Run) -> Panel:
    """The target, where the source began, and where it is."""
    c = run.clouds
    marks: list[Mark] = [*scale_bar(VIEW, c.unit, c.fit.scale)]
    if len(c.source) and run.steps:
        marks.append(Points(moved(c, run.began), "ghost", radius=2.5))
    if len(c.target):
        marks.append(Points(c.fit.put(c.target), "target", "square", radius=2.5))
        marks += robot(c, Pose.identity(), "target")
    if len(c.source):
        signs = run.evidence
        weight = None if signs is None or signs.explained.all() else np.where(signs.explained, 1.0, 0.55)
        in_view, anchor = c.fit.seen(run.pose), c.fit.put(c.anchor)
        stalk = (PLACING.stalk(in_view, anchor),) if c.whole else ()
        dots = Points(moved(c, run.pose), "source", radius=2.5, weight=weight)
        marks.append(Group("source", (*stalk, dots, *robot(c, run.pose, "source"))))
    label = "Both clouds in the target’s coordinates, the source placed by the current pose"
    return Panel("main", label, VIEW, tuple(marks), grid=False)


def handles(run: Run) -> tuple[Handle, ...]:
    """The source's two handles, with their values in the files' unit."""
    c = run.clouds
    if not c.whole:
        return ()
    anchor = c.fit.put(c.anchor)
    move, turn = PLACING.handles(c.fit.seen(run.pose), anchor)
    x, y = (number(float(v), c.decimals) for v in run.pose.apply(c.anchor[None])[0])
    return replace(move, value=f"x {x}, y {y} {c.unit}"), turn


def dragged(run: Run, name: str, x: float, y: float) -> Pose:
    """The pose of the clouds after a handle is dragged to a place in the window."""
    c = run.clouds
    return c.fit.meant(PLACING.act(c.fit.seen(run.pose), c.fit.put(c.anchor), Action("drag", name, x, y)))


def objective_chart(run: Run) -> Panel:
    """What the method minimises, over the steps taken; its axis runs from the lowest value to the highest."""
    values = np.array([v for v in run.objective if np.isfinite(v)])
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    span = high - low if high > low else 1.0
    last = max(run.steps, 1)
    k = np.arange(len(run.objective)) / last
    y = (np.array(run.objective) - low) / span
    flat = len(values) > 0 and high == low
    lowest = (0.0, tick(low))
    ticks = (lowest,) if flat else (lowest, (1.0, tick(high)))
    return chart(
        "objective",
        "The method’s objective over the steps",
        [Series(k, np.where(np.isfinite(y), y, np.nan), "accent", dots=len(k) <= 40)] if len(values) else [],
        Axis("step", 0.0, 1.0, ((0.0, "0"), (1.0, str(last)))),
        Axis("Objective", 0.0, 1.0, ticks if len(values) else ((0.0, "–"),)),
        now=run.steps / last,
        size=(WIDTH, 190.0),
    )


def heading(pose: Pose, decimals: int = 2) -> str:
    """The pose's rotation in degrees, as text."""
    return degrees(float(np.arctan2(pose.R[1, 0], pose.R[0, 0])), decimals)
