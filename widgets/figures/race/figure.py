"""The race: nine solvers on one pair of scans from one start, step by step, and a chart of their errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

from solvers import METHODS, Pose
from solvers.core.amounts import amount
from solvers.scenes.rooms import Scene, room_start
from solvers.studies import race as racing
from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE
from solvers.studies.race import EXTRAS, MAX_STEPS
from widgets.drawing.picture import Mark, Picture, Readout, number
from widgets.engine.contract import Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called, named
from widgets.figures.race.benchmark import BENCHMARK
from widgets.figures.race.field import ENTRIES, STAND_IN, Run, field, stepped, waiting
from widgets.figures.race.panels import PLACING, Stage, chart, drawn, handles, picked, scenery, turned
from widgets.parts.placing import HANDLES, written
from widgets.parts.room import ANCHOR, BRINGS, SETTINGS, problem

AHEAD = 3  # contestants begun in idle time at each level of detail
LEVELS = 4  # of detail, all with the same picture
NINTH = {STAND_IN: ENTRIES[STAND_IN].contestant.label} | {c.method: c.label for c in EXTRAS}


@dataclass(frozen=True)
class Controls:
    """The race's settings. A room sets its noise and outliers, which the sliders can then change."""

    setting: str = choice("combo", "Room", SETTINGS, sets=BRINGS, keeps="pose")
    turn: float = slider(45.0, "Start: turned by", -180.0, 180.0, 1.0, "°", keeps="nothing")
    offset: float = slider(1.43, "Start: moved by", 0.0, 3.0, 0.01, "u", keeps="nothing")
    noise: float = slider(0.11, "Noise σ", 0.0, 0.3, 0.01, "u", "Of both clouds", keeps="pose")
    outliers: float = slider(20.0, "Outliers", 0.0, 60.0, 5.0, "%", "Replaced by junk, in each cloud", keeps="pose")
    overlap: float = slider(100.0, "Overlap", 30.0, 100.0, 5.0, "%", "Of the room, seen by the target", keeps="pose")
    density: float = slider(1.0, "Density", 0.5, 2.0, 0.1, "×", "Of the source, against the usual", keeps="pose")
    ninth: str = choice(STAND_IN, "In the last panel", NINTH, keeps="pose")

    def race(self) -> racing.Controls:
        """The same for `solvers.race`."""
        return racing.Controls(
            self.turn, self.offset, self.setting, self.noise, self.outliers / 100, self.overlap / 100, self.density
        )


@dataclass(frozen=True, eq=False)
class State:
    """placed: whether the start was set by a drag. runs: the nine, in the order of their panels. steps: taken since the
    start; a contestant that has stopped took fewer. followed: the method whose line is highlighted, or ""."""

    controls: Controls
    scene: Scene
    scenery: tuple[Mark, ...]
    start: Pose
    placed: bool
    runs: tuple[Run, ...]
    steps: int = 0
    followed: str = ""

    @property
    def done(self) -> bool:
        """Whether all have stopped."""
        return all(run.done for run in self.runs)


def start(controls: Controls, seed: int) -> State:
    """All nine at the start that the sliders give."""
    for entry in field(controls.ninth):
        METHODS.get(entry.contestant.method)  # imports its module now rather than at the first step
    scene = controls.race().scene(seed)
    return _begun(controls, scene, scenery(scene), room_start(controls.turn, controls.offset), False, "")


def _begun(
    controls: Controls, scene: Scene, behind: tuple[Mark, ...], pose: Pose, placed: bool, followed: str
) -> State:
    stage, one = Stage.of(scene, pose, behind), problem(scene, pose)
    runs = tuple(drawn(waiting(entry, one, scene.truth), stage) for entry in field(controls.ninth))
    return State(controls, scene, behind, pose, placed, runs, followed=followed)


def act(state: State, action: Action) -> State:
    """Step all that still run, once or to the end, begin from another start, or follow a line."""
    if action.kind == "click":
        method = picked(state.runs, action.x, action.y)
        return replace(state, followed="" if method == state.followed else method)
    if action.kind == "drag":
        pose = PLACING.act(state.start, ANCHOR, action)
        return _begun(state.controls, state.scene, state.scenery, pose, True, state.followed)
    stage = Stage.of(state.scene, state.start, state.scenery)
    while not state.done:
        runs = tuple(map(stepped, state.runs))
        state = replace(state, runs=runs, steps=state.steps + 1)
        if action.name == "step":
            break
    return replace(state, runs=tuple(drawn(run, stage) for run in state.runs))


def draw(state: State, detail: int = LEVELS - 1) -> Picture:
    """Nine panels and the chart. A finer level looks the same, but begins more contestants: the next step is faster."""
    for run in state.runs[: detail * AHEAD]:
        if not run.ready:
            _ = run.first
    panels = tuple(run.panel for run in state.runs if run.panel is not None)
    return Picture(
        (*panels, chart(state.runs, state.followed)),
        _readouts(state),
        _description(state),
        handles(state.start, state.runs),
        _note(state),
        frozenset({"step", "finish"} if state.done else ()),
    )


def known(state: State) -> int:
    """The level of detail whose contestants are all ready."""
    ready = next((k for k, run in enumerate(state.runs) if not run.ready), len(state.runs))
    return ready // AHEAD


def _readouts(state: State) -> tuple[Readout, ...]:
    rotation = sorted(run.rotation[-1] for run in state.runs)
    turned = sum(run.turned for run in state.runs)
    close = sum(run.close for run in state.runs)
    return (
        Readout("steps", f"Steps, {MAX_STEPS} at most", str(state.steps)),
        Readout("running", "Still running, of\u00a09", _running(state)),
        Readout("turned", f"Within {CLOSE_DEGREES:g}°, of\u00a09", str(turned)),
        Readout("close", f"Within {CLOSE_DEGREES:g}° and {CLOSE_DISTANCE:g}\u00a0u", str(close)),
        Readout("median", "Median rotation error", number(rotation[4], 1), "°"),
        Readout("largest", "Largest rotation error", number(rotation[8], 1), "°"),
    )


def _running(state: State) -> str:
    """How many have not stopped, as text; a dash before the first step."""
    return str(sum(not run.done for run in state.runs)) if state.steps else "–"


def _note(state: State) -> str:
    if not state.done:
        return ""
    close = [run.entry.contestant.label for run in state.runs if run.close]
    summary = f"All have stopped, {len(close)} of 9 within {CLOSE_DEGREES:g}° and {CLOSE_DISTANCE:g} u"
    return f"{summary}. Another seed may differ."


def _description(state: State) -> str:
    c, scene = state.controls, state.scene
    words = [
        f"Nine small pictures of one room: {len(scene.target)} target points and {len(scene.source)} source points,"
        f" {SETTINGS[c.setting].lower()}, noise of σ = {number(c.noise)} u, {number(c.outliers, 0)} % outliers,"
        f" {number(c.overlap, 0)} % of the room seen by the target."
        f" All nine start from {turned(state.start)}, a dotted grey outline; a broad green one is where the source"
        " belongs."
    ]
    if state.steps == 0:
        words.append("None has taken a step.")
    else:
        words.append(f"After {amount(state.steps, 'step')}, by rotation and translation error:")
        words.append("; ".join(map(_told, state.runs)) + ".")
    words.append("Below, a chart of the nine rotation errors over the steps, on a logarithmic scale.")
    if state.followed:
        words.append(f"The line of {ENTRIES[state.followed].contestant.label} stands out.")
    return " ".join(words)


def _told(run: Run) -> str:
    outcome = f"{run.status} after {run.steps}" if run.done else "running"
    because = f", {run.reason}" if run.reason and run.status.label in ("stalled", "degenerate") else ""
    errors = f"{number(run.rotation[-1], 1)}° and {number(run.translation[-1])} u"
    return f"{run.entry.contestant.label} {errors}, {outcome}{because}"


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, s = state.controls, state.scene
    race = {
        "degrees": c.turn, "distance": c.offset, "setting": c.setting, "noise": c.noise, "outliers": c.outliers / 100,
        "overlap": c.overlap / 100, "density": c.density,
    }  # fmt: skip
    others = "" if c.ninth == STAND_IN else "contestants, "
    lines = [
        *(["from dataclasses import replace", ""] if state.placed else []),
        "import numpy as np",
        *(["from solvers import Pose"] if state.placed else []),
        "from solvers.metrics import rre, rte",
        f"from solvers.race import CONTESTANTS, Controls, {others}race_problem",
        "from solvers.stepper import advance",
        "",
        *called("controls = Controls", *named(race)),
        f"problem, truth = race_problem(controls, seeds=[{s.seed}])",
    ]
    if state.placed:
        lines.append(f"start = {written(state.start)}")
        lines.append("problem = replace(problem, start=Pose(start.R[None], start.t[None]))")
    field_of = "CONTESTANTS" if c.ninth == STAND_IN else f"(*CONTESTANTS[:8], *contestants([{c.ninth!r}]))"
    lines += [
        f"runs = [one.begin(problem) for one in {field_of}]",
        f"for _ in range({state.steps}):",
        "    runs = [advance(run) for run in runs]",
        f"poses = [{'run.pose()' if state.steps else 'problem.start'} for run in runs]",
        "degrees = np.array([np.degrees(rre(pose, truth))[0] for pose in poses])",
        "shifts = np.array([rte(pose, truth)[0] for pose in poses])",
        "",
        f'print("turned", np.sum(degrees < {CLOSE_DEGREES:g}))',
        f'print("close", np.sum((degrees < {CLOSE_DEGREES:g}) & (shifts < {CLOSE_DISTANCE:g})))',
        'print("median", np.median(degrees))',
        'print("largest", degrees.max())',
    ]
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="race",
    title="Nine solvers on one pair of scans, from one start",
    controls=Controls,
    presets={"default": {}, "clean": {"setting": "clean"}},
    start=start,
    act=act,
    draw=draw,
    details=LEVELS,
    known=known,
    buttons=(
        Button("run", "Run", "run", primary=True, repeats="step"),
        Button("step", "Step"),
        Button("finish", "To the end"),
        Button("back", "Back", "back"),
        Button("reset", "Reset", "reset"),
        Button("new", "New seed", "reseed"),
    ),
    legend=(
        Key("source", "source, where the solver has it"),
        Key("target", "target", "square"),
        Key("truth", "where the source belongs", "line"),
        Key("ghost", "the start", "dotted"),
    ),
    handles=HANDLES,
    clicks=("errors",),
    jobs=(BENCHMARK,),
    tape=(({}, ("finish",)), ({}, ("step",) * MAX_STEPS)),
    python=python,
    lead=Lead(
        panels=(*(entry.contestant.method for entry in field(STAND_IN)[:8]), "ninth"),
        readouts=("turned", "close", "running"),
        controls=("setting",),
        buttons=("run", "reset", "new"),
    ),
)
