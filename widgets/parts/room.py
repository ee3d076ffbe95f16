"""A room in two scans, as several figures draw it: the window, the settings, the starts, the marks, the charts.

The true pose of a room scene is the identity and clouds are turned about the world's origin, so a cloud is held there:
the moving handle's place is the pose's translation, the stalk's direction its rotation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from solvers import Pose
from solvers.core.arrays import BoolArray
from solvers.core.method import Problem
from solvers.metrics import rre, rte
from solvers.scenes.rooms import ROOM_SETTINGS, Scene
from widgets.drawing.chart import WIDTH, Axis, Series, chart, steps_axis
from widgets.drawing.picture import FAINT, Array, Group, Mark, Panel, Path, Points, Role, Segments, View
from widgets.engine.controls import Value, choice, slider
from widgets.parts.placing import Placing

VIEW = View(-6.4, 6.4, -4.6, 4.6)
PLACING = Placing(VIEW, limit=(4.5, 2.75), reach=2.6, least=1.6)
ANCHOR = np.zeros(2)
ANCHOR.flags.writeable = False

SETTINGS = {name: name.capitalize() for name in ROOM_SETTINGS}
BRINGS: dict[str, dict[str, Value]] = {
    name: {
        "noise": 0.11 if name in ("noise", "combo") else 0.02,
        "outliers": 20.0 if name in ("outliers", "combo") else 0.0,
    }
    for name in ROOM_SETTINGS
}
"""The controls that each setting sets: the noise's σ in u, and the percentage of each cloud that is replaced."""

STARTS: dict[str, dict[str, Value]] = {
    "near": {"turn": 15.0, "offset": 0.5},
    "midway": {"turn": 45.0, "offset": 1.43},
    "far": {"turn": -110.0, "offset": 1.43},
}
"""Start poses of the source, relative to the true pose: turn in °, offset in u."""


def start_choice(default: str) -> Any:
    """The control that picks one of `STARTS`; `start_turn` and `start_offset` hold its two numbers."""
    return choice(default, "Start", {name: name.capitalize() for name in STARTS}, sets=STARTS, places=True)


def start_turn(default: str) -> Any:
    """The control of the start's turn, by default that of the start `default`."""
    return slider(float(STARTS[default]["turn"]), "Start: turn", -180.0, 180.0, 1.0, "°", keeps="nothing")


def start_offset(default: str) -> Any:
    """The control of the start's offset, by default that of the start `default`."""
    return slider(float(STARTS[default]["offset"]), "Start: offset", 0.0, 3.0, 0.01, "u", keeps="nothing")


def problem(scene: Scene, start: Pose) -> Problem:
    """One registration of the scene from `start`, as a batch of one for `solvers.stepper`."""
    weights, seed = np.ones((1, len(scene.source))), np.array([scene.seed])
    return Problem(scene.source[None], scene.target[None], weights, alone(start), seed)


def alone(pose: Pose) -> Pose:
    """A pose, without its scale, as a batch of one. It is known to be valid, so it is not validated at every frame."""
    return Pose.trusted(pose.R[None], pose.t[None], np.ones(1))


def single(pose: Pose) -> Pose:
    """The one pose of a batch of one."""
    return Pose.trusted(pose.R[0], pose.t[0], np.asarray(pose.scale)[0])


def outline(scene: Scene, pose: Pose, role: Role) -> tuple[Path, ...]:
    """The room at a pose: a broad band for the truth, dotted for a ghost."""
    return tuple(Path(pose.apply(line), role, thick=role == "truth", dotted=role == "ghost") for line in scene.outline)


@lru_cache(maxsize=8)
def still(scene: Scene, ghost: Pose | None = None) -> tuple[Mark, ...]:
    """What does not move: the outline where the run began, the outline at the true pose, the target.

    Without a ghost it is the same for all starts in a scene, and is rendered once.
    """
    ghost_marks = () if ghost is None else outline(scene, ghost, "ghost")
    return (*ghost_marks, *outline(scene, scene.truth, "truth"), Points(scene.target, "target", "square", radius=2.5))


def source(scene: Scene, pose: Pose, used: BoolArray | None = None, placing: Placing = PLACING) -> Group:
    """The moving cloud, the room's outline at its pose, and the stalk of its turning handle, as the group 'source'.

    used: (m,) the points that are drawn in full; the others are faint.
    """
    weight = None if used is None or used.all() else np.where(used, 1.0, 0.3)
    points = Points(pose.apply(scene.source), "source", radius=2.5, weight=weight)
    return Group("source", (placing.stalk(pose, ANCHOR), *outline(scene, pose, "source"), points))


def pair_lines(moved: Array, partners: Array, used: BoolArray, gated: BoolArray) -> tuple[Mark, ...]:
    """One line per pair, from moved (m, 2) to partners (m, 2): the used, those outside a gate, and the rest, trimmed.

    Unused pairs are faint, since they may be the most and the longest.
    """
    trimmed = ~used & ~gated
    return (
        Segments(moved[gated], partners[gated], "outlier", np.full(int(gated.sum()), FAINT), dashed=True),
        Segments(moved[trimmed], partners[trimmed], "weak", np.full(int(trimmed.sum()), FAINT), dashed=True),
        Segments(moved[used], partners[used], "pair"),
    )


def error_chart(rotation: Sequence[float], translation: Sequence[float], steps: int) -> Panel:
    """Both errors against the truth over the steps taken so far: degrees and world units on one logarithmic axis.

    steps: the most that a run can take.
    """
    taken = len(rotation) - 1
    span, axis = steps_axis(taken, steps)
    k = np.arange(taken + 1) / span
    return chart(
        "errors",
        "Errors against the truth over the steps",
        [
            Series(k, rotation, "ink", "rotation, °", dots=True),
            Series(k, translation, "accent", "translation, u", dashed=True, dots=True),
        ],
        axis,
        Axis("Error against the truth, ° and u", 0.01, 300.0, log=True),
        now=taken / span,
        size=(WIDTH, 0.53 * WIDTH),
    )


def with_marks(panel: Panel, *marks: Mark) -> Panel:
    """The panel with these marks on top."""
    return replace(panel, marks=(*panel.marks, *marks))


def errors(pose: Pose, truth: Pose) -> tuple[float, float]:
    """The rotation and translation error of a pose against the truth: degrees, world units."""
    return float(np.degrees(rre(pose, truth))), float(rte(pose, truth))
