"""Chapter 0: the ladder as small pictures of the same two clouds. What changes is what stands in for the matches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers import Pose
from solvers.scenes.rooms import BIRD
from widgets.drawing.picture import (
    Array,
    Arrow,
    Ellipses,
    Mark,
    Panel,
    Path,
    Picture,
    Points,
    Readout,
    Ring,
    Role,
    Segments,
    Ticks,
    View,
    number,
)
from widgets.engine.contract import Action, Button, Key, Lead, Widget
from widgets.engine.controls import slider

VIEW = View(-3.0, 3.0, -2.5, 2.5, width=300.0)
COUNT = 36
NOISE = 0.05  # u
WRONG = 10  # wrong partners on rung 2
SHIFT = np.array([-0.1, -0.07])  # u, a third of the way from point to point: without a turn the nearest are right
CELL = 1.25  # u, the side of a cell on rung 4
LEAST = 3  # points that a cell needs for a Gaussian
SIGMA = 0.45  # u, the bandwidth of the soft weights on rung 5
WAVELENGTH = 2.6  # u, of the one frequency shown on rung 5
WAVES, LENGTH = 64, 0.6  # how many waves the readout compares, and the length scale (u) that they are drawn for
DIAL = np.array([2.1, -1.6])


@dataclass(frozen=True)
class Controls:
    """The one thing to change."""

    turn: float = slider(-10.0, "Turn of the source", -180.0, 180.0, 5.0, "°")


@dataclass(frozen=True, eq=False)
class State:
    """bird: (n, 2) where the source belongs. moved: (n, 2) where it is. target: (n, 2), row i the partner of row i.

    proposed: (n,) the target row that rung 2 is told for each source row; `wrong` (n,) where that is not the partner.
    squares: (n, n) squared distances from each moved source point to each target point.
    frequency: (2,) the plane wave of rung 5 that is shown, radians a unit; waves: (k, 2) those that are compared.
    """

    controls: Controls
    seed: int
    bird: Array
    moved: Array
    target: Array
    proposed: np.ndarray[tuple[int], np.dtype[np.int64]]
    squares: Array
    frequency: Array
    waves: Array

    @property
    def near(self) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
        """(n,) the target row nearest to each source row; rounded, so that a tie goes the same way everywhere."""
        return np.asarray(np.round(self.squares, 12).argmin(axis=1))

    @property
    def wrong(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Where rung 2 is told a wrong partner."""
        return np.asarray(self.proposed != np.arange(COUNT))


def start(controls: Controls, seed: int) -> State:
    """Two clouds on one outline, the source displaced."""
    closed = np.vstack([BIRD, BIRD[:1]])
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    along = np.arange(COUNT) / COUNT * lengths[-1]
    bird = np.stack([np.interp(along, lengths, closed[:, k]) for k in (0, 1)], axis=1)
    bird -= bird.mean(axis=0)
    rng = np.random.default_rng(seed)
    target = bird + NOISE * rng.standard_normal((COUNT, 2))
    proposed, mixed = np.arange(COUNT, dtype=np.int64), rng.permutation(COUNT)[:WRONG]
    proposed[mixed] = np.roll(mixed, 1)
    way = np.pi * rng.uniform()
    frequency = 2 * np.pi / WAVELENGTH * np.array([np.cos(way), np.sin(way)])
    waves = rng.standard_normal((WAVES, 2)) / LENGTH
    moved = Pose.from_angle(np.radians(controls.turn), SHIFT).apply(bird)
    squares = ((moved[:, None] - target) ** 2).sum(axis=2)
    return State(controls, seed, bird, moved, target, proposed, np.asarray(squares), frequency, waves)


def act(state: State, action: Action) -> State:
    """Nothing is pressed here."""
    return state


def weights(state: State) -> Array:
    """Soft targets (n, n): each row the weights of the target points for one source point, which sum to one."""
    exponent = -state.squares / (2 * SIGMA**2)
    kernel = np.exp(exponent - exponent.max(axis=1, keepdims=True))
    return np.asarray(kernel / kernel.sum(axis=1, keepdims=True))


def feature_means(state: State, frequencies: Array) -> tuple[Array, Array]:
    """Means of (cos ω·x, sin ω·x) over the source and over the target, each (…, 2) for frequencies ω (…, 2): where each
    cloud lies on the waves, on average."""

    def mean(points: Array) -> Array:
        phase = frequencies @ points.T
        return np.stack([np.cos(phase).mean(axis=-1), np.sin(phase).mean(axis=-1)], axis=-1)

    return mean(state.moved), mean(state.target)


def _links(a: Array, b: Array) -> Segments:
    """What links points to points, fainter than the points."""
    return Segments(a, b, "ink", weight=np.full(len(a), 0.6))


def draw(state: State) -> Picture:
    """One small panel a rung, and what the pictures have in numbers."""
    p, q = state.moved, state.target
    right = int((state.near == np.arange(COUNT)).sum())
    share = float(weights(state).diagonal().mean())
    here, there = feature_means(state, state.frequency)
    means = feature_means(state, state.waves)
    gap = float(np.sqrt(((means[0] - means[1]) ** 2).sum(axis=1).mean()))
    clouds = (
        _faint(q, "target"),
        _faint(p, "source"),
        Points(q, "target", "square", radius=2.5),
        Points(p, "source", radius=2.5),
    )
    rungs: tuple[tuple[str, str, tuple[Mark, ...]], ...] = (
        ("pairs", "1 · Pairs, all right", (_links(p, q), *clouds)),
        ("corrupted", "2 · Pairs, some wrong", (*_corrupted(state), *clouds)),
        ("nearest", "3 · The nearest point", (*_nearest(state), *clouds)),
        ("surface", "3½ · The nearest surface", (*_surface(state), *clouds)),
        ("cells", "4 · The Gaussian of a cell", _cells(state)),
        ("soft", "5 · Weights over all points", (*_soft(state), *clouds)),
        ("features", "5 · Means of a wave", (*_wave(state), *clouds, *_dial(here, there))),
        ("flow", "9 · A flow to follow", (*_flow(state), *clouds)),
    )
    panels = tuple(Panel(name, label, VIEW, marks, grid=False, caption=label) for name, label, marks in rungs)
    readouts = (
        Readout("right_nearest", f"Nearest points that are the true partner, of {COUNT}", str(right)),
        Readout("right_soft", "Soft weight on the true partner, mean", number(share)),
        Readout("mean_gap", f"Root mean square gap of the means of {WAVES} waves", number(gap)),
    )
    return Picture(panels, readouts, _description(state, right, share, gap))


def _faint(points: Array, role: Role) -> Segments:
    """The outline that the points lie on: for the eye alone."""
    return Segments(points, np.roll(points, -1, axis=0), role, weight=np.full(len(points), 0.34))


def _corrupted(state: State) -> tuple[Mark, ...]:
    a, b, wrong = state.moved, state.target[state.proposed], state.wrong
    return (
        _links(a[~wrong], b[~wrong]),
        Segments(a[wrong], b[wrong], "outlier", dashed=True),
        Points((a[wrong] + b[wrong]) / 2, "outlier", "cross", radius=4.0),
    )


def _nearest(state: State) -> tuple[Mark, ...]:
    return (_links(state.moved, state.target[state.near]),)


def _surface(state: State) -> tuple[Mark, ...]:
    """The foot of each source point on the tangent through its nearest target point, and the normals."""
    normals = _normals(state.target)
    near = state.near
    away = ((state.moved - state.target[near]) * normals[near]).sum(axis=1, keepdims=True)
    return (
        _links(state.moved, state.moved - away * normals[near]),
        Ticks(state.target, normals, "normal", 15.0),
    )


def _normals(points: Array, neighbours: int = 4) -> Array:
    """Unit normals (n, 2): across the direction in which a point and its nearest neighbours spread most."""
    squares = ((points[:, None] - points) ** 2).sum(axis=2)
    near = points[np.argsort(np.round(squares, 12), axis=1, kind="stable")[:, : neighbours + 1]]
    near = near - near.mean(axis=1, keepdims=True)
    xx, yy, xy = (
        (near[..., 0] ** 2).sum(axis=1),
        (near[..., 1] ** 2).sum(axis=1),
        (near[..., 0] * near[..., 1]).sum(axis=1),
    )
    along = 0.5 * np.arctan2(2 * xy, xx - yy)
    return np.stack([-np.sin(along), np.cos(along)], axis=1)


def _cells(state: State) -> tuple[Mark, ...]:
    """Mean and covariance of the target points in each cell; a source point in a cell without them meets nothing."""
    cell = np.floor(state.target / CELL).astype(np.int64)
    means, covariances, known = [], [], set()
    for key in np.unique(cell, axis=0):
        inside = state.target[(cell == key).all(axis=1)]
        if len(inside) >= LEAST:
            means.append(inside.mean(axis=0))
            covariances.append(np.cov(inside.T) + 0.02**2 * np.eye(2))
            known.add(tuple(key.tolist()))
    met = np.array([tuple(key) in known for key in np.floor(state.moved / CELL).astype(np.int64).tolist()])
    lines = np.arange(-4, 5) * CELL
    lines_x, lines_y = lines[np.abs(lines) < VIEW.x1], lines[np.abs(lines) < VIEW.y1]
    return (
        Segments(
            [[x, VIEW.y0] for x in lines_x], [[x, VIEW.y1] for x in lines_x], "guide", weight=[0.34] * len(lines_x)
        ),
        Segments(
            [[VIEW.x0, y] for y in lines_y], [[VIEW.x1, y] for y in lines_y], "guide", weight=[0.34] * len(lines_y)
        ),
        Ellipses(means, covariances, "target", sigmas=2.0, filled=True),
        _faint(state.moved, "source"),
        Points(state.moved[~met], "ghost", radius=2.5),
        Points(state.moved[met], "source", radius=2.5),
    )


def _soft(state: State) -> tuple[Mark, ...]:
    """A thread from each source point to each target point with a weight that can be seen."""
    w = weights(state)
    i, j = np.nonzero(np.round(w, 9) >= 0.04)
    return (Segments(state.moved[i], state.target[j], "ink", weight=np.sqrt(w[i, j])),)


def _wave(state: State) -> tuple[Mark, ...]:
    """The crests of the wave, and its troughs dashed."""
    along = state.frequency * WAVELENGTH / (2 * np.pi)
    across = np.array([-along[1], along[0]]) * 10
    crests = (np.arange(-3, 4) * WAVELENGTH)[:, None] * along
    troughs = crests + along * WAVELENGTH / 2
    return (
        Segments(crests - across, crests + across, "guide", weight=[0.67] * len(crests)),
        Segments(troughs - across, troughs + across, "guide", dashed=True, weight=[0.5] * len(troughs)),
    )


def _dial(here: Array, there: Array) -> tuple[Mark, ...]:
    """The two means as hands in the unit disc, and the line between their tips, which is what is made small."""
    reach = 0.75
    hands: tuple[tuple[Array, Role], ...] = ((there, "target"), (here, "source"))
    return (
        Ring(DIAL, "guide", reach=reach),
        Segments(DIAL + reach * here, DIAL + reach * there, "ink"),
        *(Path([DIAL, DIAL + reach * mean], role, thick=True) for mean, role in hands),
        *(Points(DIAL + reach * mean, role, "dot" if role == "source" else "square") for mean, role in hands),
    )


def _flow(state: State) -> tuple[Mark, ...]:
    """The displacements that a flow has to produce: here from the truth, there learned."""
    return tuple(Arrow(a, b, "truth", head=7.0) for a, b in zip(state.moved[::2], state.bird[::2], strict=True))


def _description(state: State, right: int, share: float, gap: float) -> str:
    turned = number(state.controls.turn, 0)
    return (
        f"Eight small pictures of the same two clouds, {COUNT} points each on the outline of a bird, the source turned"
        f" by {turned}° and shifted by {number(float(np.hypot(*SHIFT)))} u. One: a line to the true partner of each"
        f" source point. Two: {WRONG} of the lines, dashed and crossed, lead to a wrong partner. Three: lines to the"
        f" nearest target point, which is the true partner for {right} of {COUNT}. Three and a half: short lines to the"
        f" tangent at the nearest point, with the target's normals. Four: an ellipse for the Gaussian of each cell of"
        f" {CELL} u with {LEAST} target points or more; source points in other cells are grey. Five: threads from each"
        f" source point to the target points around it, as strong as their weights, of which {number(share)} on average"
        f" is on the true partner. Five again: a plane wave over both clouds and a dial with its mean over each;"
        f" over {WAVES} waves the means are {number(gap)} apart. Nine: green arrows along the displacements that a flow"
        " has to produce."
    )


def python(state: State) -> str:
    """The same numbers from the solvers package alone."""
    return f"""import numpy as np
from solvers import Pose
from solvers.scenes import BIRD

# The bird as evenly spaced points, and the same points again with noise.
n, sigma = {COUNT}, {SIGMA}
closed = np.vstack([BIRD, BIRD[:1]])
lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
along = np.arange(n) / n * lengths[-1]
bird = np.stack([np.interp(along, lengths, closed[:, k]) for k in (0, 1)], axis=1)
bird -= bird.mean(axis=0)
rng = np.random.default_rng({state.seed})
target = bird + {NOISE} * rng.standard_normal((n, 2))
rng.permutation(n)  # which pairs rung 2 gets wrong
rng.uniform()  # which way the wave of the picture goes
waves = rng.standard_normal(({WAVES}, 2)) / {LENGTH}
moved = Pose.from_angle(np.radians({state.controls.turn!r}), {tuple(SHIFT.tolist())!r}).apply(bird)

# Partners: the nearest, soft shares, and the means of many waves.
squares = ((moved[:, None] - target) ** 2).sum(axis=2)
soft = np.exp((squares.min(axis=1, keepdims=True) - squares) / (2 * sigma**2))
soft /= soft.sum(axis=1, keepdims=True)
means = [np.exp(1j * waves @ points.T).mean(axis=1) for points in (moved, target)]

print("right_nearest", np.sum(squares.argmin(axis=1) == np.arange(n)))
print("right_soft", soft.diagonal().mean())
print("mean_gap", np.sqrt(np.mean(np.abs(means[0] - means[1]) ** 2)))
"""


WIDGET = Widget(
    name="ladder-map",
    title="What stands in for the matches",
    controls=Controls,
    presets={"default": {}},
    start=start,
    act=act,
    draw=draw,
    buttons=(Button("new", "New draw", "reseed"),),
    legend=(
        Key("source", "source"),
        Key("target", "target", "square"),
        Key("ink", "what links them", "line"),
        Key("outlier", "wrong pair", "cross"),
        Key("normal", "normal of a surface", "line"),
        Key("guide", "cells, or crests of a wave", "line"),
        Key("truth", "displacement to the truth", "line"),
    ),
    tape=tuple(({"turn": turn}, ()) for turn in (-10.0, 0.0, 90.0, 180.0)),
    python=python,
    lead=Lead(buttons=("new",)),
    shows="One small picture a rung: what links two clouds.",
)
