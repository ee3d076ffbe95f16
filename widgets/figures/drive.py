"""Chapter 12: a real drive played back. The map grows from its scans, placed by odometry, by scan matching or by a
closed graph."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose
from solvers.core.amounts import amount
from widgets.drawing.picture import Array, Mark, Panel, Path, Picture, Points, Readout, number
from widgets.engine.contract import Action, Button, Key, Lead, Widget
from widgets.engine.controls import Value, choice
from widgets.parts.drive_map import SCANS, VIEW, echo_marks, echoes, inside, loops
from widgets.parts.drive_table import SCRIPT, table
from widgets.parts.robot import ARROW
from widgets.parts.scale_bar import scale_bar

STRIDE = 5  # scans per press
PRESENT = 6  # one in so many echoes of the current scan is drawn
OPEN = 3  # one in so many loops is drawn for odometry, which leaves them open, with lines as long as the map
WAYS = {"odometry": "Odometry", "matched": "Matched", "closed": "Closed"}


@dataclass(frozen=True)
class Controls:
    """Which poses place the scans on the map."""

    poses: str = choice("odometry", "Poses", WAYS, "From the wheels, scan matching or the graph", keeps="log")


@dataclass(frozen=True)
class State:
    """seen: the number of scans taken so far."""

    controls: Controls
    seen: int = 1

    @property
    def way(self) -> Pose:
        """The poses of all scans."""
        return table().way(self.controls.poses)


def start(controls: Controls, seed: int) -> State:
    """The first scan."""
    return State(controls)


def act(state: State, action: Action) -> State:
    """Drive on by some scans, or to the end."""
    return replace(state, seen=SCANS if action.name == "finish" else min(state.seen + STRIDE, SCANS))


def marks(state: State) -> tuple[Mark, ...]:
    """The map so far, the robot's path, the loops, and the robot with its current scan. Of the loops that odometry
    leaves open one in three is drawn, faint, so that the map shows between the lines."""
    poses, n, way = state.controls.poses, state.seen, state.way
    out: list[Mark] = [*echo_marks(n, poses)]
    if poses != "odometry":
        out.append(Path(table().way("odometry").t[:n], "ghost", dotted=True))
    out.append(loops(way, n, OPEN, 0.64) if poses == "odometry" else loops(way, n))
    out.append(Path(way.t[:n], "source"))
    pose = way[n - 1]
    out.append(Points(inside(pose.apply(echoes(n - 1, PRESENT))), "source", radius=2.5))
    out.append(Path(pose.apply(ARROW), "source", closed=True, filled=True))
    return (*out, *scale_bar(VIEW, "m"))


def draw(state: State) -> Picture:
    """The map, the readouts and the words."""
    n = state.seen
    shift, turn = table().missed(state.way, n)
    has_loops = len(shift) > 0
    distance, angle = driven_so_far(state.way, n)
    readouts = (
        Readout("scans", "Scans so far", str(n)),
        Readout("apart", "Median loop error", *_or_dash(float(np.median(shift)) if has_loops else None, 3, "m")),
        Readout("turn", "Median loop heading error", *_or_dash(float(np.median(turn)) if has_loops else None, 2, "°")),
        Readout("worst", "Largest loop error", *_or_dash(float(shift.max()) if has_loops else None, 3, "m")),
        Readout("driven", "Driven so far", number(distance, 1), "m"),
        Readout("turned", "Turned so far", number(angle, 0), "°"),
    )
    at_end = n == SCANS
    return Picture(
        (Panel("main", "The map so far, seen from above, in metres", VIEW, marks(state)),),
        readouts,
        _description(state, shift),
        note=f"Median error of the {len(shift)} loops: {number(float(np.median(shift)), 3)} m." if at_end else "",
        disabled=frozenset({"step", "run", "finish"} if at_end else ()),
    )


def driven_so_far(way: Pose, n: int) -> tuple[float, float]:
    """Metres along the path of the first n scans, and degrees turned, positive to the left."""
    steps = np.linalg.norm(np.diff(way.t[:n], axis=0), axis=1)
    turns = way[: n - 1].inverse().compose(way[1:n]).angle if n > 1 else np.zeros(0)
    return float(steps.sum()), float(np.degrees(np.sum(turns)))


def _or_dash(value: float | None, decimals: int, unit: str) -> tuple[str, str]:
    return ("–", "") if value is None else (number(value, decimals), unit)


def _description(state: State, shift: Array) -> str:
    poses, n = state.controls.poses, state.seen
    by = {
        "odometry": "from wheel odometry",
        "matched": "by matching each scan to the one before",
        "closed": "by a graph of matched scans and loops",
    }[poses]
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
        loops_drawn = f"one loop in {OPEN}" if poses == "odometry" else "each loop"
        words.append(f"A line joins the two scans of {loops_drawn}.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers from the scans with the solvers package alone."""
    poses, n = state.controls.poses, state.seen
    lines = [
        "import numpy as np",
        f"from solvers.drives import {'chained, ' if poses == 'odometry' else ''}telecom_loop",
        f"from solvers.odometry import candidates, {'close, ' if poses == 'closed' else ''}missed, prepare, "
        "scan_to_scan, verified",
        "",
        *SCRIPT,
        {
            "odometry": "poses = chained(drive.motion)",
            "matched": "poses = chain.poses",
            "closed": 'poses = close(chain, loops, kernel="none").poses',
        }[poses],
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
    return "\n".join(lines) + "\n"


PRESETS: dict[str, dict[str, Value]] = {
    "default": {},
    "matched": {"poses": "matched"},
    "closed": {"poses": "closed"},
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
        Key("ghost", "odometry path", "dotted"),
    ),
    tape=(
        ({}, ("finish",)),
        ({"poses": "matched"}, ("finish",)),
        ({"poses": "closed"}, ("finish",)),
    ),
    python=python,
    lead=Lead(readouts=("scans", "apart"), controls=("poses",), buttons=("run", "finish", "reset")),
)
