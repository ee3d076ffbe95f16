"""Chapter 12: one wrong loop among the correct ones of a real drive. It bends the closed map, unless a robust kernel
lets go of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solvers import Pose
from widgets.drawing.picture import Array, Label, Mark, Panel, Path, Picture, Readout, Ring, Segments, number
from widgets.engine.contract import Action, Button, Key, Lead, Widget
from widgets.engine.controls import choice
from widgets.parts.drive_map import SCANS, VIEW, echo_marks, loops
from widgets.parts.drive_table import SCRIPT, WRONG, table
from widgets.parts.scale_bar import scale_bar

KERNEL_NAMES = {"none": "None", "huber": "Huber", "cauchy": "Cauchy"}
RADII = (10.0, 6.0)  # px, of the rings round the later and the earlier scan: unequal, for when they lie on each other
ABOVE, ASIDE = -16.0, -10.0  # px from a ring's centre to its words


@dataclass(frozen=True)
class Controls:
    """How the graph treats a loop that disagrees."""

    kernel: str = choice("none", "Kernel on loops", KERNEL_NAMES, "What happens to a loop that disagrees", keeps="log")


@dataclass(frozen=True)
class State:
    """has_wrong_loop: whether it is among the edges."""

    controls: Controls
    has_wrong_loop: bool = False

    @property
    def way(self) -> Pose:
        """The poses of all scans."""
        return table().way("closed", self.controls.kernel, self.has_wrong_loop)

    @property
    def correct(self) -> Pose:
        """The poses by the correct loops alone."""
        return table().way("closed", self.controls.kernel)


def start(controls: Controls, seed: int) -> State:
    """The drive's map, closed by its correct loops."""
    return State(controls)


def act(state: State, action: Action) -> State:
    """Make the wrong loop an edge."""
    return replace(state, has_wrong_loop=True)


def marks(state: State) -> tuple[Mark, ...]:
    """The map, the path and its loops, where the path was without the wrong loop, and the two scans that it joins."""
    way = state.way
    out: list[Mark] = [*echo_marks(SCANS, "closed", state.controls.kernel, state.has_wrong_loop)]
    if state.has_wrong_loop:
        out.append(Path(state.correct.t, "ghost", dotted=True))
    out += [loops(way, SCANS), Path(way.t, "source")]
    out += [Ring(way.t[scan], "outlier", radius) for scan, radius in zip(WRONG, RADII, strict=True)]
    if state.has_wrong_loop:
        out.append(Segments(way.t[WRONG[0]], way.t[WRONG[1]], "outlier", dashed=True))
        out.append(Label(way.t[WRONG[0]], "wrong loop", "outlier", "middle", dy=ABOVE))
    else:
        later, earlier = WRONG
        out.append(Label(way.t[later], f"scan {later}", "outlier", "middle", dy=ABOVE))
        out.append(Label(way.t[earlier], f"scan {earlier}", "outlier", "end", dx=ASIDE, dy=4.0))
    return (*out, *scale_bar(VIEW, "m"))


def draw(state: State) -> Picture:
    """The map, the readouts and the words."""
    shift, turn = table().missed(state.way, SCANS)
    bend = float(np.linalg.norm(state.way.t - state.correct.t, axis=1).max())
    kept = table().kept[state.controls.kernel]
    readouts = (
        Readout("bent", "Largest shift by the wrong loop", number(bend, 2), "m"),
        Readout("apart", "Median error of correct loops", number(float(np.median(shift)), 3), "m"),
        Readout("worst", "Largest error of a correct loop", number(float(shift.max()), 3), "m"),
        Readout("turn", "Median heading error of correct loops", number(float(np.median(turn)), 2), "°"),
        Readout("weight", "Weight left to the wrong loop", number(kept, 3) if state.has_wrong_loop else "–"),
    )
    return Picture(
        (Panel("main", "The closed map, seen from above, in metres", VIEW, marks(state)),),
        readouts,
        _description(state, shift, bend),
        note=f"The wrong loop moves poses by up to {number(bend, 2)} m." if state.has_wrong_loop else "",
        disabled=frozenset({"add"} if state.has_wrong_loop else ()),
    )


def _description(state: State, shift: Array, bend: float) -> str:
    kernel = {"none": "no kernel", "huber": "Huber’s kernel", "cauchy": "Cauchy’s kernel"}[state.controls.kernel]
    later, earlier = WRONG
    words = [
        f"A map seen from above, of {SCANS} laser scans of a robot that drives round a block one and a third times,"
        f" assembled by a graph of matched scans and {len(shift)} correct loops, with {kernel} on the loops."
        " A line joins the two scans of each loop."
    ]
    if state.has_wrong_loop:
        words.append(
            f"A wrong loop is among the edges. It moves poses by up to {number(bend, 2)} m. A large ring marks its scan"
            f" {later}, a small one its scan {earlier}; a dotted line shows the path without it."
        )
    else:
        words.append(f"Rings mark scans {later} and {earlier}, which the wrong loop would join.")
    return " ".join(words)


def python(state: State) -> str:
    """A script that computes the same numbers from the scans with the solvers package alone."""
    kernel, wrong = state.controls.kernel, state.has_wrong_loop
    lines = [
        "import numpy as np",
        *(["from solvers import Pose"] if wrong else []),
        "from solvers.drives import telecom_loop",
        f"from solvers.odometry import candidates, close, {'edges_of, ' if wrong else ''}missed, prepare, "
        "scan_to_scan, verified",
        *(["from solvers.posegraph import Edges, optimise"] if wrong else []),
        "",
        *SCRIPT,
        f'poses = correct = close(chain, loops, kernel="{kernel}").poses',
    ]
    if wrong:
        lines += [
            "edges, robust = edges_of(chain, loops)",
            "R = np.concatenate([edges.relative.R, np.eye(2)[None]])",
            "t = np.concatenate([edges.relative.t, np.zeros((1, 2))])",
            "usual = np.median(loops.information, axis=0)",
            "information = np.concatenate([edges.information, usual[None]])",
            f"i, j = np.append(edges.i, {WRONG[1]}), np.append(edges.j, {WRONG[0]})",
            "edges, robust = Edges(i, j, Pose(R, t), information), np.append(robust, True)",
            f'found = optimise(chain.poses, edges, kernel="{kernel}", robust=robust)',
            "poses = found.poses",
        ]
    lines += [
        "shift, turn = missed(poses, loops)",
        "",
        'print("bent", np.linalg.norm(poses.t - correct.t, axis=1).max())',
        'print("apart", np.median(shift[loops.believed]))',
        'print("worst", shift[loops.believed].max())',
        'print("turn", np.degrees(np.median(turn[loops.believed])))',
    ]
    if wrong:
        lines.append('print("weight", found.weights[-1])')
    return "\n".join(lines) + "\n"


WIDGET = Widget(
    name="wrong-loop",
    title="One wrong loop",
    controls=Controls,
    presets={"default": {}},
    start=start,
    act=act,
    draw=draw,
    buttons=(
        Button("add", "Add the wrong loop", primary=True),
        Button("back", "Back", "back"),
        Button("reset", "Reset", "reset"),
    ),
    legend=(
        Key("target", "echoes on the map", "square"),
        Key("source", "the robot’s path", "line"),
        Key("inlier", "loop: two scans of one place", "line"),
        Key("outlier", "wrong loop", "dashed"),
        Key("ghost", "path without the wrong loop", "dotted"),
    ),
    tape=(
        ({}, ("add",)),
        ({"kernel": "huber"}, ("add",)),
        ({"kernel": "cauchy"}, ("add",)),
    ),
    python=python,
    lead=Lead(readouts=("bent", "apart"), controls=("kernel",), buttons=("add", "reset")),
)
