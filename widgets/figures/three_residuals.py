"""Point, plane and covariance residuals side by side, from one start and step by step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from solvers.scenes.rooms import room_start
from widgets.drawing.chart import Axis, Series, chart
from widgets.drawing.picture import Handle, Label, Mark, Panel, Picture, Readout, Role, Segments, View, degrees, number
from widgets.engine.contract import ITERATED, Action, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import named
from widgets.parts.placing import Placing, place, written
from widgets.parts.room import ANCHOR, start_choice, start_offset, start_turn, with_marks
from widgets.parts.surface_marks import Carried, carried, fixed, ghost, moving, pairs, weak_direction, weak_words
from widgets.parts.surface_run import CALLS, METHOD, SCENES, STEPS, WEIGHTS, Ask, Run, anew, kept, scene_of

NAMES = {"point": "Point to point", "plane": "Point to plane", "gicp": "GICP"}
FIRST = "point"  # at a start, the others draw its moving marks
ROLES: dict[str, Role] = {"point": "source", "plane": "normal", "gicp": "ink"}
VIEW = View(-6.4, 6.4, -4.6, 4.6, width=480.0)
PLACINGS = {name: Placing(VIEW, limit=(4.5, 2.75), reach=2.6, least=1.6, panel=name) for name in NAMES}
ARRIVED = 0.1  # u
HIGHEST, LOWEST = 10.0, 0.001
KEY = (-2.3, -2.56, -2.82)  # heights of the names in the chart, log10 u


@dataclass(frozen=True)
class Controls:
    """The reader's settings, the same for all three."""

    scene: str = choice("room", "Scene", SCENES, sets={name: {"noise": 0.02, "outliers": 0.0} for name in SCENES})
    weight: str = choice("none", "Weight", WEIGHTS, keeps="log")
    start: str = start_choice("midway")
    turn: float = start_turn("midway")
    offset: float = start_offset("midway")
    noise: float = slider(0.02, "Noise σ", 0.0, 0.3, 0.01, "u", keeps="pose")
    outliers: float = slider(0.0, "Outliers", 0.0, 50.0, 5.0, "%", "Of each cloud, at random", "pose")


@dataclass(frozen=True, eq=False)
class State:
    """The controls, the three runs that they began, by residual, and the marks of each that do not change."""

    controls: Controls
    runs: dict[str, Run]
    fixed: dict[str, tuple[Mark, ...]]

    @property
    def steps(self) -> int:
        """The greatest number of steps taken by any."""
        return max(run.steps for run in self.runs.values())

    @property
    def done(self) -> bool:
        """Whether all have stopped."""
        return all(run.done for run in self.runs.values())


def start(controls: Controls, seed: int) -> State:
    """One scene and one start for all three."""
    c = controls
    scene, pose = scene_of(c.scene, seed, c.noise, c.outliers / 100.0), room_start(c.turn, c.offset)
    runs = {name: kept(Ask(name, c.weight, 0.0), scene) for name in NAMES}
    return State(c, _from(runs, pose), {name: fixed(run) for name, run in runs.items()})


def _from(runs: dict[str, Run], pose: Pose) -> dict[str, Run]:
    """All three from one start."""
    first = anew(runs[FIRST], pose)
    return {name: first if name == FIRST else anew(run, pose, first) for name, run in runs.items()}


def act(state: State, action: Action) -> State:
    """Take one step of each, take all remaining steps, or begin all from another start."""
    if action.kind == "drag":
        name, handle = action.name.split("-")
        run = state.runs[name]
        pose = PLACINGS[name].act(run.pose, ANCHOR, replace(action, name=handle))
        return replace(state, runs=_from(state.runs, pose))
    finish = action.name == "finish"
    return replace(state, runs={key: one.finish() if finish else one.step() for key, one in state.runs.items()})


def motion(before: State, after: State) -> tuple[Motion, ...]:
    """The move of one step, for each run that took one."""
    return tuple(
        PLACINGS[name].motion(before.runs[name].pose, run.pose, ANCHOR)
        for name, run in after.runs.items()
        if run.steps == before.runs[name].steps + 1
    )


def draw(state: State) -> Picture:
    """The three runs, and a chart of how far each is from the truth over the steps."""
    apart = state.runs if state.steps else {FIRST: state.runs[FIRST]}
    grips = {name: PLACINGS[name].handles(run.pose, ANCHOR) for name, run in apart.items()}
    carries = {name: carried(run, PLACINGS[name]) for name, run in apart.items()}
    panels = (
        _panel(name, run, state.fixed[name], carries.get(name, carries[FIRST])) for name, run in state.runs.items()
    )
    return Picture(
        (*panels, _chart(state)),
        _readouts(state),
        _description(state),
        tuple(handle for name in NAMES for handle in _handles(name, grips.get(name, grips[FIRST]))),
        _note(state),
        frozenset({"step", "finish"} if state.done else ()),
    )


def _panel(name: str, run: Run, still: tuple[Mark, ...], carries: Carried) -> Panel:
    marks = (
        *ghost(run),
        *still,
        *pairs(run),
        moving(run, carries),
        *weak_direction(run),
    )
    label, caption = f"{NAMES[name]}: the scans and the residuals of their pairs", f"{NAMES[name]}\n{weak_words(run)}"
    return Panel(name, label, VIEW, marks, caption=caption)


def _handles(name: str, both: tuple[Handle, ...]) -> tuple[Handle, ...]:
    return tuple(replace(h, name=f"{name}-{h.name}", label=f"{h.label} in all three", panel=name) for h in both)


def _key() -> list[Mark]:
    """The names of the lines, in a corner that lines hardly ever reach: at the lines' ends, names would overlap."""
    marks: list[Mark] = []
    for y, (name, label) in zip(KEY, NAMES.items(), strict=True):
        marks.append(Segments([27.0, y], [28.8, y], ROLES[name], dashed=name == "gicp"))
        marks.append(Label([STEPS - 0.4, y], label, ROLES[name], "end", dy=4))
    return marks


def _chart(state: State) -> Panel:
    panel = chart(
        "errors",
        "Distance of the points from their true positions, over the steps, for each of the three",
        [
            Series(
                np.arange(len(run.course)),
                [entry.point for entry in run.course],
                ROLES[name],
                dashed=name == "gicp",
                dots=name == "plane",
            )
            for name, run in state.runs.items()
        ],
        Axis("step", 0.0, float(STEPS)),
        Axis("Points off their true positions, RMS, u", LOWEST, HIGHEST, log=True),
        now=float(state.steps),
        size=(480.0, 345.0),
        caption="All three over the steps",
    )
    return with_marks(panel, *_key())


def _readouts(state: State) -> tuple[Readout, ...]:
    out: list[Readout] = []
    for name, run in state.runs.items():
        last, short = run.course[-1], NAMES[name]
        out += [
            Readout(f"{name}_rotation", f"{short}: rotation error", number(last.rotation, 1), "°", ROLES[name]),
            Readout(f"{name}_translation", f"{short}: translation error", number(last.translation), "u"),
            Readout(f"{name}_steps", f"{short}: steps", f"{run.steps}, {_status(run)}"),
        ]
    return tuple(out)


def _status(run: Run) -> str:
    return run.status.label if run.steps or run.done else "not begun"


def _note(state: State) -> str:
    if state.steps == 0:
        return ""
    if state.done:
        point, plane, gicp = (state.runs[name].steps for name in NAMES)
        ends = f"{point} (point), {plane} (plane) and {gicp} (GICP)"
        return f"Stopped at steps {ends}. A stop says nothing about the truth."
    near = [NAMES[name] for name, run in state.runs.items() if run.course[-1].point < ARRIVED]
    return f"Step {state.steps}. Within {number(ARRIVED, 1)} u of the truth: {', '.join(near) or 'none'}."


def _description(state: State) -> str:
    c, one = state.controls, state.runs["point"]
    (x, y), heading = place(one.began, ANCHOR)
    words = [
        f"Three panels show one scene, {SCENES[c.scene].lower()}, with noise of σ = {number(c.noise)} u and"
        f" {number(c.outliers, 0)} % outliers, registered by three residuals from one start:"
        f" turned by {degrees(heading)}°, origin at ({number(x)}, {number(y)}) u."
        f" The weight is {'one for all pairs' if c.weight == 'none' else WEIGHTS[c.weight] + '’s'}."
    ]
    for name, run in state.runs.items():
        last = run.course[-1]
        words.append(
            f"{NAMES[name]} after {amount(run.steps, 'step')}, {_status(run)}:"
            f" {number(last.rotation, 1)}° and {number(last.translation)} u from the truth;"
            f" {run.freedom or 'its pairs constrain every direction'}."
        )
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, one = state.controls, state.runs["point"]
    call = CALLS[c.scene]
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        f"from solvers.{'scenes' if call == 'room' else 'wall_scenes'} import {call}",
        "",
        f"scene = {call}(seed={one.scene.seed}, noise={c.noise!r}, outliers={c.outliers / 100!r})",
        f"start = {written(one.began)}",
        "runs = {",
    ]
    for name, run in state.runs.items():
        options = ", ".join(named({"max_steps": run.steps, **run.ask.options}))
        lines.append(f'    "{name}": ("{METHOD[name]}", dict({options})),')
    lines += [
        "}",
        "for name, (method, options) in runs.items():",
        "    result = register(scene.source, scene.target, method, start=start, **options)",
        '    print(f"{name}_rotation", np.degrees(rre(result.pose, scene.truth)))',
        '    print(f"{name}_translation", rte(result.pose, scene.truth))',
    ]
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="three-residuals",
    title="Three residuals from one start",
    controls=Controls,
    presets={
        "default": {},
        "near": {"start": "near"},
        "wall": {"scene": "wall", "start": "near"},
        "outliers": {"outliers": 20.0},
    },
    start=start,
    act=act,
    draw=draw,
    buttons=ITERATED,
    legend=(
        Key("source", "source, which moves; in the chart, point to point"),
        Key("target", "target", "square"),
        Key("pair", "residual of a pair: stronger lines pull harder", "line"),
        Key("normal", "target’s normal or covariance at 0.4 σ; in the chart, point to plane", "line"),
        Key("truth", "walls", "line"),
        Key("weak", "direction the pairs constrain least", "line"),
        Key("ghost", "where the run began", "dotted"),
    ),
    handles=tuple(f"{name}-{handle}" for name in NAMES for handle in ("source", "turn")),
    tape=(({}, ("step",) * 3), ({}, ("finish",))),
    motion=motion,
    python=python,
    lead=Lead(
        panels=("point", "plane", "gicp"),
        readouts=("point_rotation", "plane_rotation", "gicp_rotation"),
        controls=("start",),
        buttons=("step", "run", "finish", "reset"),
    ),
)
