"""Rung 5b: two clouds compared by their mean features, wave by wave, and the source moved until the means agree."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers import METHODS, Pose, Status
from solvers.core.amounts import amount
from solvers.core.method import Problem
from solvers.core.stepper import Batch, advance, begin
from solvers.methods.mmd.mmd import MmdState
from solvers.numerics.fourier_features import mean_features, mean_kernel, unit_frequencies
from solvers.scenes.rooms import Scene, room, room_start
from solvers.studies.race import CONTESTANTS
from widgets.drawing.picture import Array, Mark, Panel, Picture, Readout, degrees, number
from widgets.engine.contract import Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called
from widgets.parts.feature_marks import MAP, convergence, crests, phases, waves
from widgets.parts.placing import HANDLES, place, written
from widgets.parts.room import (
    ANCHOR,
    BRINGS,
    PLACING,
    SETTINGS,
    error_chart,
    errors,
    outline,
    problem,
    single,
    source,
    still,
)

STEPS = 40
PLACED = replace(PLACING, view=MAP)
MOST = 128  # waves of a draw; D takes the first of them
SCHEDULE = tuple(next(c for c in CONTESTANTS if c.method == "mmd").options["lengths"])


@dataclass(frozen=True)
class Controls:
    """The reader's settings. A room sets its noise and outliers."""

    scene: str = choice("clean", "Room", SETTINGS, sets=BRINGS, keeps="pose")
    schedule: str = choice(
        "fixed",
        "Length scale",
        {"fixed": "ℓ as set", "schedule": "Coarse → fine"},
        "Coarse → fine goes 2.4, 1.2, 0.6, 0.3 u",
        "pose",
    )
    length: float = slider(1.2, "Length scale ℓ", 0.2, 4.0, 0.1, "u", "Unused by coarse → fine", "pose")
    count: float = slider(32.0, "D, waves used", 2.0, float(MOST), 2.0, keeps="pose")
    wave: float = slider(1.0, "Wave shown", 1.0, 32.0, 1.0, "", "In drawing order")
    turn: float = slider(30.0, "Start: turn", -180.0, 180.0, 1.0, "°", keeps="nothing")
    offset: float = slider(1.0, "Start: offset", 0.0, 3.0, 0.01, "u", keeps="nothing")
    noise: float = slider(0.02, "Noise σ", 0.0, 0.3, 0.01, "u", keeps="pose")
    outliers: float = slider(0.0, "Outliers", 0.0, 50.0, 5.0, "%", "Of each cloud, at random", "pose")
    overlap: float = slider(100.0, "Target seen", 30.0, 100.0, 5.0, "%", "The part of the room in the target", "pose")
    density: float = slider(1.0, "Source density", 0.3, 2.0, 0.1, "×", keeps="pose")


@dataclass(frozen=True, eq=False)
class State:
    """A run from `began` with the frequencies of draw number `draws`. course: both errors at every pose so far.

    unit: (MOST, 2) the frequencies in units of 1/ℓ. fixed: for every length scale of the run, what no motion changes:
    the sum of each cloud's mean kernel with itself, and MMD² at the truth. backdrop: the marks that no step moves.
    """

    controls: Controls
    scene: Scene
    draws: int
    unit: Array
    began: Pose
    batch: Batch[MmdState]
    course: tuple[tuple[float, float], ...]
    fixed: dict[float, tuple[float, float]]
    backdrop: tuple[Mark, ...]

    @property
    def now(self) -> MmdState:
        """The solver's state, a batch of one."""
        return self.batch.state()

    @property
    def pose(self) -> Pose:
        """The source's current pose."""
        return single(self.batch.pose())

    @property
    def length(self) -> float:
        """The current ℓ, u."""
        return float(self.now.length[0])


def start(controls: Controls, seed: int) -> State:
    """The scene, with a run from the start that the two sliders give."""
    c = controls
    scene = room(
        c.scene, seed=seed, noise=c.noise, outliers=c.outliers / 100.0, overlap=c.overlap / 100.0, density=c.density
    )
    fixed = {length: _fixed(scene, length) for length in lengths(c)}
    return _new_state(c, scene, 0, room_start(c.turn, c.offset), fixed, still(scene))


def lengths(c: Controls) -> tuple[float, ...]:
    """The length scales of a run, u."""
    return SCHEDULE if c.schedule == "schedule" else (c.length,)


def _seed(scene: Scene, draws: int) -> int:
    """The seed of the frequencies: the scene's own, and another for every redraw."""
    return scene.seed + 1000 * draws


def _new_state(
    c: Controls,
    scene: Scene,
    draws: int,
    initial: Pose,
    fixed: dict[float, tuple[float, float]],
    backdrop: tuple[Mark, ...],
) -> State:
    method = METHODS["mmd"]
    instance: Problem = replace(problem(scene, initial), seed=np.array([_seed(scene, draws)]))
    batch = begin(method, instance, method.options(lengths=lengths(c), count=round(c.count)), STEPS)
    unit = unit_frequencies(instance.seed, MOST, 2)[0]
    return State(c, scene, draws, unit, initial, batch, (errors(initial, scene.truth),), fixed, backdrop)


def _fixed(scene: Scene, length: float) -> tuple[float, float]:
    own = sum(mean_kernel(cloud, cloud, length) for cloud in (scene.source, scene.target))
    return own, own - 2.0 * mean_kernel(scene.truth.apply(scene.source), scene.target, length)


def act(state: State, action: Action) -> State:
    """Take one step, take all remaining steps, redraw the frequencies, or begin from another start."""
    c, scene, draws, initial = state.controls, state.scene, state.draws, state.began
    if action.kind == "drag":
        return _new_state(c, scene, draws, PLACED.act(state.pose, ANCHOR, action), state.fixed, state.backdrop)
    if action.name == "resample":
        return _new_state(c, scene, draws + 1, initial, state.fixed, state.backdrop)
    state = _stepped(state)
    while action.name == "finish" and not state.batch.done:
        state = _stepped(state)
    return state


def _stepped(state: State) -> State:
    if state.batch.done:
        return state
    batch = advance(state.batch)
    return replace(state, batch=batch, course=(*state.course, errors(single(batch.pose()), state.scene.truth)))


def motion(before: State, after: State) -> Motion | None:
    """The move of one step."""
    if len(after.course) != len(before.course) + 1:
        return None
    return PLACED.motion(before.pose, after.pose, ANCHOR)


@dataclass(frozen=True)
class _Numbers:
    """The numbers of the current pose. apart: (MOST,) the distance between the two means of every wave of the draw."""

    apart: Array
    estimate: float
    exact: float
    at_truth: float
    wave: int


def _numbers(state: State, moved: Array) -> _Numbers:
    target, ell = state.scene.target, state.length
    frequencies = (state.unit / ell)[None]
    gap = (mean_features(moved[None], frequencies) - mean_features(target[None], frequencies))[0] * np.sqrt(MOST)
    distances = np.hypot(gap[:MOST], gap[MOST:])
    own, at_truth = state.fixed[ell]
    exact = own - 2.0 * mean_kernel(moved, target, ell)
    count = round(state.controls.count)
    wave = min(round(state.controls.wave), count) - 1
    return _Numbers(distances, float(np.square(distances[:count]).mean()), exact, at_truth, wave)


def draw(state: State) -> Picture:
    """The room under one wave, that wave's phases, all waves, and the estimate as D grows."""
    c, pose = state.controls, state.pose
    moved = pose.apply(state.scene.source)
    stats = _numbers(state, moved)
    frequency = state.unit[stats.wave] / state.length
    count = round(c.count)
    sizes = np.hypot(*state.unit[:count].T)
    running = np.cumsum(np.square(stats.apart)) / np.arange(1, MOST + 1)
    ghost = outline(state.scene, state.began, "ghost") if len(state.course) > 1 else ()
    marks = (crests(MAP, frequency), *ghost, *state.backdrop, source(state.scene, pose, placing=PLACED))
    rotation, translation = zip(*state.course, strict=True)
    return Picture(
        (
            Panel("main", "The two scans in the target’s coordinates, under the crests of one wave", MAP, marks),
            phases(moved, state.scene.target, frequency),
            waves(sizes, stats.apart[:count], stats.wave),
            convergence(running, stats.exact, stats.at_truth, count),
            error_chart(rotation, translation, STEPS),
        ),
        _readouts(state, stats),
        _description(state, stats),
        PLACED.handles(pose, ANCHOR),
        _note(state, stats),
        frozenset({"step", "finish"} if state.batch.done else ()),
    )


def _readouts(state: State, stats: _Numbers) -> tuple[Readout, ...]:
    rotation, translation = state.course[-1]
    status, steps = Status(int(state.now.status[0])), len(state.course) - 1
    return (
        Readout("estimate", "MMD² estimated from D waves", number(stats.estimate, 4)),
        Readout("exact", "MMD², exact", number(stats.exact, 4), role="source"),
        Readout("exact_truth", "MMD² at the truth, exact", number(stats.at_truth, 4), role="truth"),
        Readout("length", "ℓ", number(state.length), "u"),
        Readout("wave", "Means apart, wave shown", number(float(stats.apart[stats.wave]), 3), role="accent"),
        Readout("rotation_error", "Rotation error", number(rotation, 1), "°"),
        Readout("translation_error", "Translation error", number(translation), "u"),
        Readout("stop", "Stopped", f"{status.label}, step {steps}" if state.batch.done else "no"),
    )


def _note(state: State, stats: _Numbers) -> str:
    steps = len(state.course) - 1
    if state.batch.done:
        return f"Stopped at step {steps}: {state.now.reason[0]}."
    if steps:
        return f"Step {steps} at ℓ = {number(state.length)} u: the estimate is {number(stats.estimate, 4)}."
    if round(state.controls.wave) > round(state.controls.count):
        return f"Only {number(state.controls.count, 0)} waves are used; the last is shown."
    return f"Draw {state.draws + 1} of the frequencies." if state.draws else ""


def _description(state: State, stats: _Numbers) -> str:
    c, scene, steps = state.controls, state.scene, len(state.course) - 1
    (x, y), heading = place(state.pose, ANCHOR)
    frequency = state.unit[stats.wave] / state.length
    rotation, translation = state.course[-1]
    distance = number(float(stats.apart[stats.wave]), 3)
    crest = number(2 * np.pi / float(np.hypot(*frequency)))
    words = [
        f"{len(scene.source)} source points and {len(scene.target)} target points of one room,"
        f" {SETTINGS[c.scene].lower()}, with noise of σ = {number(c.noise)} u, {number(c.outliers, 0)} % outliers;"
        f" the target sees {number(c.overlap, 0)} % of the room, the source is sampled {number(c.density, 1)} times as"
        " densely as usual.",
        f"After {amount(steps, 'step')} the source is turned by {degrees(heading)}°, with its origin"
        f" at ({number(x)}, {number(y)}) u.",
        f"Thin lines are the crests of wave {stats.wave + 1} of {number(c.count, 0)}, {crest} u apart; on the circle"
        f" each point is at its phase, and the two means are {distance} apart.",
        f"With ℓ = {number(state.length)} u the waves together estimate MMD² as {number(stats.estimate, 4)}; exactly it"
        f" is {number(stats.exact, 4)}, and {number(stats.at_truth, 4)} at the true pose.",
        f"The pose is {number(rotation, 1)}° and {number(translation)} u from the truth.",
    ]
    if state.batch.done:
        words.append(f"The run has stopped: {state.now.reason[0]}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, scene = state.controls, state.scene
    return "\n".join(
        [
            "import numpy as np",
            "from solvers import Pose, register",
            "from solvers.features import exact_squared_mmd",
            "from solvers.metrics import rre, rte",
            "from solvers.scenes import room",
            "",
            *called(
                "scene = room", f'"{c.scene}"', f"seed={scene.seed}", f"noise={c.noise!r}",
                f"outliers={c.outliers / 100!r}", f"overlap={c.overlap / 100!r}", f"density={c.density!r}",
            ),
            f"start = {written(state.began)}",
            *called(
                "result = register", "scene.source", "scene.target", '"mmd"', "start=start",
                f"seed={_seed(scene, state.draws)}", f"count={round(c.count)}", f"lengths={lengths(c)!r}",
                f"max_steps={len(state.course) - 1}",
            ),
            f"length = {state.length!r}  # ℓ of the last step",
            "",
            'print("estimate", result.objective)',
            'print("exact", exact_squared_mmd(result.transform(scene.source), scene.target, length))',
            'print("exact_truth", exact_squared_mmd(scene.truth.apply(scene.source), scene.target, length))',
            'print("rotation_error", np.degrees(rre(result.pose, scene.truth)))',
            'print("translation_error", rte(result.pose, scene.truth))',
            "",
        ]
    )  # fmt: skip


PRESETS: dict[str, dict[str, Any]] = {
    "default": {},
    "schedule": {"schedule": "schedule", "turn": 45.0, "offset": 1.43},
    "overlap": {"length": 1.6, "count": float(MOST), "overlap": 60.0, "turn": 0.0, "offset": 0.0},
}

WIDGET = Widget(
    name="mmd",
    title="Distributions compared by their mean features",
    controls=Controls,
    presets=PRESETS,
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("step", "Step", primary=True),
        Button("run", "Run", "run", repeats="step"),
        Button("finish", "To the end"),
        Button("resample", "Draw waves again"),
        Button("back", "Back", "back"),
        Button("reset", "Reset", "reset"),
        Button("new", "New room", "reseed"),
    ),
    legend=(
        Key("source", "source, which moves"),
        Key("target", "target", "square"),
        Key("truth", "the room, source at the true pose", "line"),
        Key("accent", "crests of the wave shown; its two means joined", "line"),
        Key("ghost", "where the run began", "dotted"),
    ),
    handles=HANDLES,
    tape=(({}, ("step",) * 8), ({}, ("finish",)), ({}, ("resample",)), ({}, ("resample", "finish"))),
    motion=motion,
    python=python,
    lead=Lead(
        panels=("main", "phases"),
        readouts=("exact", "wave", "rotation_error"),
        controls=("wave",),
        buttons=("step", "run", "finish", "reset"),
    ),
)
