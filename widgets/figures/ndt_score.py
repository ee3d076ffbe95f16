"""Chapter 4b: the score of a pose, as a map over translations at one rotation, and the climb from a start on it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose, Status
from solvers.core.amounts import amount
from solvers.methods.ndt.floor import floored
from solvers.methods.ndt.ndt_map import NdtMap, build
from solvers.methods.ndt.score import evaluate, score_map
from solvers.methods.ndt.translation import Climb, climb
from solvers.metrics import rre
from solvers.scenes.rooms import Scene
from solvers.scenes.walls import ndt_room
from widgets.drawing.picture import (
    Array,
    Ellipses,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Ring,
    Segments,
    View,
    number,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice, slider
from widgets.parts.field import PAD, Field, axis_marks, scale_marks, within

REACH = 1.5
WINDOW = (-REACH, REACH, -REACH, REACH)
MAP = View(*WINDOW, width=460.0, pad=PAD)
ROOM = View(-6.2, 6.2, -4.4, 4.4, width=480.0)
START = (-0.7, -0.6)
BEGINS = {"climb": START, "truth": (0.0, 0.0)}
BANDS = 4
TOPS = (0.1, 0.2, 0.4, 0.6)
"""The colour scale ends at the first of these that the coarse map does not exceed."""


@dataclass(frozen=True)
class Controls:
    """The scan's rotation, which every climb keeps; what was measured; and how the map is built from it."""

    rotation: float = slider(0.0, "Rotation", -45.0, 45.0, 1.0, "°", "Of the scan, from the truth; climbs keep it")
    noise: float = slider(0.03, "Noise σ", 0.0, 0.2, 0.01, "u", "Of both scans")
    strays: float = slider(0.0, "Outliers", 0.0, 60.0, 5.0, "%", "Of each scan, at random")
    size: float = slider(1.0, "Cell size h", 0.4, 2.0, 0.1, "u")
    grids: str = choice("one", "Map", {"one": "One grid", "four": "Four grids"}, keeps="log")


@dataclass(frozen=True, eq=False)
class State:
    """scan: the source points, turned. field: their score by translation. truth: the score at the truth.
    path: the climb from the last start, or only that start before the climb. ground: the marks of the room that no
    climb changes. Scores are means over all points and grids.
    """

    controls: Controls
    seed: int
    scene: Scene
    cells: NdtMap
    scan: Array
    field: Field
    truth: float
    path: Climb
    ground: tuple[Mark, ...]

    @property
    def climbed(self) -> bool:
        """Whether a climb was made, or tried."""
        return len(self.path.tried) > 1 or self.path.status is not Status.CAPPED


def start(controls: Controls, seed: int) -> State:
    """The map of the target, the field of the turned scan, and the start of a first climb."""
    scene = ndt_room(seed=seed, noise=controls.noise, outliers=controls.strays / 100.0)
    cells = build(scene.target[None], controls.size, grids=_grids(controls))
    scan = Pose.from_angle(np.radians(controls.rotation)).apply(scene.source)
    pairs = len(scan) * _grids(controls)
    field = Field(lambda x, y: score_map(cells, scan, x, y) / pairs, WINDOW, bands=BANDS)
    truth = float(evaluate(cells, scene.source[None], np.zeros((1, 2)), derivatives=False).score[0]) / pairs
    mask = cells.kept[0]
    ground: tuple[Mark, ...] = (
        Ellipses(cells.mean[0][mask], floored(cells.covariance[0][mask]), "target", sigmas=2.0, filled=True),
        Points(scene.target, "target", "square", radius=2.0, weight=np.full(len(scene.target), 0.4)),
    )
    path = climb(cells, scan, np.array(START), max_steps=0)
    return State(controls, seed, scene, cells, scan, field, truth, path, ground)


def act(state: State, action: Action) -> State:
    """Climb from the start, from the clicked place, or from the truth."""
    begin = np.array([action.x, action.y]) if action.kind == "click" else np.array(BEGINS[action.name])
    return replace(state, path=climb(state.cells, state.scan, np.clip(begin, -REACH, REACH)))


def _grids(controls: Controls) -> int:
    return 4 if controls.grids == "four" else 1


@dataclass(frozen=True)
class _Numbers:
    begin: float
    end: float
    truth: float
    away: float
    turn: float
    best: Array
    steps: int
    rejected: int


def _numbers(state: State, detail: int) -> _Numbers:
    path, pairs = state.path, len(state.scan) * _grids(state.controls)
    best, _ = state.field.highest(detail)
    return _Numbers(
        float(path.score[0]) / pairs,
        float(path.score[path.accepted][-1]) / pairs,
        state.truth,
        float(np.hypot(*path.places[-1])),
        float(np.degrees(rre(Pose.from_angle(np.radians(state.controls.rotation)), state.scene.truth))),
        best,
        len(path.places) - 1,
        int((~path.accepted).sum()),
    )


def draw(state: State, detail: int = BANDS) -> Picture:
    """The field with the climb on it, and the scan over the map at the climb's end."""
    stats = _numbers(state, detail)
    return Picture(
        (_map(state, stats, detail), _room(state)),
        _readouts(stats),
        _description(state, stats),
        note=_note(state, stats),
        disabled=frozenset({"climb"} if state.climbed else ()),
    )


def _map(state: State, stats: _Numbers, detail: int) -> Panel:
    coarse = float(state.field.values(0).max())
    top = next((t for t in TOPS if coarse <= t), TOPS[-1])
    name = "The score over translations, with the climb from the start"
    marks: tuple[Mark, ...] = (
        state.field.roots(detail, top),
        *axis_marks(MAP, "shift in x, u", "shift in y, u"),
        *scale_marks(MAP, (0.0, top), "score", 2 if top < 0.4 else 1, roots=True),
        Ring([0.0, 0.0], "truth", radius=10.0),
        Points([stats.best], "ink", "diamond", radius=4.0),
        *_steps(state.path),
    )
    return Panel("map", name, MAP, marks, grid=False, caption=f"Score at {number(state.controls.rotation, 0)}°")


def _steps(path: Climb) -> tuple[Mark, ...]:
    """Accepted steps as a line through dots; each rejected try as a dashed line to a cross. Lines are cut at the map's
    border, beyond which is the scale."""
    last = np.maximum.accumulate(np.where(path.accepted, np.arange(len(path.tried)), 0))
    origin = path.tried[np.concatenate([[0], last[:-1]])]
    rejected = ~path.accepted
    marks: list[Mark] = []
    if rejected.any():
        pieces = [within(line, WINDOW) for line in np.stack([origin[rejected], path.tried[rejected]], axis=1)]
        ends = np.array([part for parts in pieces for part in parts]).reshape(-1, 2, 2)
        marks.append(Segments(ends[:, 0], ends[:, 1], "outlier", dashed=True))
        marks.append(Points(_on_map(path.tried[rejected]), "outlier", "cross", radius=3.5))
    marks += [Path(part, "source", thick=True) for part in within(path.places, WINDOW)]
    marks.append(Points(_on_map(path.places[1:]), "source", radius=2.5))
    return (
        *marks,
        Ring(path.places[0], "source", radius=7.0),
        Points(_on_map(path.places[-1:]), "source", radius=5.5),
    )


def _on_map(places: Array) -> Array:
    """The places, of (n, 2), that the map shows."""
    return np.asarray(places[np.abs(places).max(axis=1) <= REACH])


def _room(state: State) -> Panel:
    path = state.path
    marks: tuple[Mark, ...] = (
        *state.ground,
        Points(state.scan + path.places[0], "ghost", radius=2.0),
        Points(state.scan + path.places[-1], "source", radius=2.0),
    )
    moment = "where the climb ended" if state.climbed else "where the climb will begin"
    name = f"The scan {moment}, over the map’s Gaussians at two standard deviations"
    return Panel("room", name, ROOM, marks, caption=f"The scan over the map, {moment}")


def _readouts(stats: _Numbers) -> tuple[Readout, ...]:
    return (
        Readout("begin", "Score at the start", number(stats.begin, 3), "", "ghost"),
        Readout("score", "Score reached", number(stats.end, 3), "", "source"),
        Readout("truth", "Score at the truth", number(stats.truth, 3), "", "truth"),
        Readout("away", "Translation error reached", number(stats.away, 3), "u"),
        Readout("turn", "Rotation error, fixed", number(stats.turn, 0), "°"),
        Readout("best", "Highest tile, from the truth", number(float(np.hypot(*stats.best))), "u"),
        Readout("steps", "Steps taken · rejected", f"{stats.steps} · {stats.rejected}"),
    )


ENDS = {
    Status.CONVERGED: "came to rest",
    Status.STALLED: "stopped where no shorter step raises the score",
    Status.CAPPED: "stopped at the step limit",
    Status.DEGENERATE: "could not start: no point lies in a cell",
}


def _note(state: State, stats: _Numbers) -> str:
    if state.path.status is Status.DEGENERATE:
        return "No point of the scan lies in a cell of the map here: nothing to climb."
    if not state.climbed:
        return ""
    off = "" if len(_on_map(state.path.places[-1:])) else "off the map, "
    place = f"{off}{number(stats.away, 2)} u from the truth"
    tries = f"{amount(stats.rejected, 'try', 'tries')} rejected"
    return f"{amount(stats.steps, 'step')}, {tries}; it {ENDS[state.path.status]}, {place}."


def _description(state: State, stats: _Numbers) -> str:
    c, path = state.controls, state.path
    (x, y), (u, v) = path.places[0].tolist(), path.places[-1].tolist()
    p, q = stats.best.tolist()
    grids = "one grid" if c.grids == "one" else "four grids"
    course = (
        f"took {amount(stats.steps, 'step')}, rejected"
        f" {amount(stats.rejected, 'try', 'tries')} and {ENDS[path.status]}, at"
        f" ({number(u)}, {number(v)}) u with a score of {number(stats.end, 3)}"
        if state.climbed
        else "has not begun"
    )
    return (
        f"{len(state.scan)} scan points, turned by {number(c.rotation, 0)}° against the truth, are scored on a map of"
        f" {int(state.cells.kept.sum())} Gaussians from {grids} of cells of {number(c.size, 1)} u, with noise of σ ="
        f" {number(c.noise)} u and {number(c.strays, 0)} % outliers, for translations up to {number(REACH, 1)}"
        f" u along each axis. The highest point is at ({number(p)}, {number(q)}) u; the truth, a large ring, is at the"
        f" centre and scores {number(stats.truth, 3)} a point. A climb by translations alone from"
        f" ({number(x)}, {number(y)}) u, where the score is {number(stats.begin, 3)}, {course}."
    )


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c = state.controls
    x, y = (repr(float(v)) for v in state.path.tried[0])
    return f"""import numpy as np
from solvers import Pose
from solvers.ndt_map import build
from solvers.ndt_score import evaluate
from solvers.ndt_translation import climb
from solvers.wall_scenes import ndt_room

scene = ndt_room(seed={state.seed}, noise={c.noise!r}, outliers={c.strays / 100.0!r})
cells = build(scene.target[None], {c.size!r}, grids={_grids(c)})
scan = Pose.from_angle(np.radians({c.rotation!r})).apply(scene.source)
path = climb(cells, scan, np.array([{x}, {y}]){"" if state.climbed else ", max_steps=0"})
pairs = len(scan) * {_grids(c)}  # of a point and a grid
truth = evaluate(cells, scene.source[None], np.zeros((1, 2)))

print("begin", path.score[0] / pairs)
print("score", path.score[path.accepted][-1] / pairs)
print("truth", truth.score[0] / pairs)
print("away", np.linalg.norm(path.places[-1]))
"""


WIDGET = Widget(
    name="ndt-score",
    title="The score of a pose over translations",
    controls=Controls,
    presets={
        "default": {},
        "four": {"grids": "four"},
        "turned": {"rotation": 15.0},
        "outliers": {"strays": 40.0, "noise": 0.1},
    },
    start=start,
    act=act,
    draw=draw,
    details=BANDS + 1,
    known=lambda state: state.field.known,
    buttons=(
        Button("climb", "Climb", primary=True),
        Button("truth", "Climb from the truth"),
        *UNDONE,
    ),
    legend=(
        Key("truth", "truth, the large ring", "ring"),
        Key("source", "start", "ring"),
        Key("source", "climb, and the scan where it ended", "dot"),
        Key("outlier", "rejected try", "cross"),
        Key("ink", "highest tile", "diamond"),
        Key("ghost", "scan at the start"),
        Key("target", "map: points and Gaussians", "square"),
    ),
    clicks=("map",),
    tape=(({}, ("climb", "truth")), ({"grids": "four"}, ("climb",))),
    python=python,
    lead=Lead(readouts=("score", "truth", "away"), controls=("rotation",), buttons=("climb", "reset")),
)
