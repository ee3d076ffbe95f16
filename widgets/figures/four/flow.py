"""The walkthrough's fourth panel: one Euler step of the small learned flow in four stages."""

from __future__ import annotations

import numpy as np

from solvers.methods.flow.network import shapes
from solvers.studies.walkthrough import EVERY
from widgets.drawing.picture import Array, Mark, Path, Points, Segments, degrees, number
from widgets.figures.four.run import Look, Shown, carried, cloud, fixed, held

NAME = "Learned flow"
STAGES = ("encode", "endpoint", "project", "read out")


def weights() -> int:
    """How many numbers the network has learned; they are the same for all clouds."""
    return sum(shape.count for shape in shapes())


def shown(look: Look) -> Shown:
    """The marks and the words of the current stage."""
    return (_encode, _endpoint, _project, _read_out, held)[look.walk.stage - 1](look)


def kept(look: Look) -> str:
    """How many coordinates evolve: two per point and sample."""
    return f"{look.before.present[0].size:,}"


def _encode(look: Look) -> Shown:
    state, scene = look.before, look.walk.scene
    moving, target = look.given[::EVERY], scene.target[::EVERY]
    m, tokens = len(moving), state.tokens.shape[1]
    present = _world(look, state.present[0, _sample(look)])
    marks = (
        *_present(present, m),
        Points(target, "target", "square", radius=4.0),
        cloud(moving, radius=4.0),
    )
    t = float(state.time[0])
    part = "all noise" if t == 0.0 else f"{number(100 * (1 - t), 0)} % noise at t = {number(t, 1)}"
    words = f"{tokens} tokens by {weights():,} weights. Rings: one sample, {part}."
    return Shown(marks, words)


def _endpoint(look: Look) -> Shown:
    scene, sample = look.walk.scene, _sample(look)
    before, ends = (_world(look, c[0, sample]) for c in (look.before.present, look.after.predicted))
    m = len(look.given[::EVERY])
    faint = np.full(len(ends), 0.35)
    marks: tuple[Mark, ...] = (
        *fixed(scene),
        Segments(before[m:], ends[m:], "target", weight=faint[m:]),
        Segments(before[:m], ends[:m], "source", weight=faint[:m]),
        Points(ends[m:], "target", "square", radius=4.0),
        cloud(ends[:m], radius=4.0),
    )
    travel = float(np.sqrt(np.square(ends - before).sum(axis=1).mean()))
    words = f"Where the network predicts the ends: {number(travel)} u away, RMS."
    return Shown(marks, words)


def _project(look: Look) -> Shown:
    state, scene, sample = look.after, look.walk.scene, _sample(look)
    m = len(look.given[::EVERY])
    ends, rigid = (_world(look, coordinates[0, sample]) for coordinates in (state.predicted, state.projected))
    source_view, target_view = (view[0, sample] for view in state.views)
    radius, middle = float(state.radius[0]), state.middle[0]
    curve = look.walk.start.apply(scene.outline[0])
    source_curve = _world(look, source_view.apply((curve - state.home[0]) / radius))
    target_curve = _world(look, target_view.apply((scene.truth.apply(scene.outline[0]) - middle) / radius))
    faint = np.full(len(ends), 0.5)
    marks: tuple[Mark, ...] = (
        Path(target_curve, "target"),
        Path(source_curve, "source"),
        Segments(ends, rigid, "accent"),
        Points(ends[m:], "target", "square", radius=2.5, weight=faint[m:]),
        Points(ends[:m], "source", radius=2.5, weight=faint[:m]),
        Points(rigid[m:], "target", "square", radius=4.0),
        cloud(rigid[:m], radius=4.0),
    )
    off = number(radius * float(np.sqrt(state.rigidity[0, sample])), 3)
    count = state.rigidity.shape[1]
    least = f"{off} u RMS off rigid copies, the least of {count} samples"
    words = f"{least}; made rigid." if look.before.options.project else f"{least}; only measured."
    return Shown(marks, words)


def _read_out(look: Look) -> Shown:
    angle = float(look.after.pose[0].angle)
    time = number(float(look.after.time[0]), 1)
    words = f"Fixed copy⁻¹ ∘ moving copy turns by {degrees(angle, 1)}°; on to t = {time}."
    return Shown(carried(look), words)


def _sample(look: Look) -> int:
    return int(look.after.chosen[0])


def _world(look: Look, coordinates: Array) -> Array:
    """The network's coordinates (k, 2), relative to the fixed cloud's centroid and in units of its RMS radius, as world
    coordinates in u."""
    state = look.before
    return np.asarray(state.middle[0] + float(state.radius[0]) * coordinates)


def _present(places: Array, m: int) -> tuple[Mark, ...]:
    return (
        Points(places[m:], "target", "ring", radius=3.0, weight=np.full(len(places) - m, 0.7)),
        Points(places[:m], "source", "ring", radius=3.0, weight=np.full(m, 0.7)),
    )
