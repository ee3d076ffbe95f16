"""Four poses round a loop, joined by the measurements between them: springs to pull apart and let settle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from solvers.posegraph import KERNELS, Edges, GraphRun, advance, begin, residuals
from widgets.drawing.picture import (
    Array,
    Handle,
    Label,
    Mark,
    Panel,
    Path,
    Picture,
    Readout,
    Role,
    Segments,
    View,
    move_keys,
    number,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice, slider, toggle
from widgets.parts.robot import disc

VIEW = View(-6.4, 6.4, -4.6, 4.6)
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
TRUTH = Pose.from_angle(np.radians([0.0, 90.0, 180.0, 270.0]), CORNERS * [2.6, 1.7])
ROOM = CORNERS * [4.7, 3.2]
SEEN = CORNERS[:, None] * np.array([[-0.6, 3.2], [4.7, 3.2], [4.7, -0.6]])  # a corner, and its walls past the middle
# Limits of |x| and |y| of the handles, each in its quarter. LEAST: one for the loop's, then for poses 2, 3 and 4.
LEAST, MOST = np.array([0.4, 1.05, 1.05, 1.05]), np.array([6.0, 4.2])
SIGMA = np.array([0.2, 0.2, np.radians(4.0)])  # of every edge: u, u, radians
INFORMATION = np.diag(SIGMA**-2.0)
JOINS = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 2))
LOOP, FALSE = 3, 4
OFF = np.array([-3.4, -2.0])  # u, the error of the wrong loop
BESIDE, BELOW = 42.0, 50.0  # px from a handle to text beside or below it: on a phone it covers 25 px around its centre
CLEAR = 35.0  # px from a handle's centre to that of a number
GLYPH = disc(0.34, 0.6 * 0.34, 0.6, 24)
POSES = ("second", "third", "fourth")
KERNEL_NAMES = {"none": "None", "huber": "Huber", "cauchy": "Cauchy", "dcs": "Scaling (DCS)"}


@dataclass(frozen=True)
class Controls:
    """How far the odometry has drifted, whether an edge is false, and how large errors are treated."""

    kernel: str = choice("none", "Kernel on the loops", {name: KERNEL_NAMES[name] for name in KERNELS})
    false: bool = toggle(False, "A wrong loop", "An edge from pose 1 to pose 3 that is wrong by 3.9\u00a0u")
    drift: float = slider(1.0, "Drift", 0.0, 2.0, 0.1, "σ", "Scales the same draw; 1 is as stated")


@dataclass(frozen=True, eq=False)
class State:
    """run: the optimisation so far. first: the same at its start, after the last drag."""

    controls: Controls
    first: GraphRun
    run: GraphRun

    @property
    def edges(self) -> Edges:
        """The measurements."""
        return self.run.edges


def start(controls: Controls, seed: int) -> State:
    """The drive by odometry alone: its edges fit exactly, the loop does not."""
    count = len(JOINS) if controls.false else FALSE
    i, j = np.array(JOINS[:count]).T
    exact = Edges.between(TRUTH, i, j, INFORMATION)
    errors = (controls.drift * SIGMA * np.random.default_rng(seed).normal(size=(len(JOINS), 3)))[:count]
    errors[FALSE:] = 0.0
    relative = exact.relative.compose(Pose.from_angle(errors[:, 2], errors[:, :2]))
    shift = np.where(np.arange(count)[:, None] == FALSE, OFF, 0.0)
    edges = Edges(i, j, Pose(relative.R, relative.t + shift), INFORMATION)
    poses = [TRUTH[0]]
    for k in range(LOOP):
        poses.append(poses[-1].compose(edges.relative[k]))
    return _new_state(controls, Pose(np.stack([p.R for p in poses]), np.stack([p.t for p in poses])), edges)


def _new_state(controls: Controls, poses: Pose, edges: Edges) -> State:
    run = begin(poses, edges, kernel=controls.kernel, robust=np.arange(len(edges)) >= LOOP)
    return State(controls, run, run)


def act(state: State, action: Action) -> State:
    """Step, solve, or move a pose or the loop's measurement."""
    if action.kind == "press":
        run = advance(state.run)
        while action.name == "solve" and not run.done:
            run = advance(run)
        return replace(state, run=run)
    poses, edges = state.run.poses, state.edges
    node = 0 if action.name == "loop" else POSES.index(action.name) + 1
    to = _within(np.array([action.x, action.y]), node)
    if node:
        t = poses.t.copy()
        t[node] = to
        return _new_state(state.controls, Pose(poses.R, t), edges)
    shifts = edges.relative.t.copy()
    shifts[LOOP] = poses[LOOP].inverse().apply(to[None])[0]
    relative = Pose(edges.relative.R, shifts)
    return _new_state(state.controls, poses, Edges(edges.i, edges.j, relative, edges.information))


def _within(xy: Array, node: int) -> Array:
    """The place nearest to xy in the quarter of the picture to which a pose's handle is limited."""
    return np.asarray(CORNERS[node] * np.clip(CORNERS[node] * xy, LEAST[node], MOST))


def _predicted(state: State, edge: int) -> Pose:
    """The pose of an edge's far end according to the edge and its near end."""
    return state.run.poses[JOINS[edge][0]].compose(state.edges.relative[edge])


@dataclass(frozen=True)
class _Numbers:
    gap: float
    apart: float
    before: float


def _numbers(state: State) -> _Numbers:
    off = residuals(state.run.poses, state.edges)[LOOP, :2]
    squares = np.square(state.run.poses.t - TRUTH.t).sum(axis=1).mean()
    return _Numbers(float(np.hypot(*off)), float(np.sqrt(squares)), state.first.objective)


def draw(state: State) -> Picture:
    """The map, the readouts and the words."""
    stats = _numbers(state)
    poses, edges = state.run.poses, state.edges
    marks: list[Mark] = [Path(ROOM, "truth", closed=True, thick=True)]
    marks += [Path(poses[k].apply(TRUTH[k].inverse().apply(SEEN[k])), "source") for k in range(4)]
    for edge in range(LOOP, len(edges)):
        put = _predicted(state, edge)
        marks += [Segments(put.t, poses.t[JOINS[edge][1]], "ghost", dashed=True), _glyph(put, "ghost", filled=False)]
    marks += [mark for edge in range(len(edges)) for mark in _spring(state, edge)]
    marks += [_glyph(poses[k], "source") for k in range(4)]
    handles = _handles(state)
    knobs = VIEW.px([handle.xy for handle in handles])
    marks += [_number(poses.t[k], k, knobs) for k in range(4)]
    marks.append(_loop_name(_within(_predicted(state, LOOP).t, 0), poses.t[0]))
    marks += [_chi2(state, edge) for edge in range(len(edges))]
    return Picture(
        (Panel("main", "Four poses, the edges between them and the walls seen", VIEW, tuple(marks)),),
        _readouts(state, stats),
        _description(state, stats),
        handles,
        _note(state, stats),
        frozenset({"solve", "step"} if state.run.done else ()),
    )


def _glyph(pose: Pose, role: Role, filled: bool = True) -> Path:
    return Path(pose.apply(GLYPH), role, closed=True, filled=filled, dotted=not filled)


def _role(edge: int) -> Role:
    return "pair" if edge < LOOP else "accent" if edge == LOOP else "outlier"


def _spring(state: State, edge: int) -> tuple[Mark, ...]:
    """Coils between the two poses; a straight dashed line if the kernel leaves the edge less than half its weight."""
    a, b = state.run.poses.t[list(JOINS[edge])]
    along = b - a
    length = max(float(np.hypot(*along)), 1e-9)
    if state.run.weights[edge] < 0.5:
        return (Segments(a, b, _role(edge), dashed=True),)
    along = along / length
    ends = min(0.42, 0.3 * length)
    at = np.r_[0.0, np.linspace(ends, length - ends, 23), length]
    aside = 0.12 * np.r_[0.0, 0.0, np.resize([1.0, -1.0], 21), 0.0, 0.0]
    return (Path(a + at[:, None] * along + aside[:, None] * [-along[1], along[0]], _role(edge)),)


def _number(at: Array, node: int, knobs: Array) -> Label:
    """A pose's number beside it, outwards if possible, else at the next place in the panel that no handle covers."""
    at = np.clip(at, [-6.0, -4.3], [6.0, 4.3])
    across, up = CORNERS[node]
    offsets = BESIDE * np.array([(across, 0.0), (across, -up), (0.0, -up), (-across, 0.0), (across, up), (0.0, up)])
    spots = VIEW.px(at) + offsets
    clear = np.linalg.norm(spots[:, None] - knobs, axis=2).min(axis=1) > CLEAR
    free = clear & (spots > 10.0).all(axis=1) & (spots < np.array(VIEW.size) - 10.0).all(axis=1)
    dx, dy = offsets[int(np.argmax(free))]
    return Label(at, str(node + 1), "ink", "middle", dx=dx, dy=dy + 6.0)


def _loop_name(at: Array, pose: Array) -> Label:
    """The loop's name below its handle; above it at the panel's bottom, left of it if the handle is above the pose."""
    if at[1] > pose[1] + 0.5 and at[0] > -4.6:
        return Label(at, "loop", "accent", "end", dx=-BESIDE + 10.0, dy=6.0)
    at = np.clip(at, [-5.7, -4.3], [5.7, 4.3])
    return Label(at, "loop", "accent", "middle", dy=BELOW if at[1] > -3.4 else -BESIDE)


def _chi2(state: State, edge: int) -> Label:
    """An edge's χ² beside its middle, within the panel: outside the loop for odometry, inside for loop edges."""
    a, b = state.run.poses.t[list(JOINS[edge])]
    middle = np.clip((a + b) / 2, [-5.0, -3.8], [4.4, 3.8])
    text = f"χ² {number(float(state.run.chi2[edge]), 1)}"
    dx, dy = ((0.0, 24.0), (14.0, 5.0), (0.0, -14.0), (14.0, 5.0), (18.0, 26.0))[edge]
    return Label(middle, text, "ink", ("middle", "start", "middle", "start", "start")[edge], dx, dy)


def _handles(state: State) -> tuple[Handle, ...]:
    poses = state.run.poses
    nodes = [(name, k, f"Move pose {k + 1}", poses.t[k]) for k, name in enumerate(POSES, 1)]
    nodes.append(("loop", 0, "Move where the loop’s edge puts pose 1", _predicted(state, LOOP).t))
    handles = []
    for name, node, label, at in nodes:
        x, y = _within(at, node).tolist()
        keys = {key: tuple(_within(np.array(to), node).tolist()) for key, to in move_keys(x, y).items()}
        handles.append(Handle(name, label, (x, y), f"x {number(x)}, y {number(y)} u", keys))
    return tuple(handles)


def _readouts(state: State, stats: _Numbers) -> tuple[Readout, ...]:
    run = state.run
    false = len(run.chi2) > FALSE
    return (
        Readout("objective", "What is minimised", number(run.objective, 1)),
        Readout("gap", "Gap of the loop", number(stats.gap), "u", "accent"),
        Readout("apart", "RMS distance from the true poses", number(stats.apart), "u", "source"),
        Readout("largest", "Largest χ² of an edge", number(float(run.chi2.max()), 1)),
        Readout("weight_loop", "Weight of the loop’s edge", number(float(run.weights[LOOP]), 2), "", "accent"),
        Readout(
            "weight_false", "Weight of the wrong loop", number(float(run.weights[FALSE]), 3) if false else "–", "",
            "outlier",
        ),
        Readout("steps", "Steps", str(run.steps)),
        Readout("stop", "Status", run.status.label if run.steps or run.done else "not begun"),
    )  # fmt: skip


def _note(state: State, stats: _Numbers) -> str:
    run = state.run
    if not run.steps:
        return "Already solved: no step lowers the sum." if run.done else ""
    words = f"After {amount(run.steps, 'step')} the sum is {number(run.objective, 1)}, from {number(stats.before, 1)}."
    if len(run.weights) > FALSE and run.weights[FALSE] < 0.5:
        words += f" The wrong loop has a weight of {number(float(run.weights[FALSE]), 3)}."
    return words


def _description(state: State, stats: _Numbers) -> str:
    run, c = state.run, state.controls
    chi2 = ", ".join(number(float(value), 1) for value in run.chi2[:FALSE])
    words = [
        "Four poses mark the corners of a drive round a room, and each saw one corner of it.",
        f"Springs join them: three odometry edges, with {number(c.drift, 1)} times the errors they state, and the"
        f" edge from pose 4 to pose 1 that closes the loop. Their χ² are {chi2}.",
    ]
    if c.false:
        words.append(
            f"A wrong loop from pose 1 to pose 3 is off by {number(float(np.hypot(*OFF)), 1)} u; its χ² is"
            f" {number(float(run.chi2[FALSE]), 1)}, its weight {number(float(run.weights[FALSE]), 3)}."
        )
    if c.kernel != "none":
        words.append(f"Loop edges have the kernel {KERNEL_NAMES[c.kernel]}.")
    after = f"is {run.status.label} after {amount(run.steps, 'step')}"
    progress = after if run.steps or run.done else "has not begun"
    words.append(
        f"The optimisation {progress}. The loop’s gap is {number(stats.gap)} u, and the poses are"
        f" {number(stats.apart)} u RMS from the true ones."
    )
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    first, edges, run = state.first, state.edges, state.run
    i, j = (list(map(int, ends)) for ends in (edges.i, edges.j))
    lines = [
        "import numpy as np",
        "from solvers import Pose",
        "from solvers.posegraph import Edges, advance, begin, residuals",
        "",
        *_pose_lines("start", first.poses),
        *_pose_lines("measured", edges.relative),
        "information = np.diag([25.0, 25.0, 1 / np.radians(4) ** 2])",
        f"edges = Edges({i}, {j}, measured, information)",
        f"loops = np.arange({len(edges)}) >= {LOOP}",
        f'run = begin(start, edges, kernel="{state.controls.kernel}", robust=loops)',
        f"while run.steps < {run.steps} and not run.done:",
        "    run = advance(run)",
        "",
        'print("objective", run.objective)',
        f'print("gap", np.linalg.norm(residuals(run.poses, edges)[{LOOP}, :2]))',
        'print("largest", run.chi2.max())',
        f'print("weight_loop", run.weights[{LOOP}])',
        f"true = {(CORNERS * [2.6, 1.7]).tolist()}",
        'print("apart", np.sqrt(np.square(run.poses.t - true).sum(axis=1).mean()))',
    ]
    return "\n".join(lines) + "\n"


def _pose_lines(name: str, poses: Pose) -> list[str]:
    rows = [[round(float(v), 9) + 0.0 for v in (*t, angle)] for t, angle in zip(poses.t, poses.angle, strict=True)]
    return [
        "x, y, angle = np.array([",
        *(f"    {row}," for row in rows),
        "]).T",
        f"{name} = Pose.from_angle(angle, np.column_stack([x, y]))",
    ]


WIDGET = Widget(
    name="pose-loop",
    title="Four poses and the edges between them",
    controls=Controls,
    presets={"default": {}, "false": {"false": True}, "robust": {"false": True, "kernel": "dcs"}},
    start=start,
    act=act,
    draw=draw,
    buttons=(Button("solve", "Solve", primary=True), Button("step", "Step"), *UNDONE),
    legend=(
        Key("source", "poses, and the walls they saw"),
        Key("pair", "odometry", "line"),
        Key("accent", "the loop’s edge", "line"),
        Key("outlier", "wrong loop", "line"),
        Key("ghost", "where a loop’s edge puts a pose", "dotted"),
        Key("truth", "the room", "line"),
    ),
    handles=(*POSES, "loop"),
    tape=(
        ({}, ("solve",)),
        ({}, ("step",) * 4),
        ({"false": True}, ("solve",)),
        ({"false": True, "kernel": "huber"}, ("solve",)),
        ({"false": True, "kernel": "cauchy"}, ("solve",)),
        ({"false": True, "kernel": "dcs"}, ("solve",)),
    ),
    python=python,
    lead=Lead(readouts=("objective", "gap", "apart"), controls=("kernel", "false"), buttons=("solve", "step", "reset")),
)
