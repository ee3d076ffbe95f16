"""Chapter 0: one room, two poses. The reader is the optimiser and the eye finds the pairs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose
from solvers.metrics import rre, rte
from solvers.scenes.scans import Scans, two_scans
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

WORLD = View(-5.2, 5.2, -3.5, 3.5, width=480.0)
ROBOT = View(-7.8, 7.8, -5.25, 5.25, width=480.0)
PLACING = Placing(ROBOT, limit=(4.5, 3.0), reach=3.2, least=2.0, panel="robot")
ROBOT_ITSELF = np.zeros(2)  # the origin of its own coordinates: a scan is taken hold of by the robot in it
GLYPH = 0.42  # u, from the middle of the robot to its nose


@dataclass(frozen=True)
class Controls:
    """How the robot went, and how well it measures."""

    turn: float = slider(50.0, "Turn between the poses", -180.0, 180.0, 5.0, "°")
    distance: float = slider(2.0, "Distance between them", 0.0, 3.5, 0.1, "u")
    noise: float = slider(0.03, "Noise σ", 0.0, 0.2, 0.01, "u", "Of the measured range, along the ray")


@dataclass(frozen=True, eq=False)
class State:
    """world: the panel that no action changes. pose: where the reader has put the source scan. by_hand: where it was
    when the answer was asked for."""

    controls: Controls
    seed: int
    scans: Scans
    world: Panel
    pose: Pose
    by_hand: Pose | None = None


def start(controls: Controls, seed: int) -> State:
    """Both scans as the robot has them: each with itself at the origin."""
    scans = two_scans(seed=seed, noise=controls.noise, turn=controls.turn, distance=controls.distance)
    return State(controls, seed, scans, _world(scans), Pose.identity())


def act(state: State, action: Action) -> State:
    """Move the source scan, or show where it belongs."""
    if action.kind == "drag":
        return replace(state, pose=PLACING.act(state.pose, ROBOT_ITSELF, action), by_hand=None)
    return state if state.by_hand else replace(state, pose=state.scans.truth, by_hand=state.pose)


def motion(before: State, after: State) -> Motion | None:
    """From the reader's place to the answer, about the source's robot."""
    if before.by_hand or not after.by_hand:
        return None
    return PLACING.motion(before.pose, after.pose, ROBOT_ITSELF)


def nearest(state: State) -> float:
    """RMS distance in u from a moved source point to the target point nearest to it."""
    apart = np.linalg.norm(state.pose.apply(state.scans.source)[:, None] - state.scans.target, axis=2)
    return float(np.sqrt((apart.min(axis=1) ** 2).mean()))


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
    note = ""
    if state.by_hand:
        off, away = np.degrees(rre(state.by_hand, scans.truth)), rte(state.by_hand, scans.truth)
        was = "The start was" if np.array_equal(state.by_hand.matrix, np.eye(3)) else "By hand it was"
        note = f"The answer. {was} {number(float(off), 1)}° and {number(float(away))} u from here."
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
        note,
        frozenset({"answer"} if state.by_hand else ()),
    )


def _world(scans: Scans) -> Panel:
    seen: list[tuple[Pose, Array, Role]] = [
        (scans.target_pose, scans.target, "target"),
        (scans.source_pose, scans.source, "source"),
    ]
    marks: list[Mark] = []
    for pose, cloud, role in seen:
        hits = pose.apply(cloud[::2])
        marks.append(Segments(np.broadcast_to(pose.t, hits.shape), hits, role, weight=np.full(len(hits), 0.2)))
    marks += [Path(wall, "ink") for wall in scans.walls]
    way = scans.target_pose.t - scans.source_pose.t
    length = float(np.hypot(*way))
    if length > 1.2:
        gap = way / length * 0.55
        marks.append(Arrow(scans.source_pose.t + gap, scans.target_pose.t - gap, "guide"))
    for pose, cloud, role in seen:
        marks.append(Points(pose.apply(cloud), role, "square" if role == "target" else "dot", radius=2.5))
    for pose, _, role in seen:
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
    """A robot from above: a disc that points ahead."""
    turn = np.linspace(0.7, 2 * np.pi - 0.7, 25)
    rim = 0.6 * GLYPH * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    outline = np.concatenate([[(GLYPH, 0.0)], rim])
    return (Path(pose.apply(outline), role, closed=True, filled=True),)


def _description(state: State, near: float, turn: float, shift: float) -> str:
    c, scans = state.controls, state.scans
    (x, y), heading = place(state.pose, ROBOT_ITSELF)
    k = len(scans.source)
    words = (
        f"A robot has scanned a room with two pillars from two poses, {number(c.distance, 1)} u and"
        f" {number(c.turn, 0)}° apart, with {k} rays each and noise of σ = {number(c.noise)} u."
        f" In the target’s coordinates the robot of the source scan stands at ({number(x, 1)}, {number(y, 1)}) u and"
        f" faces {degrees(heading)}°; its points are {number(near, 3)} u RMS from the nearest target points, and its"
        f" pose {number(turn, 1)}° and {number(shift)} u from the true one."
    )
    return words + (" This is the answer: the walls of the two scans coincide." if state.by_hand else "")


def python(state: State) -> str:
    """The same numbers from the solvers package alone."""
    c = state.controls
    return f"""import numpy as np
from solvers import Pose
from solvers.metrics import rre, rte
from solvers.scans import two_scans

scans = two_scans(seed={state.seed}, noise={c.noise!r}, turn={c.turn!r}, distance={c.distance!r})
pose = {written(state.pose)}  # where the cloud has been put
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
        Button("answer", "Show the answer", primary=True),
        *UNDONE,
    ),
    legend=(
        Key("source", "source scan, which you move"),
        Key("target", "target scan", "square"),
        Key("ink", "walls", "line"),
        Key("guide", "how the robot drove", "line"),
    ),
    handles=HANDLES,
    tape=(({}, ("answer",)),),
    motion=motion,
    python=python,
    lead=Lead(controls=("turn",), buttons=("answer", "reset", "new")),
)
