"""The race's panels: a small one for each contestant, and one chart with the errors of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from solvers.scenes.rooms import Scene
from solvers.studies.benchmark import CLOSE_DEGREES
from solvers.studies.race import MAX_STEPS
from widgets.drawing.chart import axes, axis_names, decades, powers
from widgets.drawing.picture import (
    Array,
    Handle,
    Label,
    Mark,
    Panel,
    Path,
    Points,
    Role,
    Segments,
    View,
    degrees,
    number,
)
from widgets.figures.race.field import ENTRIES, Run
from widgets.parts.placing import Placing
from widgets.parts.room import ANCHOR

VIEW = View(-6.4, 6.4, -4.4, 4.4, width=300.0)
PLACING = Placing(VIEW, limit=(3.6, 1.8), reach=3.4, least=2.5)
BORDER = np.array([(-6.35, -4.35), (6.35, -4.35), (6.35, 4.35), (-6.35, 4.35)])
KEY = np.array([(-6.1, 4.0), (-4.6, 4.0)])  # a sample of a contestant's line, in the corner of its panel

SAMPLES = {name: Path(KEY, one.role, dashed=one.dashed, dotted=one.dotted, thick=True) for name, one in ENTRIES.items()}

LOW, HIGH = 0.01, 180.0  # degrees
NAMES = 75.0  # steps, on the chart's x axis: where the names begin
HEIGHT = 286.0
CHART = View(0.0, 96.0, float(np.log10(LOW)), float(np.log10(HIGH)), 480.0, HEIGHT, (40.0, 28.0, 6.0, 40.0))
LINE = 18.0  # px between two names
_CLOSE = float(np.log10(CLOSE_DEGREES))
_DECADES = decades(CHART.y0, CHART.y1)
FRAME: tuple[Mark, ...] = (
    *axes(CHART, [0.0, 20.0, 40.0, 60.0], _DECADES, powers(_DECADES), float(MAX_STEPS)),
    *axis_names(CHART, "step", "Rotation error, °", float(MAX_STEPS)),
    Segments([0.0, _CLOSE], [float(MAX_STEPS), _CLOSE], "truth", dashed=True),
    Label([0.0, _CLOSE], "5°", "truth", "start", dx=5, dy=14),
)
"""The chart's axes, up to the greatest number of steps, and the threshold; the names are to the right."""


@dataclass(frozen=True, eq=False)
class Stage:
    """What all panels of one start share, rendered once: the outline at the start and at the truth, and both clouds."""

    scene: Scene
    behind: tuple[Mark, ...]
    source: Points

    @classmethod
    def of(cls, scene: Scene, start: Pose, behind: Sequence[Mark]) -> Stage:
        """The stage of a start; `behind` is the scene's `scenery`, which all starts share."""
        ghost: list[Mark] = [Path(start.apply(line), "ghost", dotted=True) for line in scene.outline]
        return cls(scene, (*behind, *ghost), _cloud(scene, start))


def scenery(scene: Scene) -> tuple[Mark, ...]:
    """The marks that do not depend on the start: the outline at the truth, and the target."""
    return (
        *(Path(scene.truth.apply(line), "truth", thick=True) for line in scene.outline),
        Points(scene.target, "target", "square", radius=2.5),
    )


def _cloud(scene: Scene, pose: Pose) -> Points:
    return Points(pose.apply(scene.source), "source", radius=2.5)


def drawn(run: Run, stage: Stage) -> Run:
    """The run with its panel, which is made if it has none."""
    if run.panel is not None:
        return run
    entry = run.entry
    cloud = stage.source if run.steps == 0 else _cloud(stage.scene, run.pose)
    marks = (*stage.behind, cloud, SAMPLES[entry.contestant.method], *verdict(run))
    name = f"{entry.contestant.label}, {standing(run)}"
    caption = "\n".join((entry.contestant.label, errors(run), standing(run), entry.note))
    return replace(run, panel=Panel(run.seat, name, VIEW, marks, caption=caption))


def verdict(run: Run) -> tuple[Mark, ...]:
    """A frame round the panel of a run that has stopped, and a word: whether it is within both limits of the truth."""
    if not run.done:
        return ()
    role: Role = "truth" if run.close else "outlier"
    word = Label([6.1, -4.0], "right" if run.close else "wrong", role, "end")
    return (Path(BORDER, role, closed=True, thick=True, dashed=not run.close), word)


def errors(run: Run) -> str:
    """Both errors of a run, as its panel shows them."""
    return f"{number(run.rotation[-1], 1)}° · {number(run.translation[-1])} u"


def standing(run: Run) -> str:
    """A run's status: 'not started', 'step 7', 'converged after 25 steps'."""
    if run.batch is None:
        return "not started"
    if not run.done:
        return f"step {run.steps}"
    return f"{run.status} after {amount(run.steps, 'step')}"


def handles(start: Pose, runs: Sequence[Run]) -> tuple[Handle, ...]:
    """The two handles of the start, which can be dragged in every panel; the keyboard reaches them in the first."""
    first, *others = (run.seat for run in runs)
    return tuple(replace(one, panel=first, also=tuple(others)) for one in PLACING.handles(start, ANCHOR))


def chart(runs: Sequence[Run], followed: str = "") -> Panel:
    """The rotation error of every run over its steps, on a logarithmic axis; if one is followed, others are faint."""
    marks: list[Mark] = [*FRAME]
    lines = [course(run) for run in runs]
    ends = np.stack([line[-1] for line in lines])
    heights = apart(CHART.px(ends)[:, 1].tolist())
    sides = [(NAMES - 1.0, _world_y(height)) for height in heights]
    if any(len(line) > 1 for line in lines):  # leaders from one start to nine names would look like courses
        marks.append(Segments(ends, sides, "guide", weight=[0.3] * len(lines)))
    for run, line, side in zip(runs, lines, sides, strict=True):
        one, faint = run.entry, bool(followed) and followed != run.method
        marks.append(
            Path(line, one.role, dashed=one.dashed, dotted=one.dotted, thick=not faint, weight=0.3 if faint else 1.0)
        )
        if run.done:
            marks.append(Points(line[-1:], one.role, radius=3.0, weight=[0.3 if faint else 1.0]))
        marks.append(Label([NAMES, side[1]], one.short, one.role, dy=4.0))
    return Panel("errors", "Rotation error of the nine over their steps", CHART, tuple(marks), grid=False)


def course(run: Run) -> Array:
    """The run's line in chart coordinates (k + 1, 2): steps, and the decimal logarithm of the error."""
    error = np.clip(np.asarray(run.rotation), LOW, HIGH)
    return np.stack([np.arange(len(error), dtype=float), np.log10(error)], axis=1)


def apart(heights: Sequence[float]) -> list[float]:
    """These heights of names, px, spread to at least a line apart, in the same order and within the window."""
    top, bottom = CHART.pad[1] + 4.0, HEIGHT - CHART.pad[3] - 2.0
    order = sorted(range(len(heights)), key=lambda i: (round(heights[i], 6), i))
    spread = list(heights)
    floor = top
    for i in order:
        floor = spread[i] = max(spread[i], floor)
        floor += LINE
    ceiling = bottom
    for i in reversed(order):
        ceiling = spread[i] = min(spread[i], ceiling)
        ceiling -= LINE
    return spread


def _world_y(px: float) -> float:
    top, bottom = CHART.pad[1], HEIGHT - CHART.pad[3]
    return CHART.y1 - (px - top) / (bottom - top) * (CHART.y1 - CHART.y0)


def picked(runs: Sequence[Run], x: float, y: float) -> str:
    """The method whose line, or whose name right of step 72, is nearest to a place of the chart."""
    lines = [course(run) for run in runs]
    place = float(CHART.px([[x, y]])[0, 1])
    if x >= NAMES - 3.0:
        at = apart([float(CHART.px(line[-1:])[0, 1]) for line in lines])
        far = [abs(place - height) for height in at]
    else:
        far = [_distance(line, x, y) for line in lines]
    return runs[int(np.argmin(np.round(far, 6)))].method


def _distance(line: Array, x: float, y: float) -> float:
    """The distance from a place in the chart to the nearest point of a line, px, sampled every fifth of a step."""
    along = np.linspace(0.0, line[-1, 0], 5 * len(line) + 1)
    dense = CHART.px(np.stack([along, np.interp(along, line[:, 0], line[:, 1])], axis=1))
    return float(np.hypot(*(dense - CHART.px([[x, y]])).T).min())


def turned(pose: Pose) -> str:
    """The start in words: its turn and its shift."""
    return f"{degrees(float(pose.angle))}° and {number(float(np.hypot(*pose.t)))} u"
