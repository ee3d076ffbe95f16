"""Chapter 11: one place scanned again and again: where the registrations end, and what closed forms expect."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from solvers import Pose
from solvers.api import register
from solvers.core.arrays import BoolArray
from solvers.studies.coverage import GATE, Runs, ends_of, regions
from solvers.studies.redrawn import ENDS, NO_ECHO, STANDS, Redrawn, redrawn, starts
from solvers.uncertainty import Covariance, Spread, quantile
from widgets.drawing.picture import (
    Array,
    Ellipses,
    Handle,
    Label,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Role,
    Segments,
    View,
    number,
    slide_keys,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice, slider
from widgets.parts.field import within
from widgets.parts.robot import disc

PLAN = View(-6.4, 6.4, -2.75, 2.75, width=480.0)
WINDOW = (-1.0, 1.0, -0.43, 0.43)
CLOSE = View(*WINDOW, width=480.0)
FINE = 0.01  # u: half the close view's width is the multiple of it that the closed forms' ellipses need
NEEDLE = np.array([2.1, 0.14])  # u: half sizes for a needle, which is drawn shorter so that it fits, but still flat
SPARE = np.array([1.6, 1.3 / CLOSE.y1])  # factors on those ellipses, across and upwards: the dots reach farther
BARS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # u
SEEN = 4.2  # u: end walls farther out are beyond the reach of one scan or both
GLYPH, NOSE = disc(0.42, 0.25), 0.34  # u
DRAWS, PRESS = 200, 40
WALLS = (2.0, 6.0, 0.2)  # u: least and greatest distance of the end walls, and its step
STRAY = 0.05  # of the ends; a smaller share is a few stray runs
FAR_OUT = 5.0  # u, how far a free direction is drawn
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


@dataclass(frozen=True)
class Ask:
    """Everything that determines the draws."""

    place: str
    end: float
    method: str
    heading: float
    shift: float
    noise: float
    seed: int


@dataclass(frozen=True, eq=False)
class Block:
    """Some draws: their ends; in how many the Hessian's region and Censi's contain the truth, and one has no bound."""

    poses: Pose
    counts: tuple[int, int, int]


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


@lru_cache(maxsize=8)
def _scans(ask: Ask, count: int) -> tuple[Redrawn, Pose]:
    scans = redrawn(ask.place, count, seed=ask.seed, end=ask.end, noise=ask.noise)
    return scans, starts(scans.truth, count, heading=ask.heading, shift=ask.shift, seed=ask.seed)


def _runs(ask: Ask, first: int, last: int, count: int) -> Runs:
    """The draws from `first` up to `last`, exclusive, of `count` in all."""
    scans, start_poses = _scans(ask, count)
    rows = slice(first, last)
    part = replace(scans, source=scans.source[rows], target=scans.target[rows], weights=scans.weights[rows])
    result = register(part.source, part.target, ask.method, start=start_poses[rows], weights=part.weights, gate=GATE)
    return Runs(part, start_poses[rows], (ask.heading, ask.shift), ask.noise, result, {"gate": GATE})


@lru_cache(maxsize=64)
def _block(ask: Ask, k: int) -> Block:
    draws = _runs(ask, k * PRESS, (k + 1) * PRESS, DRAWS)
    forms = [regions(draws, form) for form in ("hessian", "censi")]
    hessian, censi = (int(np.sum(form.covers(draws.scans.truth))) for form in forms)
    return Block(draws.result.pose, (hessian, censi, int(np.any([f.free.any(axis=-1) for f in forms], axis=0).sum())))


@lru_cache(maxsize=16)
def _closed_forms(ask: Ask) -> tuple[Covariance, Covariance]:
    """The closed forms' covariances for the first pair of scans, centred on the truth."""
    draws = _runs(ask, 0, 1, 1)
    truth = draws.scans.truth
    hessian, censi = (
        replace(regions(draws, form)[0].to("source"), mean=truth).to("target") for form in ("hessian", "censi")
    )
    return hessian, censi


@lru_cache(maxsize=16)
def _ends(ask: Ask, count: int) -> tuple[Spread, tuple[int, int, int]]:
    """The spread of the ends, and the counts of all blocks."""
    blocks = [_block(ask, k) for k in range(count // PRESS)]
    poses = Pose(np.concatenate([b.poses.R for b in blocks]), np.concatenate([b.poses.t for b in blocks]))
    draws = _runs(ask, 0, 1, 1)
    counts = tuple(np.sum([b.counts for b in blocks], axis=0).tolist())
    return ends_of(replace(draws, result=replace(draws.result, pose=poses))), counts


def draw(state: State) -> Picture:
    """The place from above, and the ends close to the true one."""
    stats = _numbers(state)
    return Picture(
        (_plan(state), _close_up(state)),
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


def _places(pose: Pose, stand: Pose) -> Array:
    """The scanner's places at the source scans, in room coordinates, (n, 2)."""
    return np.asarray(stand.apply(pose.t.reshape(-1, 2)))


def _plan(state: State) -> Panel:
    scans, _ = _scans(state.ask, 1)
    first, stand = (STANDS[state.ask.place][k] for k in (0, 1))
    echoes = scans.target[0][np.abs(scans.target[0]).max(axis=1) < NO_ECHO]
    marks: list[Mark] = [Path(wall, "ink") for wall in scans.walls]
    marks += [Points(stand.apply(echoes), "target", "square", radius=2.0), *_robot(stand, "target")]
    marks += _robot(first, "truth")
    if state.drawn:
        spread, _ = _ends(state.ask, state.drawn)
        away = spread.mode != _true_mode(spread, scans.truth)
        kinds: tuple[tuple[Role, BoolArray], ...] = (("outlier", away), ("source", ~away))
        for kind, mask in kinds:
            if mask.any():
                poses = spread.poses[mask]
                at, ahead = _places(poses, stand), (stand.R @ poses.R)[..., 0]
                marks += [Segments(at, at + NOSE * ahead, kind), Points(at, kind, radius=3.5)]
        if (spread.shares > STRAY).sum() > 1:
            at = _places(spread.poses, stand)
            marks.append(Ellipses(at.mean(axis=0), np.cov(at.T), "ghost", sigmas=quantile(0.95, 2) ** 0.5, dashed=True))
    marks.append(Points(first.t, "truth", "cross", radius=5.0))
    return Panel("plan", "The place from above, with all ends", PLAN, tuple(marks), caption="The place, from above")


def _robot(pose: Pose, role: Role) -> tuple[Mark, ...]:
    return (Path(pose.apply(GLYPH), role, closed=True, filled=True),)


def _true_mode(spread: Spread, truth: Pose) -> int:
    """The cluster whose mean is nearest to the truth; stray ends are none."""
    away = [np.linalg.norm(mode.mean.matrix - truth.matrix) for mode in spread.modes]
    return int(np.argmin(np.where(spread.shares >= min(STRAY, spread.shares[0]), away, np.inf)))


def _close_up(state: State) -> Panel:
    """A window around the true position as large as the closed forms' ellipses need; needles are drawn shorter."""
    true, stand = (STANDS[state.ask.place][k] for k in (0, 1))
    ellipses = [stand.apply(covariance.ellipse(reach=FAR_OUT)) for covariance in _closed_forms(state.ask)]
    needle, reach = state.controls.wall > SEEN, np.abs(np.concatenate(ellipses) - true.t).max(axis=0)
    half = NEEDLE if needle else np.full(2, FINE * np.ceil(SPARE * reach / FINE).max())

    def near(places: Array) -> Array:
        return np.asarray((places - true.t) / half)

    bars = [max(bar for bar in BARS if bar <= 0.4 * size) for size in half.tolist()]
    ends = np.array([-0.94, -0.36]) + np.diag(bars / half)
    bar: list[Mark] = [
        Segments(np.tile([-0.94, -0.36], (2, 1)), ends, "guide"),
        Label(ends[0], f"{bars[0]:g} u", "guide", dx=6, dy=4),
        Label(ends[1], f"{bars[1]:g} u", "guide", dx=6, dy=6),
    ]
    marks: list[Mark] = []
    if state.drawn:
        spread, _ = _ends(state.ask, state.drawn)
        mode = _true_mode(spread, stand.inverse().compose(true))
        at = near(_places(spread.poses[spread.mode == mode], stand))
        marks.append(Points(at[np.abs(at).max(axis=1) < 1.0], "source", radius=2.5))
        if np.count_nonzero(spread.mode == mode) > 2:
            marks.append(Path(near(stand.apply(spread.modes[mode].ellipse())), "source"))
    hessian, censi = map(near, ellipses)
    marks += [Path(censi, "inlier", dashed=True), Path(hessian, "accent")]
    times = [number(PLAN.x1 / size, 0) for size in half]
    caption = f"About the truth, enlarged {times[1]} times" + (f" up and {times[0]} across" if needle else "")
    if not within(hessian, WINDOW) + within(censi, WINDOW):
        caption = "About the truth: the expected regions lie outside"
    marks += [Points([(0.0, 0.0)], "truth", "cross", radius=6.0), *bar]
    return Panel("close", "The ends about the true position", CLOSE, tuple(marks), grid=False, caption=caption)


@dataclass(frozen=True)
class _Numbers:
    """widest, narrowest: the largest cluster's σ. claimed: the closed forms'. counts: all blocks'. shares: over 5 %."""

    widest: float
    narrowest: float
    claimed: tuple[tuple[str, str], ...]
    counts: tuple[int, int, int]
    shares: tuple[float, ...]


def _numbers(state: State) -> _Numbers:
    sizes = [(_sizes(form)[1], "u or more" if form.free.any() else "u") for form in _closed_forms(state.ask)]
    claimed = tuple((number(size, 3 if size < 10.0 else 0), unit) for size, unit in sizes)
    if not state.drawn:
        return _Numbers(0.0, 0.0, claimed, (0, 0, 0), ())
    spread, counts = _ends(state.ask, state.drawn)
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
        counted("hessian", "Hessian: truth in region", stats.counts[0], "accent"),
        counted("censi", "Censi: truth in region", stats.counts[1], "inlier"),
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
    free, widths = stats.counts[2], f"σ {number(stats.narrowest, 3)} to {number(stats.widest, 3)} u"
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
        f" {stats.counts[0]} of the Hessian’s 95 % regions and in {stats.counts[1]} of Censi’s."
        f" Draws with an unbounded region: {stats.counts[2]}. Clusters of over 5 % of ends: {len(stats.shares)}."
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
