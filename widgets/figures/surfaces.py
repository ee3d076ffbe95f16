"""Rung 3½: pairs that know surfaces. One residual and one weight at a time: what each pair pulls, what none holds."""

from __future__ import annotations

from dataclasses import dataclass, replace

from solvers.core.amounts import amount
from solvers.scenes.rooms import room_start
from widgets.drawing.picture import Mark, Panel, Picture, Readout, degrees, number
from widgets.engine.contract import ITERATED, Action, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called, named
from widgets.parts.placing import HANDLES, place, written
from widgets.parts.room import ANCHOR, PLACING, VIEW, error_chart, start_choice, start_offset, start_turn
from widgets.parts.surface_marks import (
    condition,
    covariance_words,
    fixed,
    ghost,
    left_free,
    moving,
    pairs,
    residual_unit,
    weak_direction,
    weak_label,
    weight_chart,
)
from widgets.parts.surface_run import (
    CALLS,
    METHOD,
    RESIDUALS,
    SCENES,
    STEPS,
    WEIGHTS,
    Ask,
    Run,
    along_across,
    anew,
    kept,
    scene_of,
)


@dataclass(frozen=True)
class Controls:
    """The reader's settings. A start sets its turn and offset; a change of residual or weight keeps the presses."""

    scene: str = choice("room", "Scene", SCENES, sets={name: {"noise": 0.02, "outliers": 0.0} for name in SCENES})
    residual: str = choice("plane", "Residual", RESIDUALS, keeps="log")
    weight: str = choice("none", "Weight", WEIGHTS, keeps="log")
    start: str = start_choice("midway")
    turn: float = start_turn("midway")
    offset: float = start_offset("midway")
    noise: float = slider(0.02, "Noise σ", 0.0, 0.3, 0.01, "u", keeps="pose")
    outliers: float = slider(0.0, "Outliers", 0.0, 50.0, 5.0, "%", "Of each cloud, at random", "pose")
    trim: float = slider(0.0, "Trim", 0.0, 60.0, 5.0, "%", "Farthest pairs, discarded", "pose")


@dataclass(frozen=True, eq=False)
class State:
    """The controls, the run that they began, and the marks that do not change."""

    controls: Controls
    run: Run
    fixed: tuple[Mark, ...]


def start(controls: Controls, seed: int) -> State:
    """The scene, with a run from the start that the two sliders give."""
    c = controls
    scene = scene_of(c.scene, seed, c.noise, c.outliers / 100.0)
    run = kept(Ask(c.residual, c.weight, c.trim / 100.0), scene)
    return State(c, anew(run, room_start(c.turn, c.offset)), fixed(run))


def act(state: State, action: Action) -> State:
    """Take one step, take all remaining steps, or begin from another start."""
    run = state.run
    if action.kind == "drag":
        return replace(state, run=anew(run, PLACING.act(run.pose, ANCHOR, action)))
    return replace(state, run=run.finish() if action.name == "finish" else run.step())


def motion(before: State, after: State) -> Motion | None:
    """The move of one step."""
    if after.run.steps != before.run.steps + 1:
        return None
    return PLACING.motion(before.run.pose, after.run.pose, ANCHOR)


def draw(state: State) -> Picture:
    """The scene with the residuals at the current pose, the weight function, and the errors over the steps."""
    run = state.run
    marks = (
        *ghost(run),
        *state.fixed,
        *pairs(run),
        moving(run),
        *weak_direction(run),
        weak_label(run, VIEW),
    )
    return Picture(
        (
            Panel("main", "The two scans in the target’s coordinates, with the residual of each pair", VIEW, marks),
            weight_chart(run),
            error_chart([e.rotation for e in run.course], [e.translation for e in run.course], STEPS),
        ),
        _readouts(state.controls, run),
        _description(state.controls, run),
        PLACING.handles(run.pose, ANCHOR),
        _note(run),
        frozenset({"step", "finish"} if run.done else ()),
    )


def _readouts(c: Controls, run: Run) -> tuple[Readout, ...]:
    last, lone = run.course[-1], c.scene != "room"
    along, across = along_across(run)
    return (
        Readout("rms", "RMS of the residual", number(last.rms, 3), residual_unit(c.residual), "source"),
        Readout("used", "Pairs used", f"{int(run.used.sum())} of {len(run.moved)}"),
        Readout("scale", "Scale s of the distances", number(run.scale, 3), "u"),
        Readout("condition", "Condition number", condition(run), "", "weak"),
        Readout("free", "Motion left free", left_free(run), "", "weak"),
        Readout("rotation_error", "Rotation error", number(last.rotation, 1), "°"),
        Readout("translation_error", "Translation error", number(last.translation), "u"),
        Readout("along", "Off along the wall", number(abs(along)) if lone else "–", "u" if lone else ""),
        Readout("across", "Off across the wall", number(abs(across)) if lone else "–", "u" if lone else ""),
        Readout("stop", "Stopped", f"{run.status.label}, step {run.steps}" if run.done else f"no, step {run.steps}"),
    )


def _note(run: Run) -> str:
    if run.done:
        return f"Stopped at step {run.steps}: {run.reason}."
    if run.steps == 0:
        return ""
    return f"Step {run.steps}: RMS {number(run.course[-2].rms, 3)} → {number(run.course[-1].rms, 3)}" + (
        f" {residual_unit(run.ask.residual)}."
    )


_SCENE_WORDS = {
    "room": "one room, seen by two scans",
    "wall": "one straight wall, whose middle six tenths the source sees",
    "corridor": "two parallel walls, open at both ends, whose middle six tenths the source sees",
}
_RESIDUAL_WORDS = {
    "point": "The residual is the distance to the nearest target point.",
    "plane": "The residual is the distance along the normal of the nearest target point; blue ticks show the normals.",
    "gicp": "The residual is weighted by the covariances of both points; ellipses show every ninth at 0.4 σ.",
}


def _description(c: Controls, run: Run) -> str:
    n, last = len(run.moved), run.course[-1]
    (x, y), heading = place(run.pose, ANCHOR)
    model = f" The covariances are a model, {covariance_words()}." if c.residual == "gicp" else ""
    words = [
        f"{n} source points and {len(run.scene.target)} target points of {_SCENE_WORDS[c.scene]}:"
        f" noise of σ = {number(c.noise)} u, {number(c.outliers, 0)} % outliers.",
        f"After {amount(run.steps, 'step')} the source is turned by {degrees(heading)}°, with its"
        f" origin at ({number(x)}, {number(y)}) u.",
        _RESIDUAL_WORDS[c.residual] + model,
        f"{int(run.used.sum())} of {n} pairs are used, at an RMS of {number(last.rms, 3)} {residual_unit(c.residual)};"
        " the harder a pair pulls, compared with the hardest, the stronger its line.",
        f"The weight is {'one for all' if c.weight == 'none' else WEIGHTS[c.weight] + '’s'}; the scale of the distances"
        f" is {number(run.scale, 3)} u.",
        f"The condition number is {condition(run)}: {run.freedom or 'every direction is constrained'}.",
        f"The pose is {number(last.rotation, 1)}° and {number(last.translation)} u from the truth.",
    ]
    if c.scene != "room":
        along, across = along_across(run)
        words.append(f"The scan is off by {number(abs(along))} u along the wall and {number(abs(across))} u across it.")
    if run.done:
        words.append(f"The run has stopped: {run.reason}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, run = state.controls, state.run
    call = CALLS[c.scene]
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        f"from solvers.{'scenes' if call == 'room' else 'wall_scenes'} import {call}",
        "",
        f"scene = {call}(seed={run.scene.seed}, noise={c.noise!r}, outliers={c.outliers / 100!r})",
        f"start = {written(run.began)}",
        *called(
            "result = register", "scene.source", "scene.target", f'"{METHOD[c.residual]}"', "start=start",
            f"max_steps={run.steps}", *named(run.ask.options),
        ),
        "",
        'print("rms", result.detail("pairing").rms)',
        *([] if c.residual == "point" else ['print("condition", result.detail("system").condition)']),
        'print("rotation_error", np.degrees(rre(result.pose, scene.truth)))',
        'print("translation_error", rte(result.pose, scene.truth))',
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="surfaces",
    title="Residuals and weights: how each pair pulls",
    controls=Controls,
    presets={
        "default": {},
        "point": {"residual": "point"},
        "gicp": {"residual": "gicp"},
        "wall": {"scene": "wall", "start": "near"},
        "corridor": {"scene": "corridor", "start": "near"},
        "weights": {"outliers": 20.0, "start": "near", "weight": "tukey"},
    },
    start=start,
    act=act,
    draw=draw,
    buttons=ITERATED,
    legend=(
        Key("source", "source, which moves"),
        Key("target", "target", "square"),
        Key("pair", "residual of a pair: stronger lines pull harder", "line"),
        Key("normal", "target’s normal (plane) or covariance at 0.4 σ (GICP)", "line"),
        Key("weak", "direction the pairs constrain least", "line"),
        Key("outlier", "displaced source point", "cross"),
        Key("ghost", "pair not used", "ring"),
        Key("ghost", "where the run began", "dotted"),
        Key("truth", "walls", "line"),
    ),
    handles=HANDLES,
    tape=(({}, ("step",) * 4), *(({"residual": name}, ("finish",)) for name in RESIDUALS)),
    motion=motion,
    python=python,
    lead=Lead(
        panels=("main", "errors"),
        readouts=("rms", "rotation_error", "translation_error"),
        controls=("residual",),
        buttons=("step", "run", "finish", "reset"),
    ),
)
