"""Chapter 0: one room, two poses. The reader is the optimiser and the eye finds the pairs; ICP goes on from there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from solvers import Pose, register
from solvers.metrics import rre, rte
from solvers.scenes.scans import TwoScans, two_scans
from widgets.drawing.picture import (
    Array,
    Arrow,
    Group,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Role,
    Segments,
    View,
    degrees,
    number,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import slider
from widgets.parts.placing import HANDLES, Placing, place, written
from widgets.parts.robot import disc

WORLD = View(-5.2, 5.2, -3.5, 3.5, width=480.0)
ROBOT = View(-7.8, 7.8, -5.25, 5.25, width=480.0)
PLACING = Placing(ROBOT, limit=(4.5, 3.0), reach=3.2, least=2.0, panel="robot")
ROBOT_ITSELF = np.zeros(2)  # the origin of the robot's coordinates, where its scan is held
GLYPH = disc(0.42, 0.6 * 0.42)
ICP: Final = "capped-icp"  # each scan sees walls that the other does not: points without a close partner must not pull
FOUND = 3.0, 0.1  # degrees and u from the truth within which the scans are aligned


@dataclass(frozen=True)
class Controls:
    """How the robot moved, and how well it measures."""

    turn: float = slider(50.0, "Turn between the poses", -180.0, 180.0, 5.0, "°")
    distance: float = slider(2.0, "Distance between them", 0.0, 3.5, 0.1, "u")
    noise: float = slider(0.03, "Noise σ", 0.0, 0.2, 0.01, "u", "Of the measured range, along the ray")


@dataclass(frozen=True, eq=False)
class State:
    """world: the panel that no action changes. pose: the source scan's. by_hand: where the reader had put it before
    pressing a button. shown: "icp" for where that stops, "answer", or "" for the reader's own pose."""

    controls: Controls
    seed: int
    scans: TwoScans
    world: Panel
    pose: Pose
    by_hand: Pose | None = None
    shown: str = ""


def start(controls: Controls, seed: int) -> State:
    """Both scans in the robot's own coordinates, with the robot at the origin."""
    scans = two_scans(seed=seed, noise=controls.noise, turn=controls.turn, distance=controls.distance)
    return State(controls, seed, scans, _world(scans), Pose.identity())


def act(state: State, action: Action) -> State:
    """Move the source scan, let ICP go on from there, or show where it belongs."""
    if action.kind == "drag":
        return replace(state, pose=PLACING.act(state.pose, ROBOT_ITSELF, action), by_hand=None, shown="")
    if action.name in _idle(state):
        return state
    scans, by_hand = state.scans, state.by_hand or state.pose
    if action.name == "answer":
        return replace(state, pose=scans.truth, by_hand=by_hand, shown="answer")
    return replace(state, pose=_icp(state.scans, state.pose), by_hand=by_hand, shown="icp")


def _icp(scans: TwoScans, start: Pose) -> Pose:
    return register(scans.source, scans.target, ICP, start=start).pose


def _idle(state: State) -> frozenset[str]:
    """The buttons that would change nothing."""
    return frozenset({"": (), "icp": ("icp",), "answer": ("icp", "answer")}[state.shown])


def motion(before: State, after: State) -> Motion | None:
    """The motion from the last pose to where ICP stops, or to the answer, about the source's robot."""
    if before.shown == after.shown or not after.shown:
        return None
    return PLACING.motion(before.pose, after.pose, ROBOT_ITSELF)


def nearest(state: State) -> float:
    """The RMS distance of the moved source points to their nearest target points, u."""
    distances = np.linalg.norm(state.pose.apply(state.scans.source)[:, None] - state.scans.target, axis=2)
    return float(np.sqrt((distances.min(axis=1) ** 2).mean()))


def draw(state: State) -> Picture:
    """The room from above, and the two scans in the coordinates of the target's robot."""
    scans = state.scans
    turn = float(np.degrees(rre(state.pose, scans.truth)))
    shift, near = float(rte(state.pose, scans.truth)), nearest(state)
    readouts = (
        Readout("nearest", "Distance to the nearest points, RMS", number(near, 3), "u", "source"),
        Readout("rotation_error", "Rotation error", number(turn, 1), "°"),
        Readout("translation_error", "Translation error", number(shift), "u"),
    )
    return Picture(
        (
            state.world,
            Panel(
                "robot", "Both scans in the robot’s own coordinates", ROBOT, _robot(state), caption="What the robot has"
            ),
        ),
        readouts,
        _description(state, near, turn, shift),
        PLACING.handles(state.pose, ROBOT_ITSELF),
        _note(state),
        _idle(state),
    )


def _note(state: State) -> str:
    pose, truth = state.pose, state.scans.truth
    errors = _error_text(pose, truth)
    if state.by_hand is None:
        return f"Aligned: {errors} from the truth." if _aligned(pose, truth) else ""
    if state.shown == "icp":
        end = "stopped" if _aligned(pose, truth) else "stopped in the wrong place,"
        return f"ICP began {_error_text(state.by_hand, truth)} from the truth and {end} {errors} from it."
    subject = "The start was" if np.array_equal(state.by_hand.matrix, np.eye(3)) else "By hand it was"
    return f"The answer. {subject} {_error_text(state.by_hand, truth)} from here."


def _error_text(pose: Pose, truth: Pose) -> str:
    return f"{number(float(np.degrees(rre(pose, truth))), 1)}° and {number(float(rte(pose, truth)))} u"


def _aligned(pose: Pose, truth: Pose) -> bool:
    return bool(np.degrees(rre(pose, truth)) <= FOUND[0] and rte(pose, truth) <= FOUND[1])


def _world(scans: TwoScans) -> Panel:
    views: list[tuple[Pose, Array, Role]] = [
        (scans.target_pose, scans.target, "target"),
        (scans.source_pose, scans.source, "source"),
    ]
    marks: list[Mark] = []
    for pose, cloud, role in views:
        hits = pose.apply(cloud[::2])
        marks.append(Segments(np.broadcast_to(pose.t, hits.shape), hits, role, weight=np.full(len(hits), 0.2)))
    marks += [Path(wall, "ink") for wall in scans.walls]
    travel = scans.target_pose.t - scans.source_pose.t
    length = float(np.hypot(*travel))
    if length > 1.2:
        gap = travel / length * 0.55
        marks.append(Arrow(scans.source_pose.t + gap, scans.target_pose.t - gap, "guide"))
    for pose, cloud, role in views:
        marks.append(Points(pose.apply(cloud), role, "square" if role == "target" else "dot", radius=2.5))
    for pose, _, role in views:
        marks += _glyph(pose, role)
    name = "The room from above, with the robot at its two poses"
    return Panel("world", name, WORLD, tuple(marks), caption="The room")


def _robot(state: State) -> tuple[Mark, ...]:
    scans = state.scans
    moved = state.pose.apply(scans.source)
    return (
        Points(scans.target, "target", "square", radius=2.5),
        *_glyph(Pose.identity(), "target"),
        Group(
            "source",
            (
                PLACING.stalk(state.pose, ROBOT_ITSELF),
                Points(moved, "source", radius=2.5),
                *_glyph(state.pose, "source"),
            ),
        ),
    )


def _glyph(pose: Pose, role: Role) -> tuple[Mark, ...]:
    return (Path(pose.apply(GLYPH), role, closed=True, filled=True),)


def _description(state: State, near: float, turn: float, shift: float) -> str:
    c, scans = state.controls, state.scans
    (x, y), heading = place(state.pose, ROBOT_ITSELF)
    k = len(scans.source)
    words = (
        f"A robot has scanned a room with two pillars from two poses, {number(c.distance, 1)} u and"
        f" {number(abs(c.turn), 0)}° apart, with {k} rays each and noise of σ = {number(c.noise)} u."
        f" In the target’s coordinates the robot of the source scan stands at ({number(x, 1)}, {number(y, 1)}) u and"
        f" faces {degrees(heading)}°; its points are {number(near, 3)} u RMS from the nearest target points, and its"
        f" pose {number(turn, 1)}° and {number(shift)} u from the true one."
    )
    ends = {"": "", "icp": " ICP has stopped here.", "answer": " This is the answer: the walls of the scans coincide."}
    return words + ends[state.shown]


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c = state.controls
    names, lines = "Pose", f"pose = {written(state.pose)}  # where the cloud has been put"
    if state.shown == "icp" and state.by_hand:
        names = "Pose, register"
        lines = f"""start = {written(state.by_hand)}  # where the cloud had been put
pose = register(scans.source, scans.target, "{ICP}", start=start).pose"""
    return f"""import numpy as np
from solvers import {names}
from solvers.metrics import rre, rte
from solvers.scans import two_scans

scans = two_scans(seed={state.seed}, noise={c.noise!r}, turn={c.turn!r}, distance={c.distance!r})
{lines}
apart = np.linalg.norm(pose.apply(scans.source)[:, None] - scans.target, axis=2)

print("nearest", np.sqrt((apart.min(axis=1) ** 2).mean()))
print("rotation_error", np.degrees(rre(pose, scans.truth)))
print("translation_error", rte(pose, scans.truth))
"""


WIDGET = Widget(
    name="two-poses",
    title="One scene, two poses",
    controls=Controls,
    presets={"default": {}},
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("answer", "Show the answer"),
        Button("icp", "Let ICP finish"),
        *UNDONE,
    ),
    legend=(
        Key("source", "source scan, which you move"),
        Key("target", "target scan", "square"),
        Key("ink", "walls", "line"),
        Key("guide", "how the robot drove", "line"),
    ),
    handles=HANDLES,
    tape=(({}, ("answer",)), ({}, ("icp",))),
    motion=motion,
    python=python,
    lead=Lead(controls=("turn",), buttons=("answer", "icp", "reset")),
)
