"""Every rung: its objective over all headings as a ring round the room, and the run from the chosen heading."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers import Pose, Status
from solvers.core.amounts import amount
from solvers.studies.benchmark import CLOSE_DEGREES, CLOSE_DISTANCE
from widgets.drawing.chart import Axis, Series, chart
from widgets.drawing.picture import (
    Handle,
    Mark,
    Panel,
    Picture,
    Points,
    Readout,
    Segments,
    View,
    degrees,
    number,
    turn_keys,
)
from widgets.engine.contract import UNDONE, Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import choice, slider
from widgets.parts import dial_marks as marks
from widgets.parts.dial import (
    COARSE,
    DEFAULTS,
    EVERY,
    HEADINGS,
    MOST,
    RUNGS,
    SLICES,
    STARTS,
    Course,
    Dial,
    headings,
    made,
    valleys,
)
from widgets.parts.ring import place
from widgets.parts.room import with_marks

SIZE = 9.05
VIEW = View(-SIZE, SIZE, -SIZE, SIZE, width=480.0)
QUARTERS = (-180.0, -90.0, 0.0, 90.0, 180.0)  # °, the headings labelled on the unrolled ring
TICK = (0.05, 0.14)  # chart units, from the curve to the ends of a valley's tick
DETAILS = 2 + SLICES  # the coarse ring; the full one; every start, slice by slice


@dataclass(frozen=True)
class Controls:
    """Which rung, where the robot faces, and what was measured."""

    rung: str = choice(
        "nearest",
        "Rung",
        {rung.name: f"{rung.number} · {rung.says}" for rung in RUNGS.values()},
        keeps="log",
        sets=DEFAULTS,
    )
    turn: float = slider(100.0, "Start: heading off by", -180.0, 180.0, 5.0, "°", keeps="presses")
    length: float = slider(
        6.0, "Length scale", 0.2, 6.0, 0.1, "u", named=("rung", {rung.name: rung.scale for rung in RUNGS.values()})
    )
    noise: float = slider(0.02, "Noise σ", 0.0, 0.3, 0.01, "u")


@dataclass(frozen=True, eq=False)
class State:
    """heading: the run's start, radians, 0 at the truth. rolled: whether it is run. every: whether all starts are."""

    controls: Controls
    dial: Dial
    heading: float
    rolled: bool = False
    every: bool = False

    @cached_property
    def course(self) -> Course | None:
        """The run from the heading, once the ball is let go."""
        return self.dial.course(self.heading) if self.rolled else None

    @cached_property
    def value(self) -> float:
        """The objective at the start."""
        return float(self.dial.objective(np.array([self.heading]))[0])

    @cached_property
    def apart(self) -> float:
        """The RMS distance of the drawn source's points to their nearest target points, u."""
        clouds = self.dial.clouds
        _, distances = marks.partners(self.pose.apply(clouds.source), clouds.target)
        return float(np.sqrt(np.mean(distances**2)))

    @property
    def begun(self) -> Pose:
        """The start pose."""
        return Pose.from_angle(self.heading)

    @property
    def pose(self) -> Pose:
        """The pose at which the source is drawn."""
        return self.course.pose if self.course else self.begun


def start(controls: Controls, seed: int) -> State:
    """The robot at its true position with a wrong heading, before any run."""
    dial = made(controls.rung, seed, controls.noise, controls.length)
    return State(controls, dial, float(np.radians(controls.turn)))


def act(state: State, action: Action) -> State:
    """Let the ball go, run every start, or turn the robot."""
    if action.kind == "press":
        return replace(state, rolled=True) if action.name == "roll" else replace(state, every=True)
    if np.hypot(action.x, action.y) < 1e-9:
        return state
    return replace(state, heading=float(np.arctan2(-action.x, action.y)))


def motion(before: State, after: State) -> Motion | None:
    """The move from the start to the end, turned about the robot."""
    if before.rolled or not after.rolled or before.heading != after.heading:
        return None
    x, y = after.pose.t.tolist()
    return Motion("source", float(after.pose.compose(before.pose.inverse()).angle), (0.0, 0.0), (x, y))


def known(state: State) -> int:
    """The finest level already computed; the last one if finer levels add nothing."""
    if "ring" not in state.dial.__dict__:  # where cached_property keeps its values
        return 0
    return 1 + state.dial.slices if state.every else DETAILS - 1


def draw(state: State, detail: int = DETAILS - 1) -> Picture:
    """The dial, the ring unrolled, the numbers and the words."""
    dial, full = state.dial, detail > 0
    arrivals = dial.arrivals(max(0, detail - 1) if state.every else 0)
    layers: tuple[Mark, ...] = (
        marks.rim(),
        *marks.ring(dial, full),
        *([marks.valley_ticks(dial)] if full else []),
        *marks.room(dial),
        *marks.links(dial, state.pose, state.course),
        marks.scan(dial, state.pose),
        *marks.arrivals(arrivals),
        *marks.ball(dial, full, state.heading, state.course),
    )
    label = "The room and the robot’s scan, with the objective over all headings around them"
    count = len(valleys(dial.ring)) if full and not dial.rung.flat else None
    hits = int(arrivals.sum()) if len(arrivals) == STARTS else None
    return Picture(
        (Panel("main", label, VIEW, layers, grid=False), _unrolled(state, full)),
        _readouts(state, count, hits),
        _description(state, count, hits),
        (_handle(state),),
        _note(state),
        frozenset([*(["roll"] if state.rolled else []), *(["every"] if state.every else [])]),
    )


def _handle(state: State) -> Handle:
    x, y = place(state.heading, marks.HAND).tolist()
    keys = turn_keys((0.0, 0.0), marks.HAND, state.heading + np.pi / 2)
    value = f"{degrees(state.heading)}° from the truth"
    return Handle("turn", "Turn the robot", (x, y), value, keys, "turn", angle=float(np.degrees(state.heading)))


def _unrolled(state: State, full: bool) -> Panel:
    """The ring as a chart."""
    dial, flat = state.dial, state.dial.rung.flat
    label = "A flow has no objective to draw" if flat else "Objective, from its lowest to its highest"
    turns = np.degrees(headings()[:: 1 if full else COARSE])
    share = (marks.heights(dial, full) - marks.INNER) / (marks.OUTER - marks.INNER)
    panel = chart(
        "unrolled",
        "The ring unrolled: the objective over the heading",
        [] if flat else [Series(np.append(turns, 180.0), np.append(share, share[0]), "accent")],
        Axis("heading, ° from the truth", -180.0, 180.0, tuple((t, number(t, 0)) for t in QUARTERS)),
        # Room below, so that "low" is clear of the first heading, and above, for a tick at the highest valley.
        Axis(label, -0.12, 1.15, ((0.0, "–"),) if flat else ((0.0, "low"), (1.0, "high"))),
        size=(480.0, 220.0),
    )

    def spot(turn: float) -> list[float]:
        at = 180.0 - (180.0 - float(np.degrees(turn))) % 360.0  # half a turn goes to the right, off the axis' labels
        return [at, float(np.interp(at, turns, share, period=360.0))]

    if full:
        x, y = np.array([spot(turn) for turn in headings()[valleys(dial.ring)]]).reshape(-1, 2).T
        near, far = (np.column_stack([x, y + reach]) for reach in TICK)
        panel = with_marks(panel, Segments(near, far, "ink"))
    if state.course is None:
        return with_marks(panel, Points(spot(state.heading), "source", radius=5.5))
    end = spot(float(state.course.headings[-1]))
    return with_marks(
        panel, Points(spot(state.heading), "ghost", "ring", radius=5.5), Points(end, "source", radius=5.5)
    )


def _readouts(state: State, count: int | None, hits: int | None) -> tuple[Readout, ...]:
    course, flat = state.course, state.dial.rung.flat
    pending = "–" if not state.every else "…"
    return (
        Readout("rotation_start", "Rotation error at the start", number(abs(np.degrees(state.heading)), 1), "°",
                "ghost"),
        Readout("rotation_error", "Rotation error at the end", number(course.rotation, 1) if course else "–",
                "°" if course else "", "source"),
        Readout("translation_error", "Translation error at the end", number(course.translation) if course else "–",
                "u" if course else "", "source"),
        Readout("steps", "Steps", str(len(course.headings) - 1) if course else "–"),
        Readout("objective_start", "Objective at the start", "–" if flat else _objective(state.value),
                state.dial.rung.unit, "ghost"),
        Readout("apart", "RMS distance to nearest points", number(state.apart, 3), "u"),
        Readout("points", "Points of the source", str(len(state.dial.clouds.source))),
        Readout("valleys", f"Valleys of the ring, of {HEADINGS} headings",
                "–" if flat else "…" if count is None else str(count)),
        Readout("arrive", f"Starts that end at the truth, of\u00a0{STARTS}", pending if hits is None else str(hits)),
    )  # fmt: skip


def _objective(value: float) -> str:
    """The objective as text: sums of squares may reach thousands, scores may be negative."""
    return number(value, 3) if value < 1000.0 else f"{value:,.3f}"


ENDS = {
    Status.CONVERGED: "came to rest",
    Status.FINISHED: "ended",
    Status.STALLED: "stalled",
    Status.CAPPED: "hit the step limit",
    Status.DEGENERATE: "found nothing to go by",
}


def _note(state: State) -> str:
    if state.course is None:
        return ""
    course = state.course
    off = f"{number(course.rotation, 1)}° and {number(course.translation)} u off"  # both count for reaching the truth
    return f"It {ENDS[course.status]} {off}{', which counts as the truth' if course.arrived else ': not the truth'}."


def _description(state: State, count: int | None, hits: int | None) -> str:
    rung, course = state.dial.rung, state.course
    words = [
        f"Rung {rung.number}, {rung.phrase}. A room in the middle, with noise of σ ="
        f" {number(state.controls.noise)} u, and around it a ring: {rung.objective}"
        f"{'' if rung.flat else ', for every heading of the robot; higher is farther out'}. The robot is at its true"
        f" position and starts {degrees(state.heading)}° from the true heading, which is at the top."
    ]
    if count is not None:
        words.append(f"The ring has {amount(count, 'valley')}.")
    if course:
        steps = len(course.headings) - 1
        words.append(
            f"The run {ENDS[course.status]} after {amount(steps, 'step')},"
            f" {number(course.rotation, 1)}° and {number(course.translation)} u from the truth."
        )
    if hits is not None:
        words.append(
            f"Starts that end at the truth, of {STARTS} around the ring: {hits}. Inside it squares mark those that do,"
            " crosses those that do not."
        )
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    return "\n".join([*_clouds_in_python(state), *_run_in_python(state), *_printed_in_python(state)]) + "\n"


def _clouds_in_python(state: State) -> list[str]:
    seed, noise = state.dial.seed, state.controls.noise
    lines = [
        "import numpy as np",
        "from solvers import Pose, register",
        "from solvers.metrics import rre, rte",
        "from solvers.scenes import room",
        "",
        f'scene = room("clean", seed={seed}, noise={noise!r})',
        f"source, target = scene.source[::{EVERY}], scene.target[::{EVERY}]",
    ]
    if state.dial.rung.paired:
        lines += [
            "# The source's own spots, measured a second time.",
            f"rng = np.random.default_rng({seed})",
            f'spots = room("clean", seed={seed}, noise=0.0).source[::{EVERY}]',
            f"target = spots + {noise!r} * rng.standard_normal(spots.shape)",
        ]
    if state.dial.clouds.wrong.any():
        lines += [
            f"mixed = rng.permutation(len(source))[:{int(state.dial.clouds.wrong.sum())}]",
            "target[mixed] = target[np.roll(mixed, 1)]",
        ]
    return [*lines, "", ""]


def _run_in_python(state: State) -> list[str]:
    rung, seed = state.dial.rung, state.dial.seed
    options = "".join(f", {name}={value!r}" for name, value in rung.options(state.controls.length).items())
    return [
        "def run(turns, **more):",
        "    turns = np.atleast_1d(turns)",
        "    R = np.stack([Pose.from_angle(turn).R for turn in turns])",
        "    start = Pose(R, np.zeros((len(turns), 2)))",
        f'    return register(source, target, "{rung.method}", start=start, seed={seed}{options}, **more)',
        "",
        "",
        f"heading = {state.heading!r}",
        f"result = run(heading, max_steps={MOST})",
        "",
        f"pose = {'result.pose' if state.course else 'Pose.from_angle(heading)  # once let go: result.pose'}",
        "moved = pose.apply(source).reshape(-1, 2)",
        "squares = ((moved[:, None] - target) ** 2).sum(axis=2).min(axis=1)",
        "",
    ]


def _printed_in_python(state: State) -> list[str]:
    lines = [
        'print("rotation_start", abs(np.degrees(heading)))',
        'print("apart", np.sqrt(squares.mean()))',
        'print("points", len(source))',
    ]
    if not state.dial.rung.flat:
        lines += [
            'print("objective_start", run(heading, max_steps=0).objective[0])',
            f"ring = run(np.radians(np.arange({HEADINGS}) * {360.0 / HEADINGS!r} - 180.0), max_steps=0).objective",
            "steps = np.round((ring - ring.min()) / np.ptp(ring), 6)",
            "steps = steps[steps != np.roll(steps, 1)]  # of equal neighbours one",
            'print("valleys", ((steps < np.roll(steps, 1)) & (steps < np.roll(steps, -1))).sum())',
        ]
    if state.course:
        lines += [
            'print("rotation_error", np.degrees(rre(result.pose, Pose.identity())[0]))',
            'print("translation_error", rte(result.pose, Pose.identity())[0])',
            'print("steps", result.steps[0])',
        ]
    if state.every:
        lines += [
            f"ends = run(np.radians(np.arange({STARTS}) * {360.0 / STARTS!r} - 180.0), max_steps={MOST}).pose",
            "turned, shifted = np.degrees(rre(ends, Pose.identity())), rte(ends, Pose.identity())",
            f'print("arrive", np.sum((turned < {CLOSE_DEGREES!r}) & (shifted < {CLOSE_DISTANCE!r})))',
        ]
    return lines


WIDGET = Widget(
    name="dial",
    title="The objective over all headings",
    controls=Controls,
    presets={"default": {}} | {name: {"rung": name, **sets} for name, sets in DEFAULTS.items() if name != "nearest"},
    start=start,
    act=act,
    draw=draw,
    details=DETAILS,
    known=known,
    buttons=(Button("roll", "Let it roll", primary=True), Button("every", "Every start"), *UNDONE),
    legend=(
        Key("accent", "objective by heading; higher is farther out", "area"),
        Key("ink", "a valley of the ring", "line"),
        Key("source", "source; the ball is its heading", "dot"),
        Key("truth", "ended at the truth", "dot"),
        Key("source", "ended elsewhere", "ring"),
        Key("target", "target", "square"),
        Key("truth", "truth", "line"),
        Key("truth", "a start that ends there", "square"),
        Key("weak", "a start that ends elsewhere", "cross"),
        Key("ghost", "where it started", "ring"),
        Key("pair", "link to the target", "line", under=("rung", *marks.LINKED)),
        Key("guide", "crest of a wave", "line", under=("rung", "means")),
        Key("guide", "how a point moved", "line", under=("rung", "flow")),
        Key("normal", "normal of the target", "line"),
        Key("target", "Gaussian of a cell, two σ", "ring", under=("rung", "cells")),
        Key("outlier", "wrong pair, or one beyond the cap", "dashed"),
    ),
    handles=("turn",),
    # Running a flow from every start takes a while, in the build too.
    tape=tuple(
        ({"rung": name, **sets}, ("roll",) if name == "flow" else ("roll", "every")) for name, sets in DEFAULTS.items()
    ),
    motion=motion,
    python=python,
    lead=Lead(("main",), ("rotation_error", "valleys", "arrive"), ("rung",), ("roll", "every", "reset")),
)
