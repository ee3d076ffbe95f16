"""Rung 13: the solvers in three dimensions, on a mug that can be seen from all sides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers import Pose, Status
from solvers.collinear import poses_about_line
from solvers.core.amounts import amount
from solvers.mug_scene import HEIGHT, RADIUS, Mug
from widgets.drawing.picture import Array, Mark, Panel, Path, Picture, Points, Readout, Role, Segments, Shape, number
from widgets.engine.contract import ITERATED, Action, Key, Lead, Widget
from widgets.engine.controls import choice, slider, toggle
from widgets.engine.script import called, named
from widgets.figures.space.eye import LEVELS, VIEW, Eye
from widgets.figures.space.run import OFFSET, OPTIONS, UNKNOWN, Run, begun, scene_of

TASKS = {"line": "Three in a line", "four": "Four", "icp": "Unknown: ICP", "plane": "Unknown: plane"}
RADII = (2.0, 2.0, 2.0, 4.0, 4.0)
"""Radii of points, px, from far to near."""
OTHERS = np.radians([90.0, 180.0, 270.0])
"""Further turns of the mug for the outlines of other poses that fit as well."""


@dataclass(frozen=True)
class Controls:
    """The reader's settings."""

    task: str = choice("line", "Pairs", TASKS, keeps="pose")
    spin: float = slider(0.0, "Turn about the line", -180.0, 180.0, 5.0, "°", "Of three pairs in a line, once solved")
    turn: float = slider(40.0, "Start: turn", 0.0, 180.0, 5.0, "°", keeps="pose")
    noise: float = slider(0.0, "Noise σ", 0.0, 0.1, 0.01, "u", "Of both clouds; of the targets where pairs are known")
    overlap: float = slider(100.0, "Overlap", 30.0, 100.0, 5.0, "%", "Of the mug’s two clouds", "pose")
    handle: bool = toggle(True, "Handle", "The mug’s own, where pairs are unknown", "pose")


@dataclass(frozen=True, eq=False)
class State:
    """began: the source's start. eye: the viewpoint, which does not affect the run."""

    controls: Controls
    run: Run
    began: Pose
    eye: Eye


def start(controls: Controls, seed: int) -> State:
    """The mug beside its true place, before any step."""
    c = controls
    run = begun(c.task, scene_of(c.task, seed, c.noise, c.overlap / 100.0, c.handle), c.turn)
    return State(c, run, run.pose, Eye())


def act(state: State, action: Action) -> State:
    """Turn the view, take a step, or take all steps."""
    if action.kind == "drag":
        return replace(state, eye=state.eye.at(action.x, action.y))
    spin = float(np.radians(state.controls.spin))
    run = state.run.step(spin)
    while action.name == "finish" and not run.done:
        run = run.step(spin)
    return replace(state, run=run)


def draw(state: State) -> Picture:
    """The panel, the readouts and the words."""
    run = state.run
    free = "–" if run.free is None else f"{run.free} of 6"
    readouts = (
        Readout("rms", "RMS residual, pairs used", number(run.residual, 3), "u", "source"),
        Readout("rotation_error", "Rotation error", number(run.rotation, 1), "°"),
        Readout("away", "Mug off its true pose, RMS", number(run.away, 2), "u"),
        Readout("free", "Directions left free", free),
        Readout("used", "Pairs used", f"{run.used} of {len(run.scene.source)}"),
        Readout("stop", "Stopped", f"{_stop(run)}, step {run.steps}" if run.done else "no"),
    )
    return Picture(
        (Panel("main", "The mug in space, seen from one side", VIEW, _marks(state), grid=False),),
        readouts,
        _description(state),
        (state.eye.handle(),),
        _note(run),
        frozenset({"step", "finish"} if run.done else ()),
    )


def _stop(run: Run) -> str:
    if run.batch is None:
        return "degenerate" if run.free else "solved"
    return Status(int(run.batch.state().status[0])).label


def _marks(state: State) -> tuple[Mark, ...]:
    """The lines of both mugs, the links and the points of each level of depth, from far to near."""
    run, eye = state.run, state.eye
    scene, moved = run.scene, run.moved
    motion = run.pose.compose(scene.truth.inverse())  # takes the upright mug to the source's place
    lines: tuple[tuple[Role, tuple[Array, Array]], ...] = (
        ("target", _pieces(_lines(scene, Pose.identity(3), eye))),
        ("source", _pieces(_lines(scene, motion, eye))),
    )
    has_pairs = run.task not in UNKNOWN
    marks: list[Mark] = [*_ghosts(state)]
    if run.task == "line":
        marks.append(_hinge(scene, eye))
    middles = (moved + run.partners) / 2.0
    clouds: tuple[tuple[Role, Array], ...] = (("target", scene.target), ("source", moved))
    for k in range(LEVELS):
        strength = (k + 2.0) / (LEVELS + 1.0)
        for role, (a, b) in lines:
            rows = eye.level((a + b) / 2.0) == k
            marks.append(Segments(eye.seen(a[rows]), eye.seen(b[rows]), role, np.full(int(rows.sum()), strength)))
        rows = eye.level(middles) == k
        marks.append(Segments(eye.seen(moved[rows]), eye.seen(run.partners[rows]), "pair"))
        for role, points in clouds:
            rows = eye.level(points) == k
            weight = None if has_pairs else np.full(int(rows.sum()), strength)
            shape: Shape = "square" if role == "target" else "dot"
            marks.append(Points(eye.seen(points[rows]), role, shape, 5.0 if has_pairs else RADII[k], weight))
    return tuple(marks)


def _lines(scene: Mug, pose: Pose, eye: Eye) -> list[Array]:
    """Rim, foot, handle and the two visible edges of the wall of a mug, which `pose` moves from its upright place."""
    placement = pose.compose(scene.truth)
    turn = eye.sides(pose.R)
    ring = RADIUS * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    heights = np.linspace(-0.5 * HEIGHT, 0.5 * HEIGHT, 7)
    walls = [np.column_stack([np.broadcast_to(side, (7, 2)), heights]) for side in ring]
    return [*(placement.apply(line) for line in scene.outline), *(pose.apply(wall) for wall in walls)]


def _pieces(lines: list[Array]) -> tuple[Array, Array]:
    """Both ends of every straight piece of the lines, (k, 3) each."""
    return np.concatenate([line[:-1] for line in lines]), np.concatenate([line[1:] for line in lines])


def _ghosts(state: State) -> list[Mark]:
    """The mug at its start, or at the other poses that fit three pairs in a line equally well."""
    run, eye = state.run, state.eye
    if not run.done and not run.steps:
        return []
    if run.task == "line":
        spin = np.radians(state.controls.spin)
        poses = [poses_about_line(run.scene.source, run.scene.target, spin + angle) for angle in OTHERS]
    else:
        poses = [state.began]
    back = run.scene.truth.inverse()
    lines = [line for pose in poses for line in _lines(run.scene, pose.compose(back), eye)]
    return [Path(eye.seen(line), "ghost", dotted=True) for line in lines]


def _hinge(scene: Mug, eye: Eye) -> Mark:
    """The line through three collinear target points, extended beyond them."""
    first, *_, last = scene.target
    reach = 0.4 * (last - first)
    return Segments(eye.seen((first - reach)[None]), eye.seen((last + reach)[None]), "guide", dashed=True)


def _note(run: Run) -> str:
    if not run.steps:
        return ""
    if run.done:
        return f"Stopped at step {run.steps}: {run.reason}."
    return f"Step {run.steps}: {run.used} pairs, residual {number(run.residual, 3)} u RMS."


def _description(state: State) -> str:
    c, run = state.controls, state.run
    n, m = len(run.scene.source), len(run.scene.target)
    if run.task in UNKNOWN:
        mug = "A mug with a handle" if c.handle else "A mug without a handle"
        subject = (
            f"{mug}, sampled twice, {n} and {m} points, noise of σ = {number(c.noise)} u, overlap"
            f" {number(c.overlap, 0)} %. A line joins each source point to the nearest target point."
        )
    else:
        layout = "in a line up its wall" if run.task == "line" else "in no plane"
        subject = (
            f"Two outlines of one mug, and {n} places on it, {layout}, whose partners are known; the targets have noise"
            f" of σ = {number(c.noise)} u."
        )
    words = [
        subject,
        f"It is seen from {state.eye.words}.",
        f"After {amount(run.steps, 'step')} the residual is {number(run.residual, 3)} u RMS over"
        f" {run.used} pairs, and the moving mug is {number(run.rotation, 1)}° and {number(run.away)} u from its true"
        " place.",
    ]
    if run.task == "line" and run.done:
        words.append(
            f"It has been turned by {number(c.spin, 0)}° about the line of the pairs, which changes no residual; dotted"
            f" outlines show it {', '.join(f'{d:.0f}' for d in np.degrees(OTHERS))}° farther on."
        )
    if run.done:
        words.append(f"The run has stopped: {run.reason}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, run = state.controls, state.run
    unknown = run.task in UNKNOWN
    line = "from solvers.collinear import poses_about_line"
    lines = ["import numpy as np", line if run.task == "line" else "from solvers import register"]
    lines.append(f"from solvers.metrics import point_error, {'' if unknown else 'rms, '}rre")
    lines += [f"from solvers.mug_scene import {'mug' if unknown else 'mug_pairs'}, mug_start", ""]
    if unknown:
        settings = f"noise={c.noise!r}, overlap={c.overlap / 100.0!r}, handle={c.handle!r}"
        lines.append(f"scene = mug(seed={run.scene.seed}, {settings})")
        arguments = ["start=start", f"max_steps={run.steps}", *named(OPTIONS[run.task])]
        lines += [
            f"start = mug_start({c.turn!r}, {OFFSET!r})",
            *called("result = register", "scene.source", "scene.target", f'"{UNKNOWN[run.task]}"', *arguments),
            "pose = result.pose",
            "",
            'print("rms", result.detail("pairing").rms)',
        ]
    else:
        lines.append(f'scene = mug_pairs("{run.task}", seed={run.scene.seed}, noise={c.noise!r})')
        line = f"poses_about_line(scene.source, scene.target, np.radians({c.spin!r}))"
        pose = line if run.task == "line" else 'register(scene.source, scene.target, "kabsch").pose'
        call = f"mug_start({c.turn!r}, {OFFSET!r})"
        lines += [
            f"pose = {pose if run.done else f'{call}  # once solved: {pose}'}",
            "",
            'print("rms", rms(pose, scene.source, scene.target))',
        ]
    lines += [
        'print("rotation_error", np.degrees(rre(pose, scene.truth)))',
        'print("away", point_error(pose, scene.truth, np.concatenate(scene.outline)))',
    ]
    return "\n".join(lines) + "\n"


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "four": {"task": "four"},
    "mug": {"task": "plane", "noise": 0.02},
    "points": {"task": "icp", "noise": 0.02},
    "bare": {"task": "plane", "noise": 0.02, "handle": False},
}

WIDGET = Widget(
    name="space",
    title="A mug in space",
    controls=Controls,
    presets=PRESETS,
    start=start,
    act=act,
    draw=draw,
    buttons=ITERATED,
    legend=(
        Key("source", "source, which moves"),
        Key("target", "target", "square"),
        Key("pair", "pair", "line"),
        Key("ghost", "other poses, or where it began", "dotted"),
    ),
    handles=("view",),
    tape=(({}, ("finish",)), ({}, ("step",) * 6)),
    python=python,
    lead=Lead(
        readouts=("rms", "rotation_error", "free"),
        controls=("spin",),
        buttons=("step", "run", "finish", "reset"),
    ),
)
