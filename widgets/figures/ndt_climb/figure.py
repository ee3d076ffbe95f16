"""Chapter 4c: a three-parameter pose climbs the NDT score from one start, at one cell size and from coarse to fine."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from solvers.methods.ndt.ndt import NdtOptions
from solvers.metrics import rre, rte
from solvers.scenes.rooms import Scene
from solvers.scenes.walls import ndt_room
from widgets.drawing.chart import WIDTH, Axis, Series, chart
from widgets.drawing.picture import (
    Array,
    Label,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Ring,
    Role,
    Segments,
    View,
    number,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Widget
from widgets.engine.controls import slider, toggle
from widgets.engine.script import called, named
from widgets.figures.ndt_climb import climb
from widgets.figures.ndt_climb.climb import Climb
from widgets.parts.placing import HANDLES, Placing, written

VIEW = View(-6.4, 6.4, -4.6, 4.6, width=480.0)
PLACING = Placing(VIEW, limit=(4.5, 2.75), reach=2.6, least=1.8, panel="one")
START_DIRECTION = np.array([0.83205, -0.5547])  # the direction of the scene's own start
TRACED = np.array([(-3.0, -2.6), (4.6, 2.6), (-2.0, 2.6)])  # the ends of the scanned walls and a corner between them
COARSER = (4.0, 2.0, 1.0)  # the levels of the second run, in cell sizes of the first
MAX_STEPS = 45
NAMES = {"one": "One cell size", "fine": "Coarse → fine"}
ROLES: dict[str, Role] = {"one": "ink", "fine": "accent"}


@dataclass(frozen=True)
class Controls:
    """The start, the cells, the scan's noise and the longest step."""

    turn: float = slider(25.0, "Start turned by", -90.0, 90.0, 1.0, "°", "About the world’s origin", "nothing")
    shift: float = slider(1.4, "Start shifted by", 0.0, 2.5, 0.05, "u", "Down and to the right", "nothing")
    cell: float = slider(0.8, "Cell size h", 0.4, 2.0, 0.1, "u", "For one run, and the other’s last level", "pose")
    noise: float = slider(0.03, "Noise σ", 0.0, 0.3, 0.01, "u", "Scales the same draw on both clouds", "pose")
    max_shift: float = slider(0.5, "Longest shift", 0.05, 1.5, 0.05, "u", "The step cap of the translation", "pose")
    max_turn: float = slider(0.2, "Longest turn", 0.02, 0.6, 0.02, "rad", "The step cap of the rotation", "pose")
    four: bool = toggle(True, "Four grids", "Three moved by half a cell", "pose")


@dataclass(frozen=True, eq=False)
class State:
    """placed: the start of both runs. one: the run at the cell size only. fine: that from four times the size down."""

    controls: Controls
    scene: Scene
    placed: Pose
    one: Climb
    fine: Climb

    @property
    def anchor(self) -> Array:
        """The scan's centroid, in its own coordinates."""
        return np.asarray(self.scene.source.mean(axis=0))

    @property
    def runs(self) -> dict[str, Climb]:
        return {"one": self.one, "fine": self.fine}


def start(controls: Controls, seed: int) -> State:
    """Both runs at the start that the sliders give."""
    scene = ndt_room(seed=seed, noise=controls.noise)
    pose = Pose.from_angle(np.radians(controls.turn), controls.shift * START_DIRECTION)
    one, fine = (climb.start(scene, pose, _options(controls, name), MAX_STEPS) for name in NAMES)
    return State(controls, scene, pose, one, fine)


def _cells(controls: Controls, name: str) -> tuple[float, ...]:
    factors = (1.0,) if name == "one" else COARSER
    return tuple(round(factor * controls.cell, 3) for factor in factors)


def _options(controls: Controls, name: str) -> NdtOptions:
    return NdtOptions(
        cells=_cells(controls, name),
        grids=4 if controls.four else 1,
        max_shift=controls.max_shift,
        max_turn=controls.max_turn,
    )


def act(state: State, action: Action) -> State:
    """Step both runs; a drag moves the start, and both begin again."""
    if action.kind == "press":
        return replace(state, one=climb.step(state.one), fine=climb.step(state.fine))
    pose = PLACING.act(state.placed, state.anchor, action)
    one, fine = (climb.restart(run, state.scene, pose) for run in state.runs.values())
    return replace(state, placed=pose, one=one, fine=fine)


def draw(state: State) -> Picture:
    """Both maps, the three charts, the readouts and the words."""
    done = all(run.batch.done for run in state.runs.values())
    maps = tuple(_map(state, name) for name in NAMES)
    return Picture(
        (*maps, *_charts(state)),
        _readouts(state),
        _description(state),
        PLACING.handles(state.placed, state.anchor),
        _note(state),
        frozenset({"step", "run"} if done else ()),
    )


# The maps


def _map(state: State, name: str) -> Panel:
    run = state.runs[name]
    level = run.levels[-1]
    start_points = state.placed.apply(state.scene.source[::2])
    marks: list[Mark] = [run.gaussians[level]]
    if run.steps:
        marks.append(Points(start_points, "ghost", radius=2.0))
    marks += [Ring(xy, "truth", radius=8.0) for xy in state.scene.truth.apply(TRACED)]
    marks.append(Points(run.pose.apply(state.scene.source), "source", radius=2.5))
    marks += _traces(run, ROLES[name])
    size = number(_cells(state.controls, name)[level], 1)
    text = f"h = {size} u" if name == "one" else f"level {level + 1} of {len(COARSER)}: h = {size} u"
    marks.append(Label((VIEW.x0, VIEW.y1), text, ROLES[name], dx=10, dy=20))
    label = f"{NAMES[name]}: the scan on the Gaussians of the target’s cells"
    return Panel(name, label, VIEW, tuple(marks), caption=NAMES[name])


def _traces(run: Climb, role: Role) -> list[Mark]:
    """The paths of three points of the scan: a dot per step, with a diamond, cross or ring at special steps."""
    paths = np.stack([state.pose[0].apply(TRACED) for state in run.states])  # (k + 1, 3, 2)
    dashed = role == ROLES["one"]
    marks: list[Mark] = [Path(paths[:, i], role, dashed=dashed) for i in range(len(TRACED))]
    marks.append(Points(paths.reshape(-1, 2), role, radius=2.5))
    for shape, radius, steps in (
        ("diamond", 3.5, [k for k, cap in enumerate(run.caps) if cap]),
        ("cross", 3.0, [k for k, times in enumerate(run.halved) if times]),
        ("ring", 6.0, run.rises),
    ):
        if steps:
            marks.append(Points(paths[steps].reshape(-1, 2), role, shape, radius))  # type: ignore[arg-type]
    return marks


# The charts


def _charts(state: State) -> tuple[Panel, ...]:
    relative = {k: run.relative for k, run in state.runs.items()}
    score = _chart(state, "score", Axis("Score ÷ score at the truth", 0.0, 1.25), relative)
    level = Segments((0.0, 1.0), (MAX_STEPS, 1.0), "truth", dashed=True)
    label = Label((MAX_STEPS, 1.0), "the truth", "truth", "end", dy=-6)
    gradient = _chart(
        state,
        "gradient",
        Axis("Gradient norm, score per u", 1e-2, 1e4, log=True),
        {k: run.gradient for k, run in state.runs.items()},
    )
    damping = _chart(
        state,
        "damping",
        Axis("λ, score per u²; a gap: none needed", 1e1, 1e5, log=True),
        {k: np.where(run.damping > 0.0, run.damping, np.nan) for k, run in state.runs.items()},
    )
    return replace(score, marks=(*score.marks, level, label)), gradient, damping


def _chart(state: State, name: str, y: Axis, values: dict[str, Array]) -> Panel:
    series = [Series(np.arange(len(values[k])), values[k], ROLES[k], dashed=k == "one", dots=True) for k in NAMES]
    panel = chart(
        name,
        f"{y.label}, over the steps of both runs",
        series,
        Axis("step", 0.0, float(MAX_STEPS)),
        y,
        size=(WIDTH, 190.0),
    )
    v = panel.view
    rises = [Segments((k, v.y0), (k, v.y1), ROLES["fine"], dashed=True, weight=[0.5]) for k in state.fine.rises]
    return replace(panel, marks=(*rises, *panel.marks))


# Numbers and words


def _scores(state: State) -> dict[str, float]:
    """The scores on the cells of size h, whichever level the second run is on: only those are comparable."""
    last = {name: len(run.truth) - 1 for name, run in state.runs.items()}
    return {name: climb.score(run.now, last[name], run.pose) for name, run in state.runs.items()}


def _readouts(state: State) -> tuple[Readout, ...]:
    """The readouts in rows of three: a reference, then the two runs."""
    truth, cells = state.scene.truth, state.one.now.maps[0]
    scores, poses = _scores(state), {name: run.pose for name, run in state.runs.items()}
    stop = {name: f"{run.status.label if run.steps else 'not begun'}, {run.steps}" for name, run in state.runs.items()}

    def pair(name: str, label: str, values: dict[str, str], unit: str = "") -> list[Readout]:
        return [Readout(f"{name}_{k}", f"{NAMES[k]}: {label}", values[k], unit) for k in NAMES]

    return (
        Readout("score_truth", "Score at the truth", number(state.one.truth[0], 1), "", "truth"),
        *pair("score", "score", {k: number(v, 1) for k, v in scores.items()}),
        Readout("rotation_start", "Start: rotation error", number(_turn(state.placed, truth), 1), "°", "ghost"),
        *pair("rotation", "rotation error", {k: number(_turn(v, truth), 1) for k, v in poses.items()}, "°"),
        Readout("translation_start", "Start: translation error", number(_distance(state.placed, truth)), "u", "ghost"),
        *pair("translation", "translation error", {k: number(_distance(v, truth)) for k, v in poses.items()}, "u"),
        Readout("gaussians", "Gaussians at cell size h", str(int(cells.kept.sum())), "", "target"),
        *pair("stop", "status, steps", stop),
    )


def _turn(pose: Pose, truth: Pose) -> float:
    return float(np.degrees(rre(pose, truth)))


def _distance(pose: Pose, truth: Pose) -> float:
    return float(rte(pose, truth))


def _note(state: State) -> str:
    parts = []
    for name, run in state.runs.items():
        if not run.steps:
            return ""
        if run.batch.done:
            parts.append(f"{NAMES[name]}: {run.status.label} after {amount(run.steps, 'step')}.")
            continue
        lam = float(run.now.damping[0])
        damping = f"λ = {lam:,.0f}" if lam > 0 else "no λ needed"
        cap = f", {run.caps[-1]} capped" if run.caps[-1] else ""
        times = run.halved[-1]
        halving = f", halved {times} ×" if times else ""
        parts.append(f"{NAMES[name]}: {damping}{cap}{halving}.")
    return " ".join(parts)


def _description(state: State) -> str:
    c, truth = state.controls, state.scene.truth
    at = f"{number(_turn(state.placed, truth), 1)}° and {number(_distance(state.placed, truth))} u"
    scores = _scores(state)
    words = [
        f"A scan of {len(state.scene.source)} points lies on the Gaussians of a room’s cells, with noise of"
        f" σ = {number(c.noise)} u, and starts {at} from the true pose; {'four grids' if c.four else 'one grid'}."
    ]
    for name, run in state.runs.items():
        sizes = " → ".join(number(h, 1) for h in _cells(c, name))
        error = f"{number(_turn(run.pose, truth), 1)}° and {number(_distance(run.pose, truth))} u from the truth"
        progress = f"{run.status.label} after {amount(run.steps, 'step')}, {error}," if run.steps else "at its start"
        words.append(
            f"{NAMES[name]} ({sizes} u) is {progress} with a score of {number(scores[name], 1)} on"
            f" cells of {number(c.cell, 1)} u; the true pose scores {number(run.truth[-1], 1)} there."
        )
        caps = [cap for cap in run.caps if cap]
        if caps or any(run.halved):
            words.append(
                f"Of its steps, {caps.count('shift')} met the cap on shifts, {caps.count('turn')} the cap on turns, and"
                f" {sum(map(bool, run.halved))} had to be halved."
            )
        if run.status.label not in ("running", "capped"):
            words.append(f"Its reason: {run.now.reason[0]}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, s = state.controls, state.scene
    options = named({"grids": 4 if c.four else 1, "max_shift": c.max_shift, "max_turn": c.max_turn})
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        "from solvers.wall_scenes import ndt_room",
        "",
        f"scene = ndt_room(seed={s.seed}, noise={c.noise!r})",
        f"start = {written(state.placed)}",
        "",
    ]
    for name, run in state.runs.items():
        steps = MAX_STEPS if run.batch.done else run.steps
        lines += [
            *called(
                f"{name} = register", "scene.source", "scene.target", '"ndt"', "start=start",
                f"cells={_cells(c, name)!r}", *options, f"max_steps={steps}",
            ),
            f'print("rotation_{name}", np.degrees(rre({name}.pose, scene.truth)))',
            f'print("translation_{name}", rte({name}.pose, scene.truth))',
            *([f'print("score_{name}", -{name}.objective)'] if run.levels[-1] == len(run.truth) - 1 else []),
        ]  # fmt: skip
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="ndt-climb",
    title="Climbing the NDT score, at one cell size and from coarse to fine",
    controls=Controls,
    presets={
        "default": {},
        "exceeds": {"noise": 0.2, "cell": 0.6, "turn": 10.0, "shift": 0.5},
    },
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("step", "Step"),
        Button("run", "Run", "run", primary=True, repeats="step"),
        *UNDONE,
    ),
    legend=(
        Key("source", "scan, which moves"),
        Key("target", "Gaussians of the target’s cells, 2 σ", "area"),
        Key("ghost", "start"),
        Key("truth", "where three of its points belong", "ring"),
        Key("ink", "one cell size", "dashed"),
        Key("accent", "coarse → fine", "line"),
        Key("accent", "step capped", "diamond"),
        Key("accent", "step halved", "cross"),
        Key("accent", "next level", "ring"),
    ),
    handles=HANDLES,
    tape=(({}, ("step",) * 17),),
    python=python,
    lead=Lead(
        panels=("one", "fine"),
        readouts=("rotation_one", "rotation_fine", "translation_fine"),
        controls=("cell",),
        buttons=("run", "step", "reset"),
    ),
)
