"""A reader's own clouds: any method that finds its own pairs, from any start, judged without a known truth."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers.core.amounts import amount
from solvers.metrics import rre
from solvers.verify import SPACINGS
from widgets.drawing.picture import Picture, Readout, number, worded
from widgets.engine.contract import Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import Value, choice, slider
from widgets.figures.own_clouds.clouds import (
    EXAMPLES,
    SCANS,
    Clouds,
    Given,
    Raw,
    brought,
    driven,
    example,
    prepared,
    reads,
)
from widgets.figures.own_clouds.downloads import pose_csv, pose_json, script
from widgets.figures.own_clouds.marks import clouds_panel, dragged, handles, heading, objective_chart, plain
from widgets.figures.own_clouds.methods import OPEN, OWN
from widgets.figures.own_clouds.run import Run, begun
from widgets.parts.placing import HANDLES
from widgets.parts.room import PLACING

TEN = 10
_METHODS: dict[str, dict[str, Value]] = {name: own.brings() for name, own in OWN.items()}
# Two scans of the drive set what its chain of scans is made with; that gate of 0.5 m is some four spacings.
_CLOUDS: dict[str, dict[str, Value]] = {
    **{name: {"start": "as"} for name in (*EXAMPLES, "own")},
    "drive": {"start": "wheels", "method": "point-to-plane", "length": 4.0, "share": 0.0, "points": 400.0},
}


@dataclass(frozen=True)
class Controls:
    """The reader's settings. A method sets the length and the share that suit it."""

    clouds: str = choice("room", "Clouds", {**EXAMPLES, "own": "Your own"}, "", "nothing", _CLOUDS)
    method: str = choice("icp", "Method", {name: own.label for name, own in OWN.items()}, "", "pose", _METHODS)
    scan: float = slider(
        100.0, "Source scan", 0.0, SCANS - 1.0, 1.0, "", f"Which of the real drive’s {SCANS} moves", "nothing"
    )
    onto: float = slider(96.0, "Target scan", 0.0, SCANS - 1.0, 1.0, "", "Which of them stays", "nothing")
    start: str = choice(
        "as",
        "Start",
        {"as": "As they lie", "centred": "Centroids together", "wheels": "By the wheels"},
        "Only real scans have odometry; other clouds stay put",
        "nothing",
        places=True,
    )
    length: float = slider(
        OPEN, "Length scale", 0.5, OPEN, 0.5, "×", "The spacing of the target; at 40\u00a0× no gate applies", "pose"
    )
    share: float = slider(0.0, "Without a partner", 0.0, 60.0, 5.0, "%", "Expected share of points", "pose")
    points: float = slider(400.0, "Points at most", 100.0, 1000.0, 50.0, "", "Per cloud; more are thinned", "pose")
    height: float = slider(50.0, "Slice: height", 0.0, 100.0, 1.0, "%", "For clouds in 3-D", "pose")
    thickness: float = slider(100.0, "Slice: thickness", 2.0, 100.0, 1.0, "%", "At 100, everything", "pose")


@dataclass(frozen=True, eq=False)
class State:
    """The controls and the run that they began."""

    controls: Controls
    run: Run

    @property
    def clouds(self) -> Clouds:
        """The clouds that are registered."""
        return self.run.clouds


def start(controls: Controls, seed: int, given: Mapping[str, Given]) -> State:
    """The clouds at the start that the controls give."""
    c = controls
    clouds = prepared(_raw(c, seed, given), c.height / 100.0, c.thickness / 100.0, round(c.points), c.start)
    return State(c, begun(c.method, clouds, c.length, c.share / 100.0, seed, clouds.first))


def _raw(c: Controls, seed: int, given: Mapping[str, Given]) -> Raw:
    if c.clouds == "own":
        return brought(given.get("source"), given.get("target"))
    return driven(round(c.scan), round(c.onto)) if c.clouds == "drive" else example(c.clouds, seed)


def act(state: State, action: Action) -> State:
    """Take one step or several, or begin from another start."""
    run, c = state.run, state.controls
    if action.kind == "drag":
        pose = dragged(run, action.name, action.x, action.y)
        return replace(state, run=begun(c.method, run.clouds, c.length, run.share, run.seed, pose))
    for _ in range(1 if action.name == "step" else TEN):
        run = run.step()
    return replace(state, run=run)


def motion(before: State, after: State) -> Motion | None:
    """The move of one step."""
    if after.run.steps != before.run.steps + 1 or after.run.clouds is not before.run.clouds:
        return None
    fit, anchor = after.clouds.fit, after.clouds.fit.put(after.clouds.anchor)
    return PLACING.motion(fit.seen(before.run.pose), fit.seen(after.run.pose), anchor)


def draw(state: State) -> Picture:
    """Both clouds, the objective over the steps, the pose and its signs."""
    run = state.run
    return Picture(
        (clouds_panel(run), objective_chart(run)),
        _readouts(run),
        _description(state),
        handles(run),
        _note(state),
        frozenset({"step", "ten"} if run.done else ()),
    )


def _readouts(run: Run) -> tuple[Readout, ...]:
    c, signs = run.clouds, run.evidence
    x, y = (number(float(v), c.decimals) for v in run.pose.t)
    return (
        Readout("rotation", "Rotation", heading(run.pose), "°", "source"),
        Readout("x", "Translation x", x, c.unit, "source"),
        Readout("y", "Translation y", y, c.unit, "source"),
        Readout("scale", "Scale", number(float(run.pose.scale), 4)),
        Readout("rms", "Residual RMS", *_rms(run)),
        Readout("explained", "Source points explained", _share(run), "" if signs is None else "%"),
        Readout("conditioning", "Conditioning", "–" if signs is None else number(float(signs.weakest), 4)),
        Readout("objective", "Objective", plain(run.objective[-1]) if run.objective else "–"),
        Readout("length", "Length in use", _length(run)),
        *_from_graph(run),
        Readout("points", "Points", f"{_counted(c, 0)} and {_counted(c, 1)}"),
        Readout("stop", "Status", f"{run.status}, step {run.steps}" if run.steps else run.status),
    )


def _rms(run: Run) -> tuple[str, str]:
    signs = run.evidence
    if signs is None or not float(signs.share) > 0.0:
        return "–", ""
    return number(float(signs.rms), run.clouds.decimals), run.clouds.unit


def _from_graph(run: Run) -> tuple[Readout, ...]:
    """How far the pose is from that in the drive's closed graph: not the truth, but what 55 loops agree on."""
    reference, shift, turn = run.clouds.raw.graph, ("–", ""), ("–", "")
    if reference is not None:
        shift = number(float(np.linalg.norm(run.pose.t - reference.t)), run.clouds.decimals), run.clouds.unit
        turn = number(float(np.degrees(rre(run.pose, reference))), 2), "°"
    return (
        Readout("translation_graph", "Translation off the drive’s graph", *shift),
        Readout("rotation_graph", "Rotation off the drive’s graph", *turn),
    )


def _share(run: Run) -> str:
    return "–" if run.evidence is None else number(100 * float(run.evidence.share), 1)


def _counted(clouds: Clouds, side: int) -> str:
    n, total = len((clouds.source, clouds.target)[side]), clouds.seen[side]
    return f"{n:,}" if n == total else f"{n:,} of {total:,}"


def _length(run: Run) -> str:
    label = OWN[run.method].length
    if not label:
        return "none: it finds its own"
    if run.length == float("inf"):
        return f"{label} open"
    return f"{label} {number(run.length, run.clouds.decimals)} {run.clouds.unit}"


def _note(state: State) -> str:
    run, c = state.run, state.clouds
    if not c.whole:
        clouds = {"source": (c.raw.source, c.source), "target": (c.raw.target, c.target)}
        missing = [name for name, (raw, _) in clouds.items() if raw is None]
        empty = [name for name, (raw, cloud) in clouds.items() if raw is not None and not len(cloud)]
        if empty:
            return f"No {' and no '.join(empty)} point lies in this slice. Move or thicken it."
        return f"Choose or draw a {' and a '.join(missing)} first."
    if run.done:
        return f"Stopped at step {run.steps}: {_reason(run) or run.status}."
    most = round(state.controls.points)
    thin = [f"{name} {_counted(c, k)}" for k, name in enumerate(("source", "target")) if c.seen[k] > most]
    return f"Thinned: {', '.join(thin)} points." if thin and not run.steps else ""


def _reason(run: Run) -> str:
    """Why the run stopped, with lengths as the readouts print them: a solver calls every unit u."""
    c = run.clouds

    def length(found: re.Match[str]) -> str:
        value = float(found[1])
        return f"{number(value, c.decimals) if round(value, c.decimals) else found[1]} {c.unit}"

    return worded(re.sub(r"(\d[\d.e+-]*) u\b", length, run.reason))


def _told(c: Controls) -> str:
    if c.clouds == "drive":
        return f"Scans {round(c.scan)} and {round(c.onto)} of a robot’s laser, recorded on a real drive, in metres"
    return "The reader’s own clouds" if c.clouds == "own" else f"The example “{EXAMPLES[c.clouds]}”"


def _description(state: State) -> str:
    run, c = state.run, state.clouds
    words = [
        f"{_told(state.controls)}, seen from above:"
        f" {_counted(c, 0)} source points and {_counted(c, 1)} target points."
    ]
    if c.slice:
        words.append(f"It shows heights from {plain(c.slice[0])} to {plain(c.slice[1])} {c.unit}.")
    if run.evidence is not None:
        steps = amount(run.steps, "step")
        words += [
            f"After {steps} of {OWN[run.method].label} the pose turns the source"
            f" by {heading(run.pose, 1)}° and moves it by ({number(float(run.pose.t[0]), c.decimals)},"
            f" {number(float(run.pose.t[1]), c.decimals)}) {c.unit}.",
            f"{number(100 * float(run.evidence.share), 1)} % of the source points have a target point within"
            f" {number(SPACINGS, 0)} spacings, {number(run.reach, c.decimals)} {c.unit}"
            f"{'' if run.evidence.explained.all() else '; the others are faint'}.",
        ]
    if run.done and run.reason:
        words.append(f"The run has stopped: {_reason(run)}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that makes the same run from the same files."""
    c = state.controls
    return script(state.run, c.clouds, round(c.points), (round(c.scan), round(c.onto)))


def files(state: State) -> dict[str, str]:
    """The pose as files; the script is offered by every figure anyway."""
    if not state.clouds.whole:
        return {}
    return {"pose.json": pose_json(state.run), "pose.csv": pose_csv(state.run)}


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "part": {"clouds": "part", "method": "trimmed-icp", "share": 40.0},
    "hall": {"clouds": "hall", "method": "gicp", "thickness": 60.0, "height": 65.0},
    "drive": {"clouds": "drive"},
}

WIDGET = Widget(
    name="own-clouds",
    title="Your own clouds: any method, from any start",
    controls=Controls,
    presets=PRESETS,
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("step", "Step", primary=True),
        Button("ten", "10 steps"),
        Button("run", "Run", "run", repeats="step"),
        Button("finish", "To the end", "run", repeats="ten"),
        Button("back", "Back", "back"),
        Button("reset", "Reset", "reset"),
    ),
    legend=(
        Key("source", "source, which moves; faint where no target point is near"),
        Key("target", "target", "square"),
        Key("ghost", "where the source began"),
        Key("accent", "objective", "line"),
    ),
    handles=HANDLES,
    tape=(({}, ("step",) * 12), ({}, ("ten",) * 3), ({"clouds": "drive"}, ("step",) * 8)),
    motion=motion,
    python=python,
    takes=("source", "target"),
    reads=reads,
    files=files,
    lead=Lead(("main",), ("explained", "rms", "stop"), ("clouds", "method"), ("step", "run", "finish", "reset")),
)
