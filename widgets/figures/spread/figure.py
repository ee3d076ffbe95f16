"""Chapter 11: one place scanned again and again: where the registrations end, and what closed forms expect."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers.studies.redrawn import ENDS
from solvers.uncertainty import Covariance
from widgets.drawing.picture import Handle, Picture, Readout, Role, number, slide_keys
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice, slider
from widgets.figures.spread.panels import close_up, plan
from widgets.figures.spread.runs import DRAWS, FAR_OUT, PRESS, STRAY, Ask, Counts, closed_forms, ends

WALLS = (2.0, 6.0, 0.2)  # u: least and greatest distance of the end walls, and its step
PLACES = {"room": "Room", "corridor": "Corridor", "hall": "Hall, any heading"}
METHODS = {"plane": "Point to plane", "point": "Point to point"}
SOLVERS = {"plane": "point-to-plane", "point": "icp"}


@dataclass(frozen=True)
class Controls:
    """Where the robot is, how it measures, and how well it knows its start."""

    scene: str = choice(
        "room", "Place", PLACES,
        sets={
            "room": {"wall": ENDS["room"], "heading": 3.0},
            "corridor": {"wall": ENDS["corridor"], "heading": 3.0},
            "hall": {"wall": ENDS["hall"], "heading": 90.0},
        },
    )
    wall: float = slider(
        ENDS["room"], "End walls at", *WALLS, "u", "From the middle; the scanner sees 5\u00a0u", "nothing"
    )
    method: str = choice("plane", "Residual", METHODS, keeps="log")
    heading: float = slider(3.0, "Start: heading σ", 0.0, 90.0, 1.0, "°")
    shift: float = slider(0.15, "Start: position σ", 0.0, 0.3, 0.05, "u")
    noise: float = slider(0.04, "Noise σ", 0.01, 0.1, 0.01, "u", "Of the measured range, along the ray")


@dataclass(frozen=True, eq=False)
class State:
    """drawn: the number of draws so far, a multiple of `PRESS`."""

    controls: Controls
    ask: Ask
    drawn: int = 0


def start(controls: Controls, seed: int) -> State:
    """One pair of scans, before any draw."""
    c = controls
    return State(c, Ask(c.scene, c.wall, SOLVERS[c.method], c.heading, c.shift, c.noise, seed))


def act(state: State, action: Action) -> State:
    """Make more draws, or all."""
    return replace(state, drawn=DRAWS if action.name == "finish" else min(state.drawn + PRESS, DRAWS))


def draw(state: State) -> Picture:
    """The place from above, and the ends close to the true one."""
    stats = _numbers(state)
    return Picture(
        (plan(state.ask, state.drawn), close_up(state.ask, state.drawn)),
        _readouts(state, stats),
        _description(state, stats),
        (_handle(state.controls.wall),),
        note=_note(state, stats),
        disabled=frozenset({"more", "finish"} if state.drawn == DRAWS else ()),
    )


def _handle(wall: float) -> Handle:
    """The handle on the right end wall, which moves the other one too."""
    keys, words = slide_keys(wall, 0.0, *WALLS), f"{number(wall, 1)} u from the middle"
    return Handle("wall", "Move the end walls", (wall, 0.0), words, keys, "push", "plan", sets="wall")


@dataclass(frozen=True)
class _Numbers:
    """widest, narrowest: the largest cluster's σ. claimed: the closed forms'. counts: all blocks'. shares: over 5 %."""

    widest: float
    narrowest: float
    claimed: tuple[tuple[str, str], ...]
    counts: Counts
    shares: tuple[float, ...]


def _numbers(state: State) -> _Numbers:
    sizes = [(_sizes(form)[1], "u or more" if form.free.any() else "u") for form in closed_forms(state.ask)]
    claimed = tuple((number(size, 3 if size < 10.0 else 0), unit) for size, unit in sizes)
    if not state.drawn:
        return _Numbers(0.0, 0.0, claimed, Counts(), ())
    spread, counts = ends(state.ask, state.drawn)
    shares = tuple(spread.shares[spread.shares > STRAY].tolist())
    return _Numbers(*_sizes(spread.modes[0])[::-1], claimed, counts, shares)


def _sizes(spread: Covariance) -> tuple[float, float]:
    low, high = np.sqrt(np.maximum(np.linalg.eigvalsh(spread.point_covariance(reach=FAR_OUT)), 0.0))
    return float(low), float(high)


def _readouts(state: State, stats: _Numbers) -> tuple[Readout, ...]:
    n, unit = state.drawn, "u" if state.drawn else ""

    def later(value: str) -> str:
        return value if n else "–"

    def counted(name: str, label: str, count: int, role: Role) -> Readout:
        return Readout(name, label, later(str(count)), f"of {n}" if n else "", role)

    return (
        counted("hessian", "Hessian: truth in region", stats.counts.hessian, "accent"),
        counted("censi", "Censi: truth in region", stats.counts.censi, "inlier"),
        Readout("widest", "Ends: largest σ of the position", later(number(stats.widest, 3)), unit, "source"),
        Readout("narrowest", "Ends: smallest σ of the position", later(number(stats.narrowest, 3)), unit, "source"),
        Readout("claimed", "Hessian: largest σ of the position", *stats.claimed[0], "accent"),
        Readout("carried", "Censi: largest σ of the position", *stats.claimed[1], "inlier"),
        Readout("modes", "Clusters of ends, over 5 %", later(str(len(stats.shares)))),
        Readout("drawn", "Scans redrawn", str(n)),
    )


def _note(state: State, stats: _Numbers) -> str:
    if not state.drawn:
        return ""
    free, widths = stats.counts.unbounded, f"σ {number(stats.narrowest, 3)} to {number(stats.widest, 3)} u"
    words = f"{state.drawn} draws" + (f", {free} with unbounded regions" if free else "")
    largest, *others = [round(share * state.drawn) for share in stats.shares] or [state.drawn]
    if largest < (1.0 - STRAY) * state.drawn:
        return f"{words}; clusters: {' + '.join([f'{largest} ends ({widths})', *map(str, others)])}."
    return f"{words}: position {widths}."


def _description(state: State, stats: _Numbers) -> str:
    c = state.controls
    asked = (
        f"A robot scans a {c.scene} with end walls {number(c.wall, 1)} u from the middle, from two places, with range"
        f" noise of σ = {number(c.noise)} u. {METHODS[c.method]} registers the two scans, from starts with"
        f" σ = {number(c.heading, 0)}° and {number(c.shift)} u. From one pair of scans the Hessian expects a largest σ"
        f" of the position of {' '.join(stats.claimed[0])}, Censi’s formula {' '.join(stats.claimed[1])}."
    )
    if not state.drawn:
        return f"{asked} No scans have been redrawn yet."
    counts = [round(share * state.drawn) for share in (max(stats.shares, default=0.0), 1.0 - sum(stats.shares))]
    return (
        f"{asked} Over {state.drawn} redrawn pairs, the ends of the largest cluster spread by"
        f" {number(stats.narrowest, 3)} u one way and {number(stats.widest, 3)} u the other. The truth lies in"
        f" {stats.counts.hessian} of the Hessian’s 95 % regions and in {stats.counts.censi} of Censi’s."
        f" Draws with an unbounded region: {stats.counts.unbounded}. Clusters of over 5 % of ends: {len(stats.shares)}."
        f" In the largest: {counts[0]}, in none: {counts[1]}."
    )


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    a = state.ask
    arguments = (
        f'"{a.place}", "{a.method}", {{count}}, seed={a.seed}, end={a.end!r}, noise={a.noise!r},'
        f" heading={a.heading!r}, shift={a.shift!r}"
    )
    lines = [
        "import numpy as np",
        "from solvers.uncertainty_study import ends_of, regions, runs",
        "",
        "def sizes(spread):  # the standard deviations of the scanner's place, u",
        f"    return np.sqrt(np.linalg.eigvalsh(spread.point_covariance(reach={FAR_OUT!r})))",
        "",
        f"one = runs({arguments.format(count=1)})",
        'print("claimed", sizes(regions(one, "hessian")[0])[1])',
        'print("carried", sizes(regions(one, "censi")[0])[1])',
        f'print("drawn", {state.drawn})',
    ]
    if state.drawn:
        lines += [
            "",
            f"made = runs({arguments.format(count=state.drawn)})",
            "ends = ends_of(made)",
            'print("hessian", regions(made, "hessian").covers(made.scans.truth).sum())',
            'print("censi", regions(made, "censi").covers(made.scans.truth).sum())',
            'print("narrowest", sizes(ends.modes[0])[0])',
            'print("widest", sizes(ends.modes[0])[1])',
            f'print("modes", (ends.shares > {STRAY}).sum())',
        ]
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="spread",
    title="One place, scanned again and again",
    controls=Controls,
    presets={
        "default": {},
        "corridor": {"scene": "corridor"},
        "hall": {"scene": "hall"},
        "point": {"method": "point"},
    },
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("more", f"Draw {PRESS}", primary=True),
        Button("run", "Run", "run", repeats="more"),
        Button("finish", f"All {DRAWS}"),
        *UNDONE,
    ),
    legend=(
        Key("source", "where redrawn scans end, and their ellipse"),
        Key("accent", "expected by the Hessian, 95 %", "line"),
        Key("inlier", "expected by Censi’s formula, 95 %", "dashed"),
        Key("truth", "the true position", "cross"),
        Key("target", "target scan, and its robot", "square"),
        Key("outlier", "ends elsewhere"),
        Key("ghost", "one ellipse for all ends", "dashed"),
        Key("ink", "walls", "line"),
    ),
    tape=(
        *(({"scene": scene}, presses) for scene in PLACES for presses in (("more",) * (DRAWS // PRESS), ("finish",))),
        ({"method": "point"}, ("finish",)),
    ),
    python=python,
    lead=Lead(None, ("hessian", "censi", "widest"), ("wall",), ("more", "finish", "reset", "new")),
)
