"""Chapter 0: the ladder as eight small dials. The scene and the robot's start are the same; each rung has its own
objective and end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers import Pose
from solvers.studies.benchmark import CLOSE_DEGREES
from widgets.drawing.picture import Mark, Panel, Picture, Readout, View, number
from widgets.engine.contract import Action, Button, Key, Lead, Motion, Widget
from widgets.engine.controls import slider
from widgets.parts import dial_marks as marks
from widgets.parts.dial import EVERY, MOST, RUNGS, Course, Dial, Rung, made, valleys

SIZE = 8.05  # u from the centre to the border, for the ring and a ball on it; a small dial has no handle
VIEW = View(-SIZE, SIZE, -SIZE, SIZE, width=300.0)
NOISE = 0.02  # u
DETAILS = 3  # the coarse rings; the ends; the full rings


def _short_name(rung: Rung) -> str:
    """A rung's number and title, without an article, so that it fits two lines under a thumbnail."""
    says = rung.says.removeprefix("The ")
    return f"{rung.number} · {says[0].upper()}{says[1:]}"


NAMES: Mapping[str, str] = {name: _short_name(rung) for name, rung in RUNGS.items()}


@dataclass(frozen=True)
class Controls:
    """The only control."""

    turn: float = slider(60.0, "Start: heading off by", -180.0, 180.0, 5.0, "°")


@dataclass(frozen=True, eq=False)
class State:
    """dials: one per rung, in the ladder's order. heading: the common start, radians. rolled: whether they were run."""

    controls: Controls
    dials: tuple[Dial, ...]
    heading: float
    rolled: bool = False

    @cached_property
    def courses(self) -> tuple[Course, ...]:
        """The runs, in the order of the dials."""
        return tuple(dial.course(self.heading) for dial in self.dials)


def start(controls: Controls, seed: int) -> State:
    """All dials, with the robot facing the same way on every rung."""
    dials = tuple(made(name, seed, NOISE, rung.length or 1.0) for name, rung in RUNGS.items())
    return State(controls, dials, float(np.radians(controls.turn)))


def act(state: State, action: Action) -> State:
    """Let all balls go."""
    return replace(state, rolled=True)


def motion(before: State, after: State) -> tuple[Motion, ...]:
    """The motion of each scan from the start to its run's end, once that is known."""
    if before.rolled or "courses" not in after.__dict__:
        return ()
    initial = Pose.from_angle(before.heading)
    return tuple(
        Motion("source", float(course.pose.compose(initial.inverse()).angle), (0.0, 0.0), (x, y), name)
        for name, course in zip(RUNGS, after.courses, strict=True)
        for x, y in [course.pose.t.tolist()]
    )


def known(state: State) -> int:
    """The finest level already computed: first the runs, then the full rings."""
    if state.rolled and "courses" not in state.__dict__:
        return 0
    return 2 if all("ring" in dial.__dict__ for dial in state.dials) else int(state.rolled)


def draw(state: State, detail: int = DETAILS - 1) -> Picture:
    """One small dial per rung, and the outcome of their runs."""
    courses = state.courses if state.rolled and detail > 0 else None
    panels = tuple(_panel(state, k, detail > 1, courses[k] if courses else None) for k in range(len(RUNGS)))
    rings = {dial.rung.name: len(valleys(dial.ring)) for dial in state.dials} if detail > 1 else None
    return Picture(
        panels,
        _readouts(state, courses, rings),
        _description(state, courses, rings),
        note=_note(courses),
        disabled=frozenset(("roll",) if state.rolled else ()),
    )


def _panel(state: State, k: int, full: bool, course: Course | None) -> Panel:
    dial = state.dials[k]
    pose = course.pose if course else Pose.from_angle(state.heading)
    layers: tuple[Mark, ...] = (
        marks.rim(),
        *marks.ring(dial, full),
        *([marks.valley_ticks(dial)] if full else []),
        *marks.room(dial),
        *marks.links(dial, pose, course),
        marks.scan(dial, pose),
        *marks.ball(dial, full, state.heading, course),
    )
    label = NAMES[dial.rung.name]
    return Panel(dial.rung.name, label, VIEW, layers, grid=False, caption=label)


def _arrival_count(courses: tuple[Course, ...]) -> int:
    return sum(course.arrived for course in courses)


def _displaced_count(courses: tuple[Course, ...]) -> int:
    """How many robots face the right way but are in the wrong place: their balls are at the top all the same."""
    return sum(course.rotation < CLOSE_DEGREES and not course.arrived for course in courses)


def _readouts(state: State, courses: tuple[Course, ...] | None, rings: Mapping[str, int] | None) -> tuple[Readout, ...]:
    pending = "…" if state.rolled else "–"
    by = dict(zip(RUNGS, courses, strict=True)) if courses else {}

    def off(name: str) -> tuple[str, str]:
        return (number(by[name].rotation, 1), "°") if name in by else (pending, "")

    return (
        Readout("arrive", f"Rungs that end at the truth, of\u00a0{len(RUNGS)}",
                str(_arrival_count(courses)) if courses else pending),
        Readout("rotation_pairs", "Rotation error at the end, rung 1", *off("pairs")),
        Readout("rotation_nearest", "Rotation error at the end, rung 3", *off("nearest")),
        Readout("valleys_pairs", "Valleys of the ring, rung 1", str(rings["pairs"]) if rings else "…"),
        Readout("valleys_nearest", "Valleys of the ring, rung 3", str(rings["nearest"]) if rings else "…"),
        Readout("valleys_soft", "Valleys of the ring, rung 5a", str(rings["soft"]) if rings else "…"),
    )  # fmt: skip


def _note(courses: tuple[Course, ...] | None) -> str:
    if courses is None:
        return ""
    summary, displaced = f"{_arrival_count(courses)} of {len(RUNGS)} end at the truth", _displaced_count(courses)
    if not displaced:
        return f"{summary}."
    return f"{summary}; {displaced} more {'faces' if displaced == 1 else 'face'} the right way, in the wrong place."


def _description(state: State, courses: tuple[Course, ...] | None, rings: Mapping[str, int] | None) -> str:
    words = [
        "Eight small dials of the same room and robot, which is at its true position,"
        f" {number(state.controls.turn, 0)}° off its true heading at the top. Around each is the rung’s objective for"
        " every heading, higher farther out; marks in the room link the scan to the target. One: lines between true"
        " partners. Two: the same, many of them wrong. Three: lines to the nearest points. Three and a half: lines to"
        " the tangents there. Four: the Gaussians of cells. Five a: threads to all points,"
        " weighted. Five b: the crests of a wave. Nine: a flow, which has no objective."
    ]
    if rings:
        words.append(f"The ring of rung 1 has {rings['pairs']} valley, that of rung 3 has {rings['nearest']}.")
    if courses:
        ends = ", ".join(
            f"rung {rung.number} ({rung.phrase}) {number(course.rotation, 1)}°"
            for rung, course in zip(RUNGS.values(), courses, strict=True)
        )
        words.append(f"{_note(courses)} The ends are off by: {ends}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    seed, nearest = state.dials[0].seed, RUNGS["nearest"].length
    lines = f"""import numpy as np
from solvers import Pose, register
from solvers.metrics import rre
from solvers.scenes import room

scene = room("clean", seed={seed}, noise={NOISE})
source, near = scene.source[::{EVERY}], scene.target[::{EVERY}]
# Rung 1 has the source's own spots, measured a second time.
spots = room("clean", seed={seed}, noise=0.0).source[::{EVERY}]
own = spots + {NOISE} * np.random.default_rng({seed}).standard_normal(spots.shape)


def run(target, method, turns, **options):
    R = np.stack([Pose.from_angle(turn).R for turn in np.atleast_1d(turns)])
    return register(source, target, method, start=Pose(R, np.zeros((len(R), 2))), seed={seed}, **options)


def valleys(ring):
    steps = np.round((ring - ring.min()) / np.ptp(ring), 6)
    steps = steps[steps != np.roll(steps, 1)]  # of equal neighbours one
    return ((steps < np.roll(steps, 1)) & (steps < np.roll(steps, -1))).sum()


heading, circle = np.radians({state.controls.turn!r}), np.radians(np.arange(180) * 2.0 - 180.0)
pairs = run(own, "kabsch", heading)
nearest = run(near, "capped-icp", heading, cap={nearest}, max_steps={MOST})

print("valleys_pairs", valleys(run(own, "kabsch", circle, max_steps=0).objective))
print("valleys_nearest", valleys(run(near, "capped-icp", circle, cap={nearest}, max_steps=0).objective))
print("valleys_soft", valleys(run(near, "cpd-rigid", circle, sigma={RUNGS["soft"].length}, max_steps=0).objective))
"""
    if not state.rolled:
        return lines
    return f"""{lines}print("rotation_pairs", np.degrees(rre(pairs.pose, Pose.identity())[0]))
print("rotation_nearest", np.degrees(rre(nearest.pose, Pose.identity())[0]))
"""


WIDGET = Widget(
    name="ladder-map",
    title="One scene, eight objectives",
    controls=Controls,
    presets={"default": {}},
    start=start,
    act=act,
    draw=draw,
    details=DETAILS,
    known=known,
    buttons=(
        Button("roll", "Let them roll", primary=True),
        Button("reset", "Reset", "reset"),
        Button("new", "New draw", "reseed"),
    ),
    legend=(
        Key("accent", "objective by heading; higher is farther out", "area"),
        Key("ink", "a valley of the ring", "line"),
        Key("source", "source; the ball is its heading"),
        Key("truth", "ended at the truth"),
        Key("source", "ended elsewhere", "ring"),
        Key("target", "target", "square"),
        Key("truth", "truth", "line"),
        Key("pair", "pair, crest of a wave, or how a point moved", "line"),
        Key("target", "Gaussian of a cell, two σ", "ring"),
        Key("outlier", "wrong pair", "dashed"),
        Key("normal", "normal of a surface", "line"),
        Key("ghost", "where it started", "ring"),
    ),
    tape=tuple(({"turn": turn}, ("roll",)) for turn in (60.0, 0.0, -40.0, 100.0, 180.0)),
    motion=motion,
    python=python,
    lead=Lead(readouts=("arrive", "rotation_pairs", "rotation_nearest"), buttons=("roll", "reset", "new")),
)
