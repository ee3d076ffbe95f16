"""What each contestant of the race links one source point to, read off its own state: marks, and a few words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.methods.soft import annealed
from solvers.methods.soft.belief_propagation import marginal_matrix
from widgets.drawing.picture import Array, Arrow, Ellipses, Label, Mark, Path, Points, Segments, View, number

WALL = 1.6  # u, how far the tangent is drawn to either side
SIGMAS = 0.6  # standard deviations at which GICP's surface covariances are drawn: their scale is a convention


@dataclass(frozen=True, eq=False)
class Linked:
    """What a point is linked to. marks: in world coordinates. value, unit: as a readout shows it."""

    marks: tuple[Mark, ...]
    value: str
    unit: str = ""


def _nearest(state: Any, i: int) -> tuple[Array, Array, bool]:
    """The moved point, its nearest target point, and whether the pair is used."""
    pairing = state.pairing
    return pairing.moved[0, i], state.index.points[0, pairing.rows[0, i]], bool(pairing.used[0, i])


def icp(state: Any, i: int, view: View) -> Linked:
    """A line to the nearest point, dashed beyond the gate."""
    x, q, used = _nearest(state, i)
    distance = float(np.hypot(*(x - q)))
    line = Segments(x, q, "ink" if used else "outlier", dashed=not used)
    return Linked((line,), number(distance) if used else "none within the gate", "u away" if used else "")


def plane(state: Any, i: int, view: View) -> Linked:
    """The tangent through the nearest point, and the line to its foot there: only that distance counts."""
    x, q, used = _nearest(state, i)
    n = state.normals.vectors[0, state.pairing.rows[0, i]]
    if not used:
        return Linked((Segments(x, q, "outlier", dashed=True),), "not used")
    along, across = np.array([-n[1], n[0]]), float((x - q) @ n)
    return Linked(
        (
            Segments(q - WALL * along, q + WALL * along, "normal"),
            Segments(x, q, "ghost", dashed=True),
            Segments(x, x - across * n, "ink"),
        ),
        number(abs(across)),
        "u across",
    )


def gicp(state: Any, i: int, view: View) -> Linked:
    """The nearest point, with both points' covariances."""
    x, q, used = _nearest(state, i)
    of_source, of_target = state.covariances
    R = state.pose.R[0]
    source_covariance = R @ of_source[0, i] @ R.T
    target_covariance = of_target[0, state.pairing.rows[0, i]]
    distance = float(np.sqrt((x - q) @ state.precision[0, i] @ (x - q)))
    return Linked(
        (
            Ellipses(x, source_covariance, "source", sigmas=SIGMAS, filled=True),
            Ellipses(q, target_covariance, "target", sigmas=SIGMAS, filled=True),
            Segments(x, q, "ink" if used else "outlier", dashed=not used),
        ),
        number(distance) if used else "none within the gate",
        "deviations" if used else "",
    )


def ransac(state: Any, i: int, view: View) -> Linked:
    """The point pair of the best motion so far, its congruent target pair, and where that motion puts the point."""
    p, q = state.problem.source[0], state.problem.target[0]
    start, pose = state.problem.start[0], state.pose[0]
    x, to = start.apply(p[[i]])[0], pose.apply(p[[i]])[0]
    marks: list[Mark] = [Arrow(x, to, "accent", head=7.0)] if np.hypot(*(to - x)) > 0.05 else []
    if state.source_pair[0, 0] >= 0:
        source_pair, target_pair = start.apply(p[state.source_pair[0]]), q[state.target_pair[0]]
        marks = [Path(source_pair, "source", thick=True), Path(target_pair, "target", thick=True), *marks]
    return Linked(tuple(marks), f"{int(state.count[0])} of {len(p)}", "agree")


def ndt(state: Any, i: int, view: View) -> Linked:
    """The Gaussians of the cells that contain the point, one per grid, with lines as strong as their contributions."""
    cells, values = state.at.cells[0, :, i], state.at.values[0, :, i]
    inside = cells >= 0
    chart = state.maps[int(state.level[0])]
    mean, covariance = chart.mean[0, cells[inside]], chart.covariance[0, cells[inside]]
    x = state.pose[0].apply(state.problem.source[0][[i]])
    marks: tuple[Mark, ...] = ()
    if inside.any():
        marks = (
            Ellipses(mean, covariance, "target", sigmas=2.0, filled=True),
            Segments(np.broadcast_to(x, mean.shape), mean, "ink", weight=values[inside]),
        )
    return Linked(marks, f"{int(inside.sum())} of {len(cells)}", "cells")


def _threads(x: Array, target: Array, weights: Array, soft: Array) -> tuple[Mark, ...]:
    """Threads, the larger a weight the stronger, and the mean that they pull towards."""
    visible = weights > 1 / 64
    if not visible.any():
        return ()
    ends = target[visible]
    strong = np.clip((np.floor(np.log2(weights[visible])) + 7.0) / 6.0, 0.0, 1.0)
    return (
        Segments(np.broadcast_to(x, ends.shape), ends, "ink", weight=strong),
        Points(soft, "accent", "diamond", radius=4.5),
    )


def _shared(state: Any, i: int, weights: Array) -> Linked:
    x = state.pose[0].apply(state.problem.source[0][[i]])[0]
    marks = _threads(x, state.problem.target[0], weights, state.soft[0, i])
    return Linked(marks, number(100.0 * (1.0 - float(weights.sum())), 0), "% unlinked")


def soft(state: Any, i: int, view: View) -> Linked:
    """All target points, weighted by nearness."""
    return _shared(state, i, annealed.weights(state)[i])


def bp(state: Any, i: int, view: View) -> Linked:
    """The same, but no target point may belong to two."""
    return _shared(state, i, marginal_matrix(state)[i])


def hypotheses(state: Any, i: int, view: View) -> Linked:
    """The target points that the assignments give it, weighted by how many do."""
    partners = state.assignments[0, :, i]
    n = state.problem.target.shape[1]
    return _shared(state, i, np.bincount(partners[partners >= 0], minlength=n) / len(partners))


def mmd(state: Any, i: int, view: View) -> Linked:
    """One of the waves over which both clouds are averaged. The point has no threads."""
    waves = state.frequencies[0] / state.length[0]
    omega = waves[np.argmax(np.round(np.hypot(*waves.T), 9))]
    length = 2.0 * np.pi / float(np.hypot(*omega))
    along = omega / np.hypot(*omega)
    across = np.array([-along[1], along[0]]) * 20.0
    points = np.arange(-12, 13)[:, None] * length * along
    corner = np.array([view.x1, view.y1])
    near = np.abs(points @ along) < np.abs(along) @ corner
    crests = points[near]
    troughs = crests + 0.5 * length * along
    return Linked(
        (
            Segments(crests - across, crests + across, "guide", weight=np.full(len(crests), 0.67)),
            Segments(troughs - across, troughs + across, "guide", dashed=True, weight=np.full(len(troughs), 0.5)),
            Label((view.x0, view.y0), f"one of {len(waves)} waves", "ink", dx=8.0, dy=-9.0),
        ),
        f"{2 * len(waves)}",
        "means, no link",
    )


LINKS: dict[str, Callable[[Any, int, View], Linked]] = {
    "icp": icp,
    "point-to-plane": plane,
    "gicp": gicp,
    "ransac-congruent": ransac,
    "ndt": ndt,
    "soft-annealed": soft,
    "mmd": mmd,
    "association-bp": bp,
    "hypothesis-mixture": hypotheses,
}
"""What draws the links, by method."""
