"""Rung 10: branch and bound. Boxes of poses are split and ruled out, until no remaining pose can be better by more than
a gap."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers import METHODS, Pose, Status
from solvers.core.amounts import amount
from solvers.core.stepper import Batch, advance, begin
from solvers.geometry import nearest
from solvers.methods.search.branch_and_bound import BranchAndBoundState, Ground
from solvers.metrics import rre, rte
from solvers.scenes.rooms import Scene, room
from solvers.scenes.walls import hall
from widgets.drawing.chart import WIDTH, Axis, Series, chart
from widgets.drawing.picture import Group, Label, Panel, Path, Picture, Points, Readout, View, degrees, number
from widgets.engine.contract import ITERATED, Action, Key, Lead, Motion, Pieces, Widget, whole
from widgets.engine.controls import choice, slider
from widgets.engine.script import called
from widgets.figures.branch_and_bound import marks
from widgets.figures.branch_and_bound.marks import Floors
from widgets.parts.placing import written
from widgets.parts.room import PLACING, problem, single, still

VIEW = View(-marks.SIZE, marks.SIZE, -marks.SIZE, marks.SIZE, width=480.0)
BOXES = 512  # boxes opened per step: few enough to see what a step does
TURNED = 100.0  # degrees, the start's heading
AXIS = 60  # steps; the chart's axis grows by as many
ROOMS = {"clean": "Clean", "noise": "Noise", "outliers": "Outliers", "combo": "Combo", "hall": "Hall"}


@dataclass(frozen=True)
class Controls:
    """What to search, and how closely."""

    scene: str = choice("noise", "Scene", ROOMS)
    search: str = choice("all", "Search", {"turns": "Turns only", "all": "All poses"}, "Turns only: the place is known")
    cap: float = slider(0.4, "Cap τ", 0.2, 1.6, 0.1, "u", "The most a point can count", "nothing")
    gap: float = slider(0.001, "Allowed gap", 0.0005, 0.01, 0.0005, "u²", "When a box is ruled out", "nothing")


@dataclass(frozen=True, eq=False)
class State:
    """The run so far. course: the ceiling and the floor after 0, 1, … steps, in u²."""

    controls: Controls
    scene: Scene
    begun: Pose
    batch: Batch[BranchAndBoundState]
    course: tuple[tuple[float, float], ...]

    @cached_property
    def now(self) -> BranchAndBoundState:
        """The solver's state."""
        return self.batch.state()

    @property
    def pose(self) -> Pose:
        """The best pose found so far."""
        return single(self.now.pose)

    @property
    def before(self) -> float:
        """The ceiling before the last step, u²."""
        return self.course[-2:][0][0]

    @property
    def held(self) -> bool:
        """Whether the source's place is known."""
        return self.controls.search == "turns"

    @property
    def ground(self) -> Ground:
        """The ground on which the run searches."""
        ground: Ground = self.now.ground[0]
        return ground

    @cached_property
    def floors(self) -> Floors:
        """The floors of what is left, and what the last step ruled out."""
        ground, now = self.ground, self.now
        root, boxes, discarded = (ground.in_world(b) for b in (ground.root, now.boxes[0], now.discarded[0]))
        return marks.floors(root, boxes, discarded, self.held)

    @cached_property
    def truth(self) -> float:
        """The objective at the truth, u²."""
        moved = self.scene.truth.apply(self.scene.source)[None]
        _, squares = nearest.build(self.scene.target[None]).nearest(moved)
        return float(np.minimum(squares, self.controls.cap**2).mean())


def start(controls: Controls, seed: int) -> State:
    """The scene with the source turned about its centroid, and one box that contains every pose."""
    scene = hall(seed=seed) if controls.scene == "hall" else room(controls.scene, seed=seed)
    mean = scene.source.mean(axis=0)
    rotation = Pose.from_angle(np.radians(TURNED))
    initial = Pose(rotation.R, mean - rotation.R @ mean)
    method = METHODS["branch-and-bound"]
    options = method.options(
        cap=controls.cap, gap=controls.gap, boxes=BOXES, shift=0.0 if controls.search == "turns" else None
    )
    batch = begin(method, problem(scene, initial), options)
    return State(controls, scene, initial, batch, (_values(batch),))


def _values(batch: Batch[BranchAndBoundState]) -> tuple[float, float]:
    state = batch.state()
    return float(state.objective[0]), float(state.lower[0])


def act(state: State, action: Action) -> State:
    """One step, or all to the end."""
    return whole(pieces(state, action))  # type: ignore[no-any-return]


def pieces(state: State, action: Action) -> Pieces:
    """The same, one step of the search at a time."""
    batch, course = state.batch, [*state.course]
    while not batch.done:
        batch = advance(batch)
        course.append(_values(batch))
        if action.name == "step":
            break
        yield
    return replace(state, batch=batch, course=tuple(course))


def motion(before: State, after: State) -> Motion | None:
    """The move to a better pose, if one was found."""
    if len(after.course) != len(before.course) + 1 or before.course[-1][0] == after.course[-1][0]:
        return None
    return PLACING.motion(before.pose, after.pose, before.scene.source.mean(axis=0))


def draw(state: State) -> Picture:
    """The scene at the best pose, amid the headings and places that are left, and a chart of the floor's rise to the
    ceiling."""
    return Picture(
        (_main(state), _chart(state)),
        _readouts(state),
        _description(state),
        note=_note(state),
        disabled=frozenset({"step", "finish"} if state.batch.done else ()),
    )


def _main(state: State) -> Panel:
    scene, pose, ground, ceiling = state.scene, state.pose, state.ground, state.course[-1][0]
    root = ground.in_world(ground.root)
    middle = pose.apply(scene.source.mean(axis=0)[None])[0]
    layers = (
        *(() if state.held else marks.field(state.floors, root, ceiling)),
        *still(scene),
        *marks.ring(state.floors, ceiling, state.before),
        Group(
            "source",
            (
                *(Path(pose.apply(line), "source", weight=0.6) for line in scene.outline),
                Points(pose.apply(scene.source), "source", radius=2.5),
            ),
        ),
        *marks.pointers(float(pose.angle), middle),
    )
    label = "The scene at the best pose found, with remaining headings as a ring and remaining places as a field"
    return Panel("main", label, VIEW, layers, grid=False)


def _chart(state: State) -> Panel:
    """The floor over the steps, as a share of the current ceiling."""
    ceiling, last = state.course[-1][0], len(state.course) - 1
    end = float(AXIS * max(1, -(-last // AXIS)))
    floor = np.array([low for _, low in state.course]) / ceiling
    goal = max(0.0, 1.0 - state.controls.gap / ceiling)
    # Below its line, since the ceiling is just above, unless the line is at or near the axis.
    ends = Label([end, goal], "search ends here", "guide", "end", dy=16.0 if goal > 0.2 else -7.0)
    drawn = chart(
        "gap",
        "Floor over the steps, as a share of the ceiling",
        [
            Series([0.0, end], [1.0, 1.0], "source", dashed=True),
            Series([0.0, end], [goal, goal], "guide"),
            Series(np.arange(last + 1), floor, "accent", dots=last < 30),
        ],
        Axis("step", 0.0, end),
        Axis("Floor, as a share of the ceiling", 0.0, 1.1, ((0.0, "0"), (0.5, "½"), (1.0, "1"))),
        now=float(last),
        size=(WIDTH, 240.0),
    )
    return replace(drawn, marks=(*drawn.marks, ends))


def _readouts(state: State) -> tuple[Readout, ...]:
    now, (ceiling, floor), truth = state.now, state.course[-1], state.scene.truth
    return (
        Readout("ceiling", "Ceiling: best value found", number(ceiling, 4), "u²", "source"),
        Readout("floor", "Floor: proved lower bound", number(floor, 4), "u²", "accent"),
        Readout("gap", "Gap between them", number(ceiling - floor, 4), "u²"),
        Readout("headings", "Headings ruled out", _ruled_out(state), "%"),
        Readout("left", "Boxes left", f"{int(now.left[0]):,}"),
        Readout("examined", "Boxes examined", f"{int(now.examined[0]):,}"),
        Readout("truth", "Objective at the truth", number(state.truth, 4), "u²", "truth"),
        Readout("rotation_error", "Rotation error", number(float(np.degrees(rre(state.pose, truth))), 1), "°"),
        Readout("translation_error", "Translation error", number(float(rte(state.pose, truth))), "u"),
        Readout("stop", "Status", _status(state)),
    )


def _ruled_out(state: State) -> str:
    """The percentage of headings ruled out; 100 only if all are."""
    share = state.floors.share_gone
    return number(100.0 if share == 1.0 else min(100.0 * share, 99.0), 0)


def _candidate(state: State) -> str:
    """What the floor holds for: with the position fixed, other places may have better poses."""
    return "heading" if state.held else "pose"


def _status(state: State) -> str:
    steps = len(state.course) - 1
    status = Status(int(state.now.status[0]))
    return f"{status.label}, step {steps}" if state.batch.done else f"searching, step {steps}"


def _note(state: State) -> str:
    steps, (ceiling, floor) = len(state.course) - 1, state.course[-1]
    if not steps:
        return ""
    if state.now.status[0] == Status.PROVED:
        better = f"no {_candidate(state)} is better by more than {number(ceiling - floor, 4)} u²"
        return f"Proved at step {steps}: {better}{', at the true position' if state.held else ''}."
    return f"Step {steps}: {_ruled_out(state)} % of the headings are ruled out; boxes left: {int(state.now.left[0]):,}."


_WORDS = {
    "clean": "A room with little noise, in two scans",
    "noise": "A noisy room, in two scans",
    "outliers": "A room, in two scans with a fifth of the points junk",
    "combo": "A noisy room, in two scans with a fifth of the points junk",
    "hall": "A rectangular hall, which looks the same after half a turn",
}


def _ends(count: int) -> str:
    if not count:
        return "No arc is open."
    return f"A tick marks where arcs that are open begin or end, at {amount(count, 'place')}."


def _description(state: State) -> str:
    c, now, (ceiling, floor) = state.controls, state.now, state.course[-1]
    steps = len(state.course) - 1
    error = number(float(np.degrees(rre(state.pose, state.scene.truth))), 1)
    words = [
        f"{_WORDS[c.scene]}: {len(state.scene.source)} source points and {len(state.scene.target)} target points, each"
        f" source point contributing its squared distance, capped at {number(c.cap, 1)} u.",
        "A ring around the scene shows the floor of each heading, with the ceiling at its rim; headings ruled out are"
        " grey up to the rim. The true heading is at the top.",
        _ends(len(state.floors.ends)),
    ]
    if state.before > ceiling:
        words.append(f"A dotted rim shows where the ceiling was before the last step, {number(state.before, 4)} u².")
    if state.held:
        words.append("The source’s position is fixed at the true one; only its rotation is searched.")
    elif now.left[0]:
        words.append("Within the ring, colour shows where the centre of the source may still be.")
    words.append(
        f"After {amount(steps, 'step')} the best pose is turned by {degrees(float(state.pose.angle))}°,"
        f" {error}° from the truth, with a mean of {number(ceiling, 4)} u²;"
        f" no {_candidate(state)} is below {number(floor, 4)} u²."
    )
    words.append(
        f"Boxes examined: {int(now.examined[0]):,}; left: {int(now.left[0]):,}."
        f" {_ruled_out(state)} % of the headings are ruled out."
    )
    if state.batch.done:
        words.append(f"The run has ended: {Status(int(now.status[0])).label}, {now.reason[0]}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, scene = state.controls, state.scene
    call = f"hall(seed={scene.seed})" if c.scene == "hall" else f'room("{c.scene}", seed={scene.seed})'
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        f"from solvers.{'wall_scenes' if c.scene == 'hall' else 'scenes'} import {call.partition('(')[0]}",
        "",
        f"scene = {call}",
        f"start = {written(state.begun)}",
        *called(
            "result = register", "scene.source", "scene.target", '"branch-and-bound"', "start=start", f"cap={c.cap!r}",
            f"gap={c.gap!r}", f"boxes={BOXES}", *(["shift=0.0"] if state.held else []),
            f"max_steps={len(state.course) - 1}",
        ),
        "",
        'print("ceiling", result.objective)',
        'print("floor", result.lower)',
        'print("gap", result.gap)',
        'print("left", result.detail("left"))',
        'print("examined", result.detail("examined"))',
        'print("rotation_error", np.degrees(rre(result.pose, scene.truth)))',
        'print("translation_error", rte(result.pose, scene.truth))',
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="branch-and-bound",
    title="Branch and bound: what is left of all poses",
    controls=Controls,
    presets={
        "default": {},
        "turns": {"search": "turns"},
        "combo": {"scene": "combo"},
        "hall": {"scene": "hall"},
    },
    start=start,
    act=act,
    pieces=pieces,
    draw=draw,
    buttons=ITERATED,
    legend=(
        Key("source", "source at the best pose found; ceiling", "dot"),
        Key("source", "centre of the source", "cross"),
        Key("accent", "floor of an open heading; place still open", "area"),
        Key("accent", "end of an open arc", "line"),
        Key("ghost", "heading ruled out", "area"),
        Key("weak", "heading or place (dotted) ruled out by the last step", "area"),
        Key("target", "target", "square"),
        Key("truth", "walls, and the true heading", "line"),
    ),
    tape=(({}, ("step",) * 8), ({}, ("finish",)), ({"search": "turns"}, ("step",) * 5)),
    motion=motion,
    python=python,
    lead=Lead(("main",), ("ceiling", "floor", "left"), ("search",), ("step", "run", "finish", "reset")),
)
