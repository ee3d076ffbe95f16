"""Rung 5c: one source point at one pose, and what nine contestants link it to, each read off the contestant's state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from solvers import METHODS
from solvers.core.method import Problem
from solvers.core.pose import Pose
from solvers.core.stepper import advance
from solvers.methods.icp import surface_icp
from solvers.methods.icp.surface_icp import SurfaceState
from solvers.methods.ndt.ndt import NdtState
from solvers.methods.ndt.score import evaluate
from solvers.metrics import rre
from solvers.scenes.bird import COUNTS, SHAPE, bird, bird_start
from solvers.scenes.rooms import Scene
from solvers.studies.race import CONTESTANTS, Contestant
from widgets.drawing.picture import (
    FAINT,
    Array,
    Mark,
    Panel,
    Picture,
    Points,
    Readout,
    Ring,
    Role,
    Segments,
    View,
    degrees,
    number,
)
from widgets.engine.contract import UNDONE, Action, Key, Lead, Widget
from widgets.engine.controls import slider
from widgets.figures.contestants.links import LINKS, Linked
from widgets.parts.placing import Placing, place, written
from widgets.parts.room import problem

VIEW = View(-4.7, 4.7, -3.2, 3.2, width=300.0)
ANCHOR = SHAPE.mean(axis=0)
FIRST = "icp"
PLACING = Placing(VIEW, limit=(3.6, 2.0), reach=3.0, least=2.0, panel=FIRST)
SEARCH = "ransac-congruent"
APART = (SEARCH, "mmd")  # their links do not depend on the pose

CAPTIONS = {
    "icp": "the nearest point",
    "point-to-plane": "the wall through it",
    "gicp": "the nearest, two surfaces",
    "ransac-congruent": "none, a guessed motion",
    "ndt": "the Gaussians of its cells",
    "soft-annealed": "all, by nearness",
    "mmd": "none, means of waves",
    "association-bp": "by nearness, one to one",
    "hypothesis-mixture": "twelve one-to-one guesses",
}
LABELS = {c.method: c.label for c in CONTESTANTS}


@dataclass(frozen=True)
class Controls:
    """Which point is linked, and the source's start."""

    point: float = slider(5.0, "Source point", 1.0, COUNTS[0] + 4.0, 1.0, "", "The last four are clutter")
    turn: float = slider(-25.0, "Turn of the source", -180.0, 180.0, 5.0, "°", "From the true pose")
    offset: float = slider(0.9, "Offset of the source", 0.0, 2.4, 0.1, "u", keeps="nothing")


@dataclass(frozen=True, eq=False)
class State:
    """pose: the source's. known: by method, the state of a run from the scene's own start, for what does not depend on
    the pose; that of RANSAC, which ignores the start, is after one step."""

    controls: Controls
    scene: Scene
    pose: Pose
    known: Mapping[str, Any]


def start(controls: Controls, seed: int) -> State:
    """The bird at the start that the two sliders give."""
    scene, cached = _bird_states(seed)
    return State(controls, scene, bird_start(controls.turn, controls.offset), cached)


@lru_cache(maxsize=2)
def _bird_states(seed: int) -> tuple[Scene, Mapping[str, Any]]:
    """The scene and the known states, which depend on no control."""
    scene = bird(seed=seed)
    batches = {c.method: c.begin(problem(scene, scene.start)) for c in CONTESTANTS}
    batches[SEARCH] = advance(batches[SEARCH])
    return scene, {name: batch.state() for name, batch in batches.items()}


def act(state: State, action: Action) -> State:
    """Move the source."""
    return replace(state, pose=PLACING.act(state.pose, ANCHOR, action))


def linked(state: State) -> dict[str, Linked]:
    """What each contestant links the point to, at the state's pose."""
    instance = problem(state.scene, state.pose)
    i = round(state.controls.point) - 1
    return {c.method: LINKS[c.method](_at(c, instance, state.known[c.method]), i, VIEW) for c in CONTESTANTS}


def _at(contestant: Contestant, instance: Problem, cached: Any) -> Any:
    """The contestant's state at the start of a problem, with the normals, covariances and maps already known."""
    if contestant.method in APART:
        return replace(cached, problem=instance)
    if isinstance(cached, SurfaceState):
        return surface_icp.start(instance, cached.options, cached.index, cached.normals, cached.covariances)
    if isinstance(cached, NdtState):
        moved, level = instance.start.apply(instance.source), np.zeros(1, dtype=np.int64)
        at = evaluate(cached.maps[0], moved, moved.mean(axis=1), level)
        return replace(cached, problem=instance, pose=instance.start, level=level, at=at)
    method = METHODS[contestant.method]
    return method.start(instance, cached.options)


def draw(state: State) -> Picture:
    """Nine panels of the same two clouds."""
    links = linked(state)
    scene, i = state.scene, round(state.controls.point) - 1
    moved = state.pose.apply(scene.source)
    under: tuple[Mark, ...] = (
        *(_faint(scene.truth.apply(line), "target") for line in scene.outline),
        *(_faint(state.pose.apply(line), "source") for line in scene.outline),
        Points(scene.target, "target", "square", radius=2.5, weight=np.full(len(scene.target), 0.67)),
        Points(moved, "source", radius=2.5, weight=np.full(len(moved), 0.67)),
    )
    over: tuple[Mark, ...] = (Points(moved[i], "source", radius=4.0), Ring(moved[i], "ink", radius=7.0))
    panels = tuple(
        Panel(
            c.method,
            f"{c.label}: what the chosen source point is linked to",
            VIEW,
            (*under, *links[c.method].marks, *over),
            grid=False,
            caption=f"{c.label}\n{CAPTIONS[c.method]}",
        )
        for c in CONTESTANTS
    )
    readouts = tuple(
        Readout(c.method.replace("-", "_"), c.label, links[c.method].value, links[c.method].unit) for c in CONTESTANTS
    )
    handle = PLACING.handles(state.pose, ANCHOR)[0]
    return Picture(panels, readouts, _description(state, links), (handle,))


def _faint(line: Array, role: Role) -> Segments:
    """The outline from which the points were sampled, which no contestant sees."""
    return Segments(line[:-1], line[1:], role, weight=np.full(len(line) - 1, FAINT))


def _description(state: State, links: dict[str, Linked]) -> str:
    (x, y), heading = place(state.pose, ANCHOR)
    off = float(np.degrees(rre(state.pose, state.scene.truth)))
    summary = "; ".join(f"{LABELS[name]}: {link.value} {link.unit}".strip() for name, link in links.items())
    return (
        f"Nine pictures of {len(state.scene.source)} source and {len(state.scene.target)} target points on the outline"
        f" of a bird, the source centred at ({number(x, 1)}, {number(y, 1)}) u, turned by {degrees(heading)}° and"
        f" {number(off, 1)}° from the truth. Each contestant, with the race’s options, links source point"
        f" {round(state.controls.point)} to: {summary}."
    )


def python(state: State) -> str:
    """A script that computes the same numbers with the solvers package alone."""
    c = state.controls
    instance = problem(state.scene, state.pose)
    (icp,) = (contestant for contestant in CONTESTANTS if contestant.method == FIRST)
    near = _at(icp, instance, state.known[FIRST]).pairing.used[0, round(c.point) - 1]
    nearest = 'print("icp", at_start("icp").detail("pairing").distances[i])\n' if near else ""
    return f"""import numpy as np
from solvers import Pose, register
from solvers.bird_scene import bird
from solvers.race import contestants

scene, i = bird(seed={state.scene.seed}), {round(c.point) - 1}
start = {written(state.pose)}


def at_start(method):  # its links before the first step, with its options in the race
    (one,) = contestants([method])
    return register(scene.source, scene.target, method, start=start, max_steps=0, seed=scene.seed, **one.options)


{nearest}print("soft_annealed", 100 * (1 - at_start("soft-annealed").detail("support")[i]))
print("association_bp", 100 * (1 - at_start("association-bp").detail("support")[i]))
print("hypothesis_mixture", 100 * (1 - at_start("hypothesis-mixture").detail("support")[i]))
"""


WIDGET = Widget(
    name="contestants",
    title="One point, nine answers",
    controls=Controls,
    presets={"default": {}},
    start=start,
    act=act,
    draw=draw,
    buttons=UNDONE,
    legend=(
        Key("source", "source, the chosen point large"),
        Key("target", "target", "square"),
        Key("ink", "what it is linked to", "line"),
        Key("accent", "where it is pulled", "diamond"),
        Key("normal", "wall through the nearest point", "line"),
        Key("target", "covariance of a point (GICP) or cell (NDT)", "ring"),
        Key("source", "the guessed pair, and its partner (RANSAC)", "line"),
        Key("guide", "crests of a wave; its troughs dashed", "line"),
    ),
    handles=("source",),
    tape=(({}, ()), ({"turn": 0.0, "offset": 0.0}, ()), ({"turn": 90.0}, ()), ({"point": 28.0}, ())),
    python=python,
    lead=Lead(readouts=(), controls=("point",), buttons=("reset", "new")),
)
