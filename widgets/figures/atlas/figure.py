"""Chapter 3: where the run from every start ends, as a map with the ends as countries; one run replayed in the room."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from solvers.core.status import Status
from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE
from widgets.drawing.picture import (
    Group,
    Label,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Ring,
    Segments,
    Tiles,
    View,
    number,
    worded,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.engine.script import called, named
from widgets.figures.atlas import basins
from widgets.figures.atlas.basins import Ask, Atlas, Count, Ends, Track
from widgets.parts.room import ANCHOR, BRINGS, PLACING, SETTINGS, errors, outline, still

OPEN = 3.0  # u: the slider's maximum, which turns the gate off
MAP = View(basins.LOW, basins.HIGH, 0.0, basins.FARTHEST, width=640.0, height=440.0, pad=(40.0, 36.0, 24.0, 58.0))
ROOM = View(-7.5, 7.5, -5.9, 6.3, width=320.0)
FIRST = basins.tile_at(-50.0, 2.2)  # lost without a gate, saved by one of 1 u, lost again by one of 0.5 u
TRACED = np.array([(-4.4, -2.5), (4.4, -2.5), (2.5, 2.5)])  # corners of the room whose paths are drawn
WINDOW = (basins.LOW, basins.HIGH, 0.0, basins.FARTHEST)
FINEST = basins.LEVELS - 1


@dataclass(frozen=True)
class Controls:
    """What to run from every start, and on which scans."""

    method: str = choice("icp", "Method", basins.METHODS, keeps="log")
    gate: float = slider(OPEN, "Gate", 0.1, OPEN, 0.1, "u", "At 3\u00a0u it is off; NDT has none")
    setting: str = choice("clean", "Room", SETTINGS, keeps="log", sets=BRINGS)
    noise: float = slider(0.02, "Noise σ", 0.0, 0.3, 0.01, "u")
    outliers: float = slider(0.0, "Outliers", 0.0, 60.0, 5.0, "%", "Of each cloud, at random")


@dataclass(frozen=True, eq=False)
class State:
    """tile: row and column of the start that the room shows. taken: steps of its run that are shown, None for all."""

    controls: Controls
    atlas: Atlas
    tile: tuple[int, int] = FIRST
    taken: int | None = 0

    @property
    def track(self) -> Track:
        """The run from the selected start."""
        return self.atlas.track(*self.tile)

    @property
    def steps(self) -> int:
        """How many of the run's steps are shown."""
        return self.track.steps if self.taken is None else min(self.taken, self.track.steps)

    @property
    def ended(self) -> bool:
        """Whether the run's end is shown."""
        return self.steps == self.track.steps and (self.taken is None or self.taken > 0 or self.track.steps == 0)

    @property
    def pose(self) -> Pose:
        """The source's pose in the room."""
        return self.track.poses[self.steps]


def start(controls: Controls, seed: int) -> State:
    """The first start, before its run."""
    c = controls
    gate = np.inf if c.method == "ndt" or c.gate >= OPEN else c.gate
    return State(c, Atlas(Ask(c.method, gate, c.setting, seed, c.noise, c.outliers / 100.0)))


def act(state: State, action: Action) -> State:
    """Select another start with its whole run, or take one step of the current run, starting over if all is shown."""
    if action.kind != "press":
        return replace(state, tile=basins.tile_at(action.x, action.y), taken=None)
    if action.name == "finish":
        return replace(state, taken=None)
    return replace(state, taken=1 if state.taken is None else min(state.steps + 1, state.track.steps))


def motion(before: State, after: State) -> Motion | None:
    """The move of one step."""
    if before.taken is None or after.taken is None or after.steps != before.steps + 1:
        return None
    return replace(PLACING.motion(before.pose, after.pose, ANCHOR), panel="room")


def draw(state: State, level: int = FINEST) -> Picture:
    """The map with the selected start, and the room with its run."""
    ends = state.atlas.ends(level)
    counts = basins.count(ends, level)
    done = state.taken is not None and state.ended
    return Picture(
        (_map(state, ends), _room(state)),
        _readouts(state, counts),
        _description(state, counts),
        note=_note(state),
        disabled=frozenset({"step", "finish"} if done else {"finish"} if state.taken is None else ()),
    )


# The map


def _map(state: State, ends: Ends) -> Panel:
    row, column = state.tile
    spot = [basins.TURNS[column], basins.OFFSETS[row]]
    marks: list[Mark] = [*_ground(ends), *_axes()]
    if state.ended:
        a, b = basins.around(basins.alike(ends.pose, state.track.poses[-1]))
        marks.append(Segments(a, b, "source", weight=np.ones(len(a))))
    marks += [Ring(spot, "source", radius=8.0), Points(spot, "source", radius=3.0)]
    label = "Where runs end, by the turn and the offset of their starts"
    return Panel("map", label, MAP, tuple(marks), grid=False, caption="Each start, coloured by its end")


@lru_cache(maxsize=16)
def _ground(ends: Ends) -> tuple[Mark, ...]:
    """The kinds of ends, and thin borders between different ends of one kind."""
    a, b = basins.between(ends)
    return Tiles(ends.kind, WINDOW, basins.KINDS), Segments(a, b, "ink", weight=np.full(len(a), 0.2))


@cache
def _axes() -> tuple[Mark, ...]:
    """A frame with the turn below and the offset at the left, and the truth's own start."""
    x0, x1, y0, y1 = WINDOW
    marks: list[Mark] = [Path([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], "guide", closed=True)]
    for x in (-180.0, -90.0, 0.0, 90.0, 180.0):  # below the truth's ring
        marks.append(Label([x, y0], f"{number(x, 0)}°", "guide", "end" if x == x1 else "middle", dy=26))
    for y in (1.0, 2.0, 3.0):  # a 0 would stand on −180°
        marks.append(Label([x0, y], number(y, 0), "guide", "end", dx=-6, dy=4))
    return (
        *marks,
        Label([x1, y0], "turn of the start", "guide", "end", dy=50),
        Label([x0, y1], "offset of the start, up and to the right, u", "guide", dx=-30, dy=-16),
        Ring([0.0, 0.0], "truth", radius=7.0),
    )


# The room


def _room(state: State) -> Panel:
    scene, track, k = state.atlas.scene, state.track, state.steps
    paths = np.stack([track.poses[i].apply(TRACED) for i in range(k + 1)])
    initial = track.poses[0]
    source = Points(state.pose.apply(state.atlas.source), "source", radius=2.0)
    marks: tuple[Mark, ...] = (
        *(outline(scene, initial, "ghost") if k else ()),
        *still(scene),
        *(Path(paths[:, i], "source", weight=0.6) for i in range(len(TRACED)) if k),
        *(Points(paths[:, i], "source", radius=1.5, weight=np.full(k + 1, 0.6)) for i in range(len(TRACED)) if k),
        Group("source", (*outline(scene, state.pose, "source"), source)),
    )
    name = "The source on its way from the chosen start, over the target"
    return Panel("room", name, ROOM, marks, caption=_caption(state))


def _caption(state: State) -> str:
    if not state.ended:
        return f"The chosen start, after {amount(state.steps, 'step')}" if state.steps else "The chosen start"
    return f"The end: {basins.NAMES[state.track.kind]}"


# Numbers and words


def _readouts(state: State, counts: Count) -> tuple[Readout, ...]:
    track, (turn, away) = state.track, errors(state.pose, state.atlas.scene.truth)
    return (
        Readout("reached", "Starts that reach the truth", number(counts.reached, 1), "%", "truth"),
        Readout("end", "This run ends", basins.NAMES[track.kind] if state.ended else "–"),
        Readout("rms", "RMS to nearest", number(float(track.rms[state.steps]), 3), "u", "source"),
        Readout("rotation_error", "Rotation error", number(turn, 1), "°"),
        Readout("translation_error", "Translation error", number(away), "u"),
        Readout("steps", "Its steps", str(state.steps)),
        *(
            Readout(name, label, number(100.0 * counts.by_kind[kind] / counts.starts, 1), "%")
            for kind, name, label in (
                (basins.SHIFTED, "shifted", "Starts that end shifted"),
                (basins.TURNED, "turned", "… turned"),
                (basins.QUARTER, "quarter", "… by a quarter turn"),
                (basins.HALF, "half", "… by half a turn"),
                (basins.NONE, "unfit", "… without a fit"),
            )
        ),
    )


def _note(state: State) -> str:
    c, track = state.controls, state.track
    if state.ended:
        outcome = {Status.STALLED: "stalled", Status.CAPPED: "capped"}.get(track.status, "stopped")
        return f"It {outcome} at step {track.steps}: {worded(track.reason)}."
    if c.method == "ndt" and c.gate < OPEN:
        return "The gate has no effect in NDT."
    return ""


def _description(state: State, counts: Count) -> str:
    c, (row, column) = state.controls, state.tile
    turn, away = errors(state.pose, state.atlas.scene.truth)
    gate = "with no gate" if c.method == "ndt" or c.gate >= OPEN else f"with a gate of {number(c.gate, 1)} u"
    shares = ", ".join(
        f"{number(100.0 * n / counts.starts, 1)} % {words}"
        for n, words in zip(counts.by_kind[1:], SAID, strict=True)
        if n
    )
    words = [
        f"Runs of {basins.METHODS[c.method]}, {gate}, from {counts.starts:,} starts with {len(state.atlas.source)}"
        f" source points: turned by −180° to 180° along x, and shifted by 0 to {number(basins.FARTHEST, 0)} u up and to"
        f" the right along y. The room is ‘{c.setting}’, with noise of σ = {number(c.noise)} u and"
        f" {number(c.outliers, 0)} % outliers.",
        f"{number(counts.reached, 1)} % of the starts end within {number(CLOSE_DEGREES, 0)}° and"
        f" {number(CLOSE_DISTANCE, 1)} u of the truth{'; ' if shares else ''}{shares}.",
        f"The chosen start is turned by {number(float(basins.TURNS[column]), 1)}° and moved by"
        f" {number(float(basins.OFFSETS[row]))} u.",
    ]
    steps = amount(state.steps, "step")
    if state.ended:
        words.append(
            f"Its run ends after {steps}, {number(turn, 1)}° and {number(away)} u from the truth, called"
            f" ‘{basins.NAMES[state.track.kind]}’ here, at an RMS of {number(float(state.track.rms[-1]), 3)} u."
        )
    else:
        words.append(f"After {steps} its run is {number(turn, 1)}° and {number(away)} u from the truth.")
    return " ".join(words)


SAID = (
    "end in the wrong place but hardly turned",
    "end turned by 15° to 75°",
    "by 75° to 135°",
    "by more than 135°",
    "find no fit",
)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c, atlas, (row, column) = state.controls, state.atlas, state.tile
    call = ("source", "scene.target", f'"{c.method}"')
    options = named(atlas.ask.options)
    cap = [] if state.ended else [f"max_steps={state.steps}"]
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        "from solvers.scenes import ROOM_START_DIRECTION, room, room_start",
        "",
        f'scene = room("{c.setting}", seed={atlas.ask.seed}, noise={c.noise!r}, outliers={c.outliers / 100.0!r})',
        f"source = scene.source[::{basins.THINNED}]",
        f"turn = (np.arange({basins.COLUMNS}) + 0.5) * {basins.HIGH - basins.LOW!r} / {basins.COLUMNS} {basins.LOW:+}",
        f"offset = (np.arange({basins.ROWS}) + 0.5) * {basins.FARTHEST!r} / {basins.ROWS}",
        "angles, shifts = np.meshgrid(np.radians(turn), offset)",
        "starts = Pose.from_angle(angles, shifts[..., None] * ROOM_START_DIRECTION)",
        *called("ends = register", *call, "start=starts", *options),
        "degrees, away = np.degrees(rre(ends.pose, scene.truth)), rte(ends.pose, scene.truth)",
        f"right = (degrees < {CLOSE_DEGREES!r}) & (away < {CLOSE_DISTANCE!r})",
        f"start = room_start(turn[{column}], offset[{row}])",
        *called("run = register", *call, "start=start", *options, *cap),
        "gaps = np.linalg.norm(run.pose.apply(source)[:, None] - scene.target, axis=2).min(axis=1)",
        "",
        'print("reached", 100 * right.mean())',
        'print("rms", np.sqrt(np.mean(gaps**2)))',
        'print("rotation_error", np.degrees(rre(run.pose, scene.truth)))',
        'print("translation_error", rte(run.pose, scene.truth))',
    ]
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="atlas",
    title="Where runs end, from every start",
    controls=Controls,
    presets={"default": {}, "gated": {"gate": 1.0}},
    start=start,
    act=act,
    draw=draw,
    details=basins.LEVELS,
    known=lambda state: state.atlas.known,
    buttons=(
        Button("run", "Run", "run", primary=True, repeats="step"),
        Button("step", "Step"),
        Button("finish", "To the end"),
        *UNDONE,
    ),
    legend=(
        Key("truth", "ends at the truth: within 5° and 0.2\u00a0u", "square"),
        Key("end-shifted", "shifted, turned by less than 15°", "area"),
        Key("end-turned", "turned by 15° to 75°", "area"),
        Key("end-quarter", "a quarter turn: 75° to 135°", "area"),
        Key("end-half", "half a turn: more than 135°", "area"),
        Key("end-none", "no fit: capped, or too few pairs", "area"),
        Key("source", "the start, and all with the same end", "ring"),
        Key("target", "target", "square"),
        Key("ghost", "where the run began", "dotted"),
    ),
    clicks=("map",),
    hovers=("map",),
    tape=(({}, ("step",) * 3), ({"gate": 0.2}, ())),
    motion=motion,
    python=python,
    lead=Lead(
        panels=("map", "room"),
        readouts=("reached", "end", "rms"),
        controls=("gate", "method"),
        buttons=("run", "finish", "reset"),
    ),
)
