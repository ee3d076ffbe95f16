"""Chapter 4a: a scan becomes a grid of Gaussians; one cell at a time is shown close up, with its statistics."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers.core.amounts import amount
from solvers.geometry.spectral import symmetric_eigen
from solvers.methods.ndt.floor import FLOOR, floored
from solvers.methods.ndt.ndt_map import LEAST_POINTS, TOO_FEW, NdtMap, build
from solvers.methods.ndt.score import score_map
from solvers.scenes.walls import ndt_room
from widgets.drawing.picture import (
    Array,
    Ellipses,
    Heat,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Segments,
    View,
    number,
    small,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Widget
from widgets.engine.controls import slider, toggle
from widgets.parts.field import scale_marks

ROOM = View(-5.6, 5.6, -3.7, 3.7)
CLOSE = View(-0.25, 1.25, -0.25, 1.25, width=320.0, pad=(8.0, 26.0, 74.0, 8.0))
TILES = 48
PLACE = (4.5, 2.5)  # in the cell of the room's upper right corner, unless the grid is nudged
SPOT = (-2.5, 0.4)
STUCK = 5
SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])


@dataclass(frozen=True)
class Controls:
    """What was measured, and where the cells are."""

    noise: float = slider(0.03, "Noise σ", 0.0, 0.2, 0.01, "u")
    size: float = slider(1.0, "Cell size h", 0.3, 2.5, 0.05, "u")
    nudge_x: float = slider(0.0, "Nudge the grid in x", -0.75, 0.75, 0.05, "u")
    nudge_y: float = slider(0.0, "Nudge the grid in y", -0.75, 0.75, 0.05, "u")
    stuck: bool = toggle(True, "A stuck beam", f"{STUCK} returns from a single spot")


@dataclass(frozen=True, eq=False)
class State:
    """points: the target with the stuck beam's returns; cell: (n, 2) the cell of each, counted from the grid's origin.

    chosen: the cell shown close up, (2,) counted likewise; close: its panel. grid: the marks that no choice changes.
    """

    controls: Controls
    seed: int
    points: Array
    cells: NdtMap
    cell: Array
    chosen: tuple[int, int]
    close: Panel
    grid: tuple[Mark, ...]

    @property
    def row(self) -> int:
        """The index of the chosen cell in the map, −1 if it contains no points."""
        rows = np.flatnonzero((_numbered(self.cells) == self.chosen).all(axis=1))
        return int(rows[0]) if len(rows) else -1


def start(controls: Controls, seed: int) -> State:
    """The map of the target, with the corner's cell chosen."""
    scene = ndt_room(seed=seed, noise=controls.noise)
    points = np.vstack([scene.target, np.tile(SPOT, (STUCK if controls.stuck else 0, 1))])
    offset = np.array([controls.nudge_x, controls.nudge_y])
    cells = build(points[None], controls.size, offset=offset)
    cell = np.floor((points - offset) / controls.size)
    chosen = _at(controls, PLACE)
    grid = _grid(controls, points, cells)
    return State(controls, seed, points, cells, cell, chosen, _close_up(controls, points, cells, cell, chosen), grid)


def act(state: State, action: Action) -> State:
    """Choose the cell that is pointed at, or the next one that contains a point."""
    if action.kind == "press":
        cells = _numbered(state.cells)
        order = cells[np.lexsort((cells[:, 0], -cells[:, 1]))].tolist()  # rows from the top, each from the left
        current = list(state.chosen)
        x, y = order[(order.index(current) + 1) % len(order) if current in order else 0]
        chosen = int(x), int(y)
    else:
        chosen = _at(state.controls, (action.x, action.y))
    if chosen == state.chosen:
        return state
    close = _close_up(state.controls, state.points, state.cells, state.cell, chosen)
    return replace(state, chosen=chosen, close=close)


def _at(c: Controls, point: tuple[float, float]) -> tuple[int, int]:
    x, y = point
    return int(np.floor((x - c.nudge_x) / c.size)), int(np.floor((y - c.nudge_y) / c.size))


def _numbered(cells: NdtMap) -> Array:
    """The map's cells as counted from the grid's origin, (C, 2)."""
    return np.asarray(np.round((cells.corner[0] - cells.origin[0, 0]) / cells.size[0]))


def _grid(c: Controls, points: Array, cells: NdtMap) -> tuple[Mark, ...]:
    """Cell borders, discarded cells with their marks, the points by whether their cell is kept, and the Gaussians."""
    h, (x, y) = c.size, cells.origin[0, 0].tolist()
    across = x + h * np.arange(np.ceil((ROOM.x0 - x) / h), np.floor((ROOM.x1 - x) / h) + 1)
    up = y + h * np.arange(np.ceil((ROOM.y0 - y) / h), np.floor((ROOM.y1 - y) / h) + 1)
    lower = np.concatenate([[(a, ROOM.y0) for a in across], [(ROOM.x0, b) for b in up]])
    upper = np.concatenate([[(a, ROOM.y1) for a in across], [(ROOM.x1, b) for b in up]])
    marks: list[Mark] = [Segments(lower, upper, "guide", weight=np.full(len(lower), 0.3))]
    mask, too_few = cells.kept[0], cells.dropped[0] == TOO_FEW
    middle = cells.corner[0] + 0.5 * h
    marks += [Path(corner + h * SQUARE, "outlier", closed=True, dashed=True) for corner in cells.corner[0][~mask]]
    inside = cells.lookup(points[None], np.zeros(1, dtype=np.int64))[0, 0] >= 0
    covariance = floored(cells.covariance[0][mask])
    marks += [
        Points(middle[~mask & too_few], "outlier", "cross", radius=5.0),
        Points(middle[~mask & ~too_few], "outlier", "diamond", radius=5.0),
        Ellipses(cells.mean[0][mask], covariance, "target", sigmas=2.0, filled=True),
        Points(points[inside], "target", "square", radius=2.0),
        Points(points[~inside], "outlier", "square", radius=2.0),
    ]
    return tuple(marks)


def _close_up(c: Controls, points: Array, cells: NdtMap, cell: Array, chosen: tuple[int, int]) -> Panel:
    """One cell and a quarter of its neighbours, in units of its side: the score of a single point, and the points and
    the Gaussian that it comes from."""
    corner, h = cells.origin[0, 0] + c.size * np.array(chosen), c.size
    at = CLOSE.x0 + (np.arange(TILES) + 0.5) * (CLOSE.x1 - CLOSE.x0) / TILES
    values = score_map(cells, np.zeros((1, 2)), corner[0] + h * at, corner[1] + h * at)
    near = (points - corner) / h
    visible = (np.abs(near - 0.5) < 0.75).all(axis=1)
    own = (cell == chosen).all(axis=1)
    marks: list[Mark] = [
        Heat(values, (CLOSE.x0, CLOSE.x1, CLOSE.y0, CLOSE.y1), 0.0, 1.0),
        *scale_marks(CLOSE, (0.0, 1.0), "score"),
        Path(SQUARE, "accent", closed=True, thick=True),
        Points(near[visible & ~own], "ghost", "square", radius=2.0),
    ]
    rows = np.flatnonzero((_numbered(cells) == chosen).all(axis=1))
    is_kept = bool(len(rows) and cells.kept[0, rows[0]])
    marks.append(Points(near[own], "target" if is_kept else "outlier", "square", radius=3.0))
    if is_kept:
        mean, spread = (cells.mean[0, rows[0]] - corner) / h, floored(cells.covariance[0, rows[0]]) / h**2
        marks += [Ellipses(mean, spread, "normal", sigmas=s) for s in (1.0, 2.0)]
        marks.append(Points(mean, "normal", "diamond", radius=4.0))
    name = "Close-up of the chosen cell, with the score of a single point at each place"
    return Panel("cell", name, CLOSE, tuple(marks), grid=False, caption="One cell, and what a point there scores")


@dataclass(frozen=True)
class _Cell:
    """The statistics of the chosen cell; eigenvalues and angle as measured, before the floor."""

    status: str
    count: int
    mean: Array
    low: float
    high: float
    angle: float
    kept: bool


def _chosen_cell(state: State) -> _Cell:
    row, cells = state.row, state.cells
    if row < 0:
        return _Cell("empty", 0, np.zeros(2), 0.0, 0.0, 0.0, False)
    spread = cells.covariance[0, row]
    low, high = (float(v) for v in symmetric_eigen(spread[None])[0][0])
    angle = 0.5 * float(np.degrees(np.arctan2(2 * spread[0, 1], spread[0, 0] - spread[1, 1])))
    is_kept = bool(cells.kept[0, row])
    status = ("kept, floored" if low < FLOOR * high else "kept") if is_kept else "discarded"
    return _Cell(status, int(cells.count[0, row]), cells.mean[0, row], max(low, 0.0), high, angle, is_kept)


def _counts(state: State) -> tuple[int, int, int]:
    """Cells kept, cells discarded, points in kept cells."""
    mask = state.cells.kept[0]
    return int(mask.sum()), int((~mask).sum()), int(state.cells.count[0][mask].sum())


def draw(state: State) -> Picture:
    """The room under its grid, and the chosen cell."""
    h, corner = state.controls.size, state.cells.origin[0, 0] + state.controls.size * np.array(state.chosen)
    rim = Path(corner + h * SQUARE, "accent", closed=True, thick=True, filled=True)
    name = "The room’s scan under the grid, each kept cell’s Gaussian at two standard deviations"
    room = Panel("main", name, ROOM, (*state.grid, rim), grid=False, caption="The map")
    return Picture((room, state.close), _readouts(state), _description(state), note=_note(state))


def _readouts(state: State) -> tuple[Readout, ...]:
    kept_count, discarded_count, covered_count = _counts(state)
    cell = _chosen_cell(state)
    gaussian = cell.count >= LEAST_POINTS
    x, y = cell.mean.tolist()
    return (
        Readout("kept", "Cells kept", str(kept_count), "", "target"),
        Readout("discarded", "Cells discarded", str(discarded_count), "", "outlier"),
        Readout("covered", "Points in kept cells", f"{covered_count} of {len(state.points)}"),
        Readout("cell", "This cell", cell.status),
        Readout("count", "Its points", str(cell.count)),
        Readout("mean", "Mean μ", f"{number(x)}, {number(y)}" if cell.count else "–", "u" if cell.count else ""),
        Readout("high", "Large eigenvalue λ₁", small(cell.high) if gaussian else "–", "u²" if gaussian else ""),
        Readout("low", "Small eigenvalue λ₂", small(cell.low) if gaussian else "–", "u²" if gaussian else ""),
        Readout("angle", "Angle of its long axis", number(cell.angle, 0) if cell.kept else "–", "°" * cell.kept),
    )


def _why(state: State) -> str:
    """Why the chosen cell is discarded."""
    reason = str(state.cells.dropped[0, state.row])
    return f"it has {reason}" if reason == TOO_FEW else f"{reason} have no spread to fit"


def _note(state: State) -> str:
    cell = _chosen_cell(state)
    if cell.status == "empty":
        return "This cell is empty; a point that lands in it scores nothing."
    if not cell.kept:
        return f"This cell is discarded: {_why(state)}."
    if cell.low < FLOOR * cell.high:
        return f"The small eigenvalue is below {number(FLOOR, 3)} λ₁ and is raised to that."
    return ""


def _description(state: State) -> str:
    c, cell = state.controls, _chosen_cell(state)
    kept_count, discarded_count, covered_count = _counts(state)
    count = amount(int(cell.count), "point")
    words = (
        f"A scan of {len(state.points)} points along the walls of a room with a notch and a pillar, with noise of σ ="
        f" {number(c.noise)} u, lies under a grid of {number(c.size)} u cells shifted by ({number(c.nudge_x)},"
        f" {number(c.nudge_y)}) u. Cells that keep a Gaussian, drawn as an ellipse of two standard deviations:"
        f" {kept_count}. Cells that hold points and are discarded: {discarded_count}. So"
        f" {amount(covered_count, 'point')} of the scan count."
    )
    if cell.status == "empty":
        return words + " The chosen cell is empty."
    if not cell.kept:
        return words + f" The chosen cell holds {count} and is discarded: {_why(state)}."
    x, y = cell.mean.tolist()
    return (
        words + f" The chosen cell holds {count}; its mean is ({number(x)}, {number(y)}) u, its eigenvalues"
        f" are {small(cell.high)} and {small(cell.low)} u², and its long axis lies at {number(cell.angle, 0)}°."
    ).replace("< ", "less than ")


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c = state.controls
    stuck = f"points = np.vstack([points, np.tile({SPOT!r}, ({STUCK}, 1))])\n" if c.stuck else ""
    return f"""import numpy as np
from solvers.ndt_map import build
from solvers.wall_scenes import ndt_room

points = ndt_room(seed={state.seed}, noise={c.noise!r}).target
{stuck}# One problem is a batch of one.
cells = build(points[None], {c.size!r}, offset=np.array([{c.nudge_x!r}, {c.nudge_y!r}]))
kept = cells.kept[0]
number = np.round((cells.corner[0] - cells.origin[0, 0]) / {c.size!r})
here = (number == {state.chosen!r}).all(axis=1)  # column and row of the chosen cell

print("kept", kept.sum())
print("discarded", (~kept).sum())
print("count", cells.count[0][here].sum())
"""


WIDGET = Widget(
    name="ndt-map",
    title="A grid of Gaussians",
    controls=Controls,
    presets={
        "default": {},
        "small": {"size": 0.4},
        "large": {"size": 2.0},
        "exact": {"noise": 0.0},
    },
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("next", "Next cell", primary=True),
        *UNDONE,
    ),
    legend=(
        Key("target", "point in a kept cell", "square"),
        Key("target", "Gaussian of a kept cell, two σ", "line"),
        Key("outlier", "discarded: too few points", "cross"),
        Key("outlier", "discarded: all at one place", "diamond"),
        Key("accent", "this cell", "area"),
        Key("normal", "its mean; its Gaussian at one and two σ", "diamond"),
    ),
    hovers=("main",),
    tape=(({}, ("next", "next", "next")), ({"size": 0.4}, ()), ({"size": 2.0}, ()), ({"noise": 0.0}, ())),
    python=python,
    lead=Lead(readouts=("cell", "count", "covered"), controls=("size",), buttons=("next", "reset")),
)
