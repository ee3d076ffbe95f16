"""Chapter 7: two objectives as terrain over translations, and where descents from many starts end on it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Status
from solvers.core.amounts import amount
from solvers.core.arrays import BoolArray
from solvers.scenes.rooms import Scene, room
from widgets.drawing.chart import WIDTH, Axis, Series, chart
from widgets.drawing.picture import Array, Group, Mark, Panel, Path, Picture, Points, Readout, Ring, View, number
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Trace, Widget
from widgets.engine.controls import choice, slider
from widgets.figures.landscape.terrain import Descent, Objective, Terrain, minima, places
from widgets.parts.field import PAD, axis_marks, scale_marks, within
from widgets.parts.room import BRINGS, SETTINGS

REACH = 2.5
WINDOW = (-REACH, REACH, -REACH, REACH)
MAP = View(*WINDOW, width=640.0, pad=PAD)
ROOM = View(-7.6, 7.6, -5.4, 5.4, width=320.0)  # large enough for the source at any shift on the map
BANDS = 4
SIDE = 7  # starts along each side of the lattice of starts
FEW = 5  # most starts whose descents are already drawn with the coarse map
MOST = 250  # most starts that are kept
NEAR = 0.2  # u from the truth that counts as reaching it, as in the race
LATTICE = np.stack(np.meshgrid(*[(np.arange(SIDE) - SIDE // 2) * 2 * REACH / SIDE] * 2), axis=-1).reshape(-1, 2)
NAMES = {"mmd": "MMD²", "capped": "Nearest, capped"}


@dataclass(frozen=True)
class Controls:
    """Which objective, its scale, and what was measured."""

    objective: str = choice("mmd", "Objective", {"mmd": "MMD", "capped": "Nearest neighbour, capped"}, keeps="log")
    length: float = slider(0.6, "Length scale ℓ", 0.2, 3.0, 0.1, "u", "Of MMD’s kernel")
    count: float = slider(32.0, "Frequencies D", 4.0, 128.0, 4.0, "", "Of MMD’s features, one draw extended")
    cap: float = slider(1.0, "Cap τ", 0.2, 3.0, 0.1, "u", "Of the nearest distances")
    setting: str = choice("clean", "Room", SETTINGS, keeps="log", sets=BRINGS)
    noise: float = slider(0.02, "Noise σ", 0.0, 0.3, 0.01, "u")
    outliers: float = slider(0.0, "Outliers", 0.0, 60.0, 5.0, "%", "Of each cloud, replaced by junk")


@dataclass(frozen=True, eq=False)
class State:
    """redraws: how often the frequencies were redrawn. runs: the descents, in the order in which they were begun."""

    controls: Controls
    seed: int
    terrain: Terrain
    redraws: int = 0
    runs: tuple[Descent, ...] = ()

    @property
    def scene(self) -> Scene:
        return self.terrain.scene

    @property
    def count(self) -> int:
        """The number of starts."""
        return sum(len(run.starts) for run in self.runs)


def start(controls: Controls, seed: int) -> State:
    """The terrain, without descents."""
    scene = room(controls.setting, seed=seed, noise=controls.noise, outliers=controls.outliers / 100.0)
    return State(controls, seed, _terrain(controls, scene, seed))


def _terrain(controls: Controls, scene: Scene, draw: int) -> Terrain:
    objective: Objective = "mmd" if controls.objective == "mmd" else "capped"
    count = round(controls.count)
    return Terrain(scene, objective, controls.length, count, draw, controls.cap, WINDOW, BANDS)


def act(state: State, action: Action) -> State:
    """Begin at the clicked place or at a lattice of places, clear all runs, or redraw the frequencies."""
    if action.kind == "click":
        return _with_descents(state, np.clip([[action.x, action.y]], -REACH, REACH))
    if action.name == "sow":
        return _with_descents(state, LATTICE)
    if action.name == "clear":
        return replace(state, runs=())
    redraws = state.redraws + 1
    terrain = _terrain(state.controls, state.scene, state.seed + redraws)
    return replace(state, terrain=terrain, redraws=redraws, runs=tuple(Descent(terrain, r.starts) for r in state.runs))


def _with_descents(state: State, starts: Array) -> State:
    starts = _new_starts(state, starts)
    if not len(starts) or state.count + len(starts) > MOST:
        return state
    return replace(state, runs=(*state.runs, Descent(state.terrain, starts)))


def _new_starts(state: State, starts: Array) -> Array:
    """The starts from which no descent has begun yet: a repeated one would be counted twice."""
    earlier = np.concatenate([np.zeros((0, 2)), *(run.starts for run in state.runs)])
    return np.asarray(starts[~(starts[:, None] == earlier).all(axis=2).any(axis=1)])


def motion(before: State, after: State) -> Trace | None:
    """A trace of the descents that have just begun."""
    (*_, last) = after.runs or (None,)
    is_ready = last is not None and "path" in last.__dict__  # where cached_property keeps its values
    return Trace("descents", "map") if is_ready and after.count > before.count else None


@dataclass(frozen=True)
class _Numbers:
    """The numbers shown for a state. ends: (k, 2); None for many starts while only the coarse map is drawn."""

    ends: Array | None
    reached: int
    end_value: float
    end_away: float
    truth: float
    lowest: Array
    minima: int | None
    steps: int
    status: Status | None


def _numbers(state: State, detail: int) -> _Numbers:
    terrain, values = state.terrain, state.terrain.field.values(detail)
    side = values.shape[0]
    lowest = np.unravel_index(int(np.argmin(np.round(values, 12))), values.shape)
    at = -REACH + (np.array(lowest[::-1]) + 0.5) * 2 * REACH / side
    count = minima(values) if detail == BANDS else None
    truth = float(terrain.chosen.values(np.zeros(2)))
    if detail == 0 and state.count > FEW:
        return _Numbers(None, 0, 0.0, 0.0, truth, at, count, 0, None)
    ends = np.concatenate([np.zeros((0, 2)), *(run.ends for run in state.runs)])
    hits = int((np.hypot(*ends.T) < NEAR).sum())
    if not len(ends):
        return _Numbers(ends, 0, 0.0, 0.0, truth, at, count, 0, None)
    last = state.runs[-1].path
    return _Numbers(
        ends,
        hits,
        float(last.objective[-1, -1]),
        float(np.hypot(*ends[-1])),
        truth,
        at,
        count,
        int(last.steps[-1]),
        Status(int(last.status[-1])),
    )


def draw(state: State, detail: int = BANDS) -> Picture:
    """The terrain with its descents, the scan where the last one ended, and a section of the terrain there."""
    stats = _numbers(state, detail)
    return Picture(
        (_map(state, stats, detail), _room(state, stats), _section(state, stats, detail)),
        _readouts(state, stats),
        _description(state, stats),
        note=_note(state, stats),
        disabled=frozenset(() if state.runs else ("clear",)) | frozenset(("sow",) if _is_full(state) else ()),
    )


def _is_full(state: State) -> bool:
    """Whether the lattice has nothing left to begin, or would exceed the starts that are kept."""
    return not 0 < len(_new_starts(state, LATTICE)) <= MOST - state.count


# The map


def _map(state: State, stats: _Numbers, detail: int) -> Panel:
    field, top = state.terrain.field, state.terrain.top
    objective = "MMD²" if state.controls.objective == "mmd" else "Mean of min(d², τ²), u²,"
    decimals = 3 if top < 0.05 else 2 if top < 0.4 else 1
    marks: tuple[Mark, ...] = (
        field.heat(detail, 0.0, top, strong="low"),
        state.terrain.lines if detail == BANDS else state.terrain.coarse_lines,
        *axis_marks(MAP, "shift in x, u", "shift in y, u"),
        *scale_marks(MAP, (0.0, top), "strong is low", decimals, strong="low"),
        Ring([0.0, 0.0], "truth", radius=10.0),
        *_ways(state, stats),
    )
    name = "The objective over translations at the true rotation, with the descents on it"
    return Panel("map", name, MAP, marks, grid=False, caption=f"{objective} over translations")


def _ways(state: State, stats: _Numbers) -> list[Mark]:
    """A line for each descent; a ring at the starts that lead to the truth, a cross at the others."""
    if stats.ends is None:
        return [Points(np.concatenate([run.starts for run in state.runs]), "source", radius=2.5)]
    marks = [mark for run in state.runs[:-1] for mark in _descents(run)]
    last = [mark for run in state.runs[-1:] for mark in _descents(run)]
    if len(stats.ends) and _inside(stats.ends[-1:])[0]:
        last.append(Points(stats.ends[-1], "source", radius=5.5))
    return [*marks, Group("descents", tuple(last))]


def _descents(run: Descent) -> list[Mark]:
    """The lines of runs that began together, then the marks at their starts and ends."""
    home = np.hypot(*run.ends.T) < NEAR
    return [
        *(Path(part, "source") for i in range(len(run.starts)) for part in within(run.way(i), WINDOW)),
        Points(run.starts[~home], "source", "cross", radius=4.0),
        Points(run.starts[home], "truth", "ring", radius=4.5),
        Points(run.ends[_inside(run.ends)], "source", radius=3.0),
    ]


def _inside(ends: Array) -> BoolArray:
    return np.asarray((np.abs(ends) <= REACH).all(axis=1))


# Beside the map


def _end_shift(stats: _Numbers) -> Array:
    """The shift that the other panels show: where the last descent ended, or the truth."""
    return stats.ends[-1] if stats.ends is not None and len(stats.ends) else np.zeros(2)


def _room(state: State, stats: _Numbers) -> Panel:
    scene, at = state.scene, _end_shift(stats)
    marks: tuple[Mark, ...] = (
        *(Path(line, "truth", thick=True) for line in scene.outline),
        Points(scene.target, "target", "square", radius=2.0),
        Points(state.terrain.turned + at, "source", radius=2.0),
    )
    name = "The source over the target, where the last descent ended or at the truth"
    caption = "No descent yet: the source at the truth"
    if state.count:
        caption = "Where the last descent ended" if stats.ends is not None else "On their way: the source at the truth"
    return Panel("room", name, ROOM, marks, caption=caption)


def _section(state: State, stats: _Numbers, detail: int) -> Panel:
    """Both objectives along x through the end; the one not chosen only once everything else is drawn."""
    at = _end_shift(stats)
    x = np.linspace(-REACH, REACH, 121)
    line = np.stack([x, np.full_like(x, at[1])], axis=1)
    series = []
    for name in NAMES:
        is_chosen = name == state.controls.objective
        if not is_chosen and detail < BANDS:
            continue
        values = (state.terrain.mmd if name == "mmd" else state.terrain.capped).values(line)
        high = float(values.max())
        relative = values / (high if high > 0.0 else 1.0)
        series.append(Series(x, relative, "accent" if name == "mmd" else "ink", dashed=name == "capped"))
    return chart(
        "cut",
        "Both objectives along x through the last end",
        series,
        Axis("shift in x, u", -REACH, REACH),
        Axis("Cut through the end, ÷ its maximum", 0.0, 1.05),
        now=float(at[0]),
        size=(WIDTH, 300.0),
        caption="Solid: MMD². Dashed: nearest distances.",
    )


# Numbers and words


def _readouts(state: State, stats: _Numbers) -> tuple[Readout, ...]:
    unit = "" if state.controls.objective == "mmd" else "u²"
    ended, pending = stats.status is not None, stats.ends is None
    value = (number(stats.end_value, 4), unit) if ended else ("…" if pending else "–", "")
    empty = "…" if pending else "–"
    ends = "…" if stats.ends is None else str(places(stats.ends, 0.1)) if ended else "–"
    share = f"{stats.reached} of {state.count}" if ended else empty
    away = number(stats.end_away, 3) if ended else empty
    return (
        Readout("value", "Objective at the last end", *value, "source"),
        Readout("away", "Last end, from the truth", away, "u" * ended, "source"),
        Readout("steps", "Its steps", f"{stats.steps}" if ended else empty),
        Readout("truth", "Objective at the truth", number(stats.truth, 4), unit, "truth"),
        Readout("lowest", "Deepest tile, from the truth", number(float(np.hypot(*stats.lowest))), "u"),
        Readout("minima", "Local minima on the map", "…" if stats.minima is None else str(stats.minima)),
        Readout("reached", "Starts that reach the truth", share, "", "truth"),
        Readout("places", "Different ends", ends),
    )


ENDS = {
    Status.CONVERGED: "came to rest",
    Status.STALLED: "found no lower point",
    Status.CAPPED: "hit the step limit",
    Status.DEGENERATE: "found nothing within the cap",
}


def _note(state: State, stats: _Numbers) -> str:
    if stats.status is None:
        return ""
    away = f"{number(stats.end_away)} u from the truth"
    if state.count == 1:
        return f"It {ENDS[stats.status]} after {amount(stats.steps, 'step')}, {away}."
    return f"{stats.reached} of {state.count} starts reach the truth; the last one {ENDS[stats.status]} {away}."


def _description(state: State, stats: _Numbers) -> str:
    c = state.controls
    if c.objective == "mmd":
        objective = (
            f"The squared maximum mean discrepancy with {round(c.count)} random frequencies at a length scale of"
            f" {number(c.length, 1)} u"
        )
    else:
        objective = f"The mean squared distance to the nearest target point, each capped at {number(c.cap, 1)} u,"
    x, y = stats.lowest.tolist()
    words = [
        f"{objective} is drawn over shifts of up to {number(REACH, 1)} u along each axis at the true rotation;"
        f" strong colours are low. The room is ‘{c.setting}’, with noise of σ = {number(c.noise)} u and"
        f" {number(c.outliers, 0)} % outliers. The deepest tile lies at ({number(x)}, {number(y)}) u, and the objective"
        f" at the truth, the ring at the centre, is {number(stats.truth, 4)}."
    ]
    if stats.minima is not None:
        words.append(f"The map has {amount(stats.minima, 'local minimum', 'local minima')}.")
    if stats.status is not None and stats.ends is not None:
        u, v = stats.ends[-1].tolist()
        if state.count > 1:
            ends = amount(places(stats.ends, 0.1), "place")
            words.append(f"Of {state.count} descents, which end in {ends}, {stats.reached} end at the truth.")
        words.append(
            f"{'The last one' if state.count > 1 else 'The descent'} {ENDS[stats.status]} at"
            f" ({number(u)}, {number(v)}) u, {number(stats.end_away, 3)} u from the truth, with an objective of"
            f" {number(stats.end_value, 4)}."
        )
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, count = state.controls, round(state.controls.count)
    mmd, side = c.objective == "mmd", state.terrain.field.side
    maker = "mmd_field" if mmd else "capped_field"
    lines = [
        "import numpy as np",
        *(["from solvers.features import unit_frequencies"] if mmd else []),
        f"from solvers.landscape import {maker}",
        "from solvers.scenes import room",
        "",
        f'scene = room("{c.setting}", seed={state.seed}, noise={c.noise!r}, outliers={c.outliers / 100.0!r})',
        *([f"unit = unit_frequencies(np.array([{state.terrain.draw}]), {count}, 2)[0]"] if mmd else []),
        f"field = {maker}(scene.source, scene.target, {f'unit / {c.length!r}' if mmd else repr(c.cap)})",
        f"at = (np.arange({side}) + 0.5) * ({2 * REACH!r} / {side}) - {REACH!r}  # the map's rows and columns, u",
        "values = field.grid(at, at)",
        "row, column = np.unravel_index(values.round(12).argmin(), values.shape)",
        "# The map seen from each of its inner cells: the cell itself, the fifth, and its eight neighbours.",
        f"parts = [values[i : {side - 2} + i, j : {side - 2} + j] for i in range(3) for j in range(3)]",
        "",
        'print("truth", field.values([0.0, 0.0]))',
        'print("lowest", np.hypot(at[column], at[row]))',
        'print("minima", (parts[4] < np.min(parts[:4] + parts[5:], axis=0)).sum())',
    ]
    if state.runs:
        x, y = (repr(float(v)) for v in state.runs[-1].starts[-1])
        lines += [
            f"path = field.path([[{x}, {y}]])",
            'print("value", path.objective[-1, -1])',
            'print("away", np.linalg.norm(path.points[-1, -1]))',
            'print("steps", path.steps[-1])',
        ]
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="landscape",
    title="Two objectives as terrain over translations",
    controls=Controls,
    presets={
        "default": {},
        "capped": {"objective": "capped"},
    },
    start=start,
    act=act,
    draw=draw,
    details=BANDS + 1,
    known=lambda state: state.terrain.field.known,
    buttons=(
        Button("sow", f"Launch {SIDE**2} starts", primary=True),
        Button("resample", "Resample"),
        Button("clear", "Clear"),
        *UNDONE,
    ),
    legend=(
        Key("truth", "truth, and starts that reach it", "ring"),
        Key("source", "starts that do not", "cross"),
        Key("source", "descents, and the source", "line"),
        Key("target", "target", "square"),
    ),
    clicks=("map",),
    tape=(({}, ("sow", "sow")), ({}, ("sow", "resample"))),
    motion=motion,
    python=python,
    lead=Lead(("map", "room"), ("reached", "lowest", "truth"), ("length",), ("sow", "clear", "reset")),
)
