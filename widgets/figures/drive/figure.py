"""Chapter 12: a real drive played back. The map grows from its scans, placed by odometry, by scan matching or by a
closed graph.

The poses come from a table (`widgets.parts.drive_table`), the echoes from the scans themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from solvers.scenes.drive import telecom_loop
from widgets.drawing.picture import (
    Array,
    Label,
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
from widgets.engine.contract import Action, Button, Key, Lead, Widget
from widgets.engine.controls import Value, choice, toggle
from widgets.parts.drive_table import WRONG, table
from widgets.parts.robot import ARROW
from widgets.parts.scale_bar import scale_bar

VIEW = View(-36.0, 32.0, -33.0, 17.0)
STRIDE = 5  # scans per press
CHUNK = 15  # scans drawn as one mark, which is rendered once
EVERY = 13  # one in so many echoes of a scan is on the map: a page has several whole maps, and every dot costs bytes
PRESENT = 6  # one in so many echoes of the current scan is drawn
APART = 0.35  # m between scans whose echoes are drawn: the robot stood still for the first twenty
FARTHEST = 30.0  # m
SCANS = 225
OPEN = 3  # one in so many loops is drawn for odometry, which leaves them open, with lines as long as the map
WAYS = {"odometry": "Odometry", "matched": "Matched", "closed": "Closed"}


@dataclass(frozen=True)
class Controls:
    """Which poses place the scans on the map, and what goes into the graph."""

    poses: str = choice("odometry", "Poses", WAYS, "From the wheels, scan matching or the graph", keeps="log")
    wrong: bool = toggle(False, "One wrong loop", f"Scan {WRONG[0]} tied to where scan {WRONG[1]} was")
    kernel: str = choice(
        "none",
        "Kernel on loops",
        {"none": "None", "huber": "Huber", "cauchy": "Cauchy"},
        "What happens to a loop that disagrees",
        keeps="log",
    )


@dataclass(frozen=True)
class State:
    """seen: the number of scans taken so far."""

    controls: Controls
    seen: int = 1

    @property
    def way(self) -> Pose:
        """The poses of all scans."""
        c = self.controls
        return table().way(c.poses, c.kernel, c.wrong)


def start(controls: Controls, seed: int) -> State:
    """The first scan."""
    return State(controls)


def act(state: State, action: Action) -> State:
    """Drive on by some scans, or to the end."""
    return replace(state, seen=SCANS if action.name == "finish" else min(state.seen + STRIDE, SCANS))


@lru_cache(maxsize=1)
def drawn_scans() -> tuple[int, ...]:
    """The scans whose echoes are drawn: each at least `APART` from the one before, by the matched poses."""
    t = table().ways["matched", "", False].t
    scans = [0]
    for k in range(1, SCANS):
        if np.hypot(*(t[k] - t[scans[-1]])) >= APART:
            scans.append(k)
    return tuple(scans)


@lru_cache(maxsize=SCANS)
def echoes(k: int, every: int) -> Array:
    """Every `every`-th echo of scan k, in the robot's coordinates."""
    return telecom_loop().points(k, FARTHEST)[k % every :: every]


def inside(points: Array) -> Array:
    """The points inside the window."""
    x, y = points[:, 0], points[:, 1]
    return points[(x > VIEW.x0) & (x < VIEW.x1) & (y > VIEW.y0) & (y < VIEW.y1)]


@lru_cache(maxsize=256)
def chunk(poses: str, kernel: str, wrong: bool, first: int, end: int) -> Points:
    """The echoes of the drawn scans from `first` to before `end`, as one mark that stays the same object."""
    way = table().way(poses, kernel, wrong)
    parts = [way[k].apply(echoes(k, EVERY)) for k in drawn_scans() if first <= k < end]
    points = inside(np.concatenate([np.zeros((0, 2)), *parts]))
    return Points(points, "target", "square", radius=1.0)


def marks(state: State) -> tuple[Mark, ...]:
    """The map so far, the robot's path, the loops, and the robot with its current scan."""
    c, n, way = state.controls, state.seen, state.way
    graph = (c.kernel, c.wrong) if c.poses == "closed" else ("", False)
    out: list[Mark] = [
        chunk(c.poses, *graph, first, min(first + CHUNK, n)) for first in range(0, n, CHUNK)
    ]
    if c.poses != "odometry":
        out.append(Path(table().ways["odometry", "", False].t[:n], "ghost", dotted=True))
    out += [loops(state), Path(way.t[:n], "source")]
    if c.poses == "closed" and c.wrong:
        out += wrong_loop(way, n)
    pose = way[n - 1]
    out.append(Points(inside(pose.apply(echoes(n - 1, PRESENT))), "source", radius=2.5))
    out.append(Path(pose.apply(ARROW), "source", closed=True, filled=True))
    return (*out, *scale_bar(VIEW, "m"))


def loops(state: State) -> Segments:
    """A line between the two scans of each loop, once both have been taken; for odometry, which leaves loops open, one
    in three, faint, so that the map shows between the lines."""
    data, way = table(), state.way
    is_odometry = state.controls.poses == "odometry"
    rows = np.flatnonzero(data.later < state.seen)[:: OPEN if is_odometry else 1]
    a, b = way.t[data.earlier[rows]].reshape(-1, 2), way.t[data.later[rows]].reshape(-1, 2)
    return Segments(a, b, "inlier", np.full(len(a), 0.64) if is_odometry else None)


def wrong_loop(way: Pose, n: int) -> list[Mark]:
    """A ring around each of its two scans, larger for the later, so that both are visible when the edge pulls them
    together; the edge and its name, once both scans have been taken."""
    later, earlier = WRONG
    out: list[Mark] = [Ring(way.t[k], "outlier", radius) for k, radius in ((earlier, 6.0), (later, 10.0)) if k < n]
    if later < n:
        a, b = way.t[later], way.t[earlier]
        out.append(Segments(a, b, "outlier", dashed=True))
        out.append(Label(a, "wrong loop", "outlier", "middle", dy=-16.0))
    return out


def draw(state: State) -> Picture:
    """The map, the readouts and the words."""
    c, n = state.controls, state.seen
    shift, turn = table().missed(state.way, n)
    bend = float(np.linalg.norm(state.way.t[:n] - plain(c.kernel).t[:n], axis=1).max())
    closed = c.poses == "closed"
    has_loops = len(shift) > 0
    distance, angle = driven_so_far(state.way, n)
    readouts = (
        Readout("scans", "Scans so far", str(n)),
        Readout("apart", "Median loop error", *_or_dash(float(np.median(shift)) if has_loops else None, 3, "m")),
        Readout("bent", "Largest shift by the wrong loop", *_or_dash(bend if closed else None, 2, "m")),
        Readout("turn", "Median loop heading error", *_or_dash(float(np.median(turn)) if has_loops else None, 2, "°")),
        Readout("worst", "Largest loop error", *_or_dash(float(shift.max()) if has_loops else None, 3, "m")),
        Readout(
            "weight",
            "Weight left to the wrong loop",
            *_or_dash(table().kept[c.kernel] if closed and c.wrong else None, 3, ""),
        ),
        Readout("driven", "Driven so far", number(distance, 1), "m"),
        Readout("turned", "Turned so far", number(angle, 0), "°"),
    )
    note, c = "", state.controls
    if c.poses != "closed" and (c.wrong or c.kernel != "none"):
        note = "A wrong loop and a kernel have an effect only on closed poses."
    elif n == SCANS:
        note = f"Median error of the {len(shift)} loops: {number(float(np.median(shift)), 3)} m."
    label = "The map so far, seen from above, in metres"
    return Picture(
        (Panel("main", label, VIEW, marks(state)),),
        readouts,
        _description(state, shift, bend),
        note=note,
        disabled=frozenset({"step", "run", "finish"} if n == SCANS else ()),
    )


def driven_so_far(way: Pose, n: int) -> tuple[float, float]:
    """Metres along the path of the first n scans, and degrees turned, positive to the left."""
    steps = np.linalg.norm(np.diff(way.t[:n], axis=0), axis=1)
    turns = way[: n - 1].inverse().compose(way[1:n]).angle if n > 1 else np.zeros(0)
    return float(steps.sum()), float(np.degrees(np.sum(turns)))


def plain(kernel: str) -> Pose:
    """The closed poses without the wrong loop."""
    return table().way("closed", kernel, False)


def _or_dash(value: float | None, decimals: int, unit: str) -> tuple[str, str]:
    return ("–", "") if value is None else (number(value, decimals), unit)


def _description(state: State, shift: Array, bend: float) -> str:
    c, n = state.controls, state.seen
    by = {
        "odometry": "from wheel odometry",
        "matched": "by matching each scan to the one before",
        "closed": "by a graph of matched scans and loops",
    }[c.poses]
    x, y = (number(float(v), 1) for v in state.way.t[n - 1])
    words = [
        f"A map seen from above, of {n} of {SCANS} laser scans of a robot that drives round a block one and a third"
        f" times, assembled {by}. The robot is at ({x}, {y}) m; its scan covers the half circle ahead of it."
    ]
    if not len(shift):
        words.append("No place has been seen twice yet.")
    else:
        gap = number(float(np.median(shift)), 3)
        words.append(f"The poses miss {amount(len(shift), 'loop')} by {gap} m in the median.")
        loops_drawn = f"one loop in {OPEN}" if c.poses == "odometry" else "each loop"
        words.append(f"A line joins the two scans of {loops_drawn}.")
    if c.poses == "closed" and c.wrong:
        kernel = {"none": "no kernel", "huber": "Huber’s kernel", "cauchy": "Cauchy’s kernel"}[c.kernel]
        words.append(
            f"A wrong loop is among the edges; with {kernel} it moves a pose by at most {number(bend)} m."
            f" A small ring marks its scan {WRONG[1]} and a large one its scan {WRONG[0]}, once they have been made."
        )
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers from the scans with the solvers package alone."""
    c, n = state.controls, state.seen
    closed = c.poses == "closed"
    names = ["candidates", *(["close"] if closed else []), *(["edges_of"] if closed and c.wrong else [])]
    lines = [
        "import numpy as np",
        "from solvers import Pose" if closed and c.wrong else "",
        f"from solvers.drives import {'chained, ' if c.poses == 'odometry' else ''}telecom_loop",
        f"from solvers.odometry import {', '.join([*names, 'missed', 'prepare', 'scan_to_scan', 'verified'])}",
        "from solvers.posegraph import Edges, optimise" if closed and c.wrong else "",
        "",
        "drive = telecom_loop()",
        "scans = prepare(drive)",
        "chain = scan_to_scan(scans, drive.motion)",
        "loops = verified(scans, chain.poses, *candidates(chain.poses))",
    ]
    lines += _poses_in_python(c)
    lines += [
        f"used = loops.believed & (loops.source < {n})",
        "shift, turn = missed(poses, loops)",
        "",
        f'print("scans", {n})',
        f'print("driven", np.linalg.norm(np.diff(poses.t[:{n}], axis=0), axis=1).sum())',
        f'print("turned", np.degrees(poses[: {n - 1}].inverse().compose(poses[1:{n}]).angle.sum()))',
    ]
    if (table().later < n).any():
        lines += [
            'print("apart", np.median(shift[used]))',
            'print("worst", shift[used].max())',
            'print("turn", np.degrees(np.median(turn[used])))',
        ]
    if closed:
        lines.append(f'print("bent", np.linalg.norm((poses.t - plain.t)[:{n}], axis=1).max())')
    if closed and c.wrong:
        lines.append('print("weight", found.weights[-1])')
    return "\n".join(line for k, line in enumerate(lines) if line or k > 4) + "\n"


def _poses_in_python(c: Controls) -> list[str]:
    if c.poses == "odometry":
        return ["poses = chained(drive.motion)"]
    if c.poses == "matched":
        return ["poses = chain.poses"]
    line = f'poses = plain = close(chain, loops, kernel="{c.kernel}").poses'
    if not c.wrong:
        return [line]
    return [
        line,
        "edges, robust = edges_of(chain, loops)",
        "R = np.concatenate([edges.relative.R, np.eye(2)[None]])",
        "t = np.concatenate([edges.relative.t, np.zeros((1, 2))])",
        "usual = np.median(loops.information, axis=0)",
        "information = np.concatenate([edges.information, usual[None]])",
        f"i, j = np.append(edges.i, {WRONG[1]}), np.append(edges.j, {WRONG[0]})",
        "edges, robust = Edges(i, j, Pose(R, t), information), np.append(robust, True)",
        f'found = optimise(chain.poses, edges, kernel="{c.kernel}", robust=robust)',
        "poses = found.poses",
    ]


PRESETS: dict[str, dict[str, Value]] = {
    "default": {},
    "matched": {"poses": "matched"},
    "closed": {"poses": "closed"},
    "wrong": {"poses": "closed", "wrong": True},
}

WIDGET = Widget(
    name="drive",
    title="A real drive",
    controls=Controls,
    presets=PRESETS,
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("run", "Play", "run", primary=True, repeats="step"),
        Button("step", "Five more scans"),
        Button("finish", "To the end"),
        Button("back", "Back", "back"),
        Button("reset", "Reset", "reset"),
    ),
    legend=(
        Key("target", "echoes on the map", "square"),
        Key("source", "the robot, its path and current scan"),
        Key("inlier", "loop: two scans of one place", "line"),
        Key("outlier", "wrong loop", "dashed"),
        Key("ghost", "odometry path", "dotted"),
    ),
    tape=(
        ({}, ("finish",)),
        ({"poses": "matched"}, ("finish",)),
        ({"poses": "closed"}, ("finish",)),
        ({"poses": "closed", "wrong": True}, ("finish",)),
        ({"poses": "closed", "wrong": True, "kernel": "cauchy"}, ("finish",)),
    ),
    python=python,
    lead=Lead(readouts=("scans", "apart"), controls=("poses",), buttons=("run", "finish", "reset")),
)
