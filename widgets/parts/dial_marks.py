"""The marks of a dial: the objective as a ring round the room, the robot and its scan, what links the scan to the
target, and the ball that rolls from the start's heading to the end's."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from solvers import Pose
from solvers.core.arrays import BoolArray
from solvers.geometry import nearest
from solvers.geometry.normals import normals
from solvers.methods.ndt import ndt_map
from solvers.numerics.fourier_features import unit_frequencies
from solvers.numerics.gaussians import share_matrix
from widgets.drawing.picture import (
    Array,
    Arrow,
    Ellipses,
    Group,
    Mark,
    Path,
    Points,
    Ring,
    Role,
    Segments,
    Ticks,
)
from widgets.parts.dial import COARSE, HEADINGS, Course, Dial, headings, starts, valleys
from widgets.parts.ring import place

INNER, OUTER = 5.75, 7.55  # u from the centre to the ring's lowest and highest point
HAND = 8.15  # u to the turning handle, outside the ring
BAND = 5.45  # u to the marks of all starts, inside the ring
TICK = (0.12, 0.42)  # u from the ring's surface to the ends of a valley's tick
BALL = 8.0  # px, the ball's radius
NOSE = 0.9  # u from the robot's centre to its nose
THREADED = 9  # one source point in so many has its soft threads drawn
LINKED = ("pairs", "corrupted", "nearest", "surface", "soft")  # rungs that join points of the source to the target


def heights(dial: Dial, full: bool) -> Array:
    """The ring's radius at the headings of a level, the lowest at `INNER` and the highest at `OUTER`."""
    values = dial.ring if full else dial.coarse
    low, high = float(values.min()), float(values.max())
    share = (values - low) / (high - low) if high - low > 1e-9 * max(1.0, abs(high)) else np.zeros_like(values)
    return np.asarray(INNER + (OUTER - INNER) * share)


def at(dial: Dial, full: bool, turn: Array) -> Array:
    """The points (k, 2) of the ring's surface at headings (k,)."""
    turns = headings()[:: 1 if full else COARSE]
    return place(turn, np.interp(turn, turns, heights(dial, full), period=2.0 * np.pi))


def ring(dial: Dial, full: bool) -> tuple[Mark, ...]:
    """The objective's profile, filled down to a circle, and a line at the truth."""
    turns, radii = headings()[:: 1 if full else COARSE], heights(dial, full)
    top = len(turns) // 2  # from the truth round to the truth, so that the seam is where the ring is thinnest
    turns, radii = np.roll(turns, -top), np.roll(radii, -top)
    outside = place(np.append(turns, turns[0]), np.append(radii, radii[0]))
    circle = np.linspace(0.0, -2.0 * np.pi, 91)
    return (
        Path(np.concatenate([outside, place(circle, INNER)]), "accent", closed=True, filled=True),
        Segments(place(0.0, INNER - 0.35), place(0.0, OUTER + 0.1), "truth"),
    )


def valley_ticks(dial: Dial) -> Segments:
    """A tick outside the full ring at each of its valleys, so that ripples too flat to be seen can be counted."""
    rows = valleys(dial.ring)
    turns, radii = headings()[rows], heights(dial, True)[rows]
    return Segments(place(turns, radii + TICK[0]), place(turns, radii + TICK[1]), "ink")


def room(dial: Dial) -> tuple[Mark, ...]:
    """What does not move: the room at the true pose, and the target."""
    clouds = dial.clouds
    return (
        *(Path(line, "truth", thick=True) for line in clouds.scene.outline),
        Points(clouds.target, "target", "square", radius=2.5),
    )


def scan(dial: Dial, pose: Pose) -> Group:
    """The robot's scan and the robot at its centre, as the group 'source'."""
    clouds = dial.clouds
    body = np.array([[0.0, NOSE], [0.42, -0.5], [-0.42, -0.5]])
    return Group(
        "source",
        (
            *(Path(pose.apply(line), "source", weight=0.6) for line in clouds.scene.outline),
            Points(pose.apply(clouds.source), "source", radius=2.5),
            Path(pose.apply(body), "source", closed=True, filled=True),
        ),
    )


def ball(dial: Dial, full: bool, heading: float, course: Course | None) -> tuple[Mark, ...]:
    """The ball at the start; after the run, at the end, with its path along the ring. There it has the truth's colour
    if the run ended at the truth, else it is hollow, since a robot with the right heading may be in the wrong place.
    A method that searches does not roll: a dotted line joins start and end."""
    begin = at(dial, full, np.array([heading]))
    if course is None:
        return (*_ball(begin), Segments(place(heading, NOSE), place(heading, HAND), "guide"))
    end = at(dial, full, course.headings[-1:])
    marks: list[Mark] = [Segments(place(heading, NOSE), place(heading, HAND), "guide", dashed=True)]
    if dial.rung.searches or dial.rung.flat or len(course.headings) < 3:
        marks.append(Path(np.concatenate([begin, end]), "ghost", dotted=True))
    else:
        marks.append(Path(at(dial, full, _between(course.headings)), "source", thick=True))
    ball = _ball(end, "truth") if course.arrived else (Points(end, "source", "ring", radius=BALL),)
    return (*marks, Points(begin, "ghost", "ring", radius=7.0), *ball)


def _ball(spot: Array, role: Role = "source") -> tuple[Mark, ...]:
    return (Points(spot, role, radius=BALL - 1.0), Points(spot, role, "ring", radius=BALL))


def _between(turns: Array, step: float = 2.0 * np.pi / HEADINGS) -> Array:
    """The headings on the shorter way from each of `turns` to the next, at most a step apart."""
    along = np.unwrap(turns)
    parts = [np.linspace(a, b, max(2, int(np.ceil(abs(b - a) / step)) + 1)) for a, b in pairwise(along.tolist())]
    angles = np.concatenate(parts)
    return np.asarray((angles + np.pi) % (2.0 * np.pi) - np.pi)


def arrivals(arrived: BoolArray) -> tuple[Mark, ...]:
    """For each start that has been run, a square if it ends at the truth, else a small cross."""
    spots = place(starts()[: len(arrived)], BAND)
    return (
        Points(spots[~arrived], "weak", "cross", radius=3.0),
        Points(spots[arrived], "truth", "square", radius=4.0),
    )


# What links the clouds


def links(dial: Dial, pose: Pose, course: Course | None = None) -> tuple[Mark, ...]:
    """What takes the place of matches on this rung, with the source at a pose."""
    clouds = dial.clouds
    moved, target = pose.apply(clouds.source), clouds.target
    if dial.rung.paired:
        wrong = clouds.wrong
        return (
            Segments(moved[~wrong], target[~wrong], "pair", weight=np.full(int((~wrong).sum()), 0.5)),
            Segments(moved[wrong], target[wrong], "outlier", dashed=True),
        )
    return {
        "nearest": _nearest,
        "surface": _surface,
        "cells": _cells,
        "soft": _soft,
        "means": _waves,
        "flow": _flow,
    }[dial.rung.name](dial, moved, course)


def partners(moved: Array, target: Array) -> tuple[Array, Array]:
    """The row of the nearest target point of each moved point, and its distance."""
    rows, squares = nearest.build(target[None]).nearest(moved[None])
    return np.asarray(rows[0]), np.sqrt(squares[0])


def _nearest(dial: Dial, moved: Array, course: Course | None) -> tuple[Mark, ...]:
    rows, distances = partners(moved, dial.clouds.target)
    partner, far = dial.clouds.target[rows], distances > dial.length
    return (
        Segments(moved[~far], partner[~far], "pair"),
        Segments(moved[far], partner[far], "outlier", dashed=True),
    )


def _surface(dial: Dial, moved: Array, course: Course | None) -> tuple[Mark, ...]:
    """The foot of each moved point on the tangent at its nearest target point, and the target's normals."""
    target = dial.clouds.target
    vectors = normals(nearest.build(target[None]), 8).vectors[0]
    rows, _ = partners(moved, target)
    offsets = ((moved - target[rows]) * vectors[rows]).sum(axis=1, keepdims=True)
    return (Segments(moved, moved - offsets * vectors[rows], "pair"), Ticks(target, vectors, "normal", 12.0))


def _cells(dial: Dial, moved: Array, course: Course | None) -> tuple[Mark, ...]:
    """The Gaussians of the coarser map's first grid."""
    cells = ndt_map.build(dial.clouds.target[None], dial.length)
    mask = cells.kept[0]
    return (Ellipses(cells.mean[0][mask], cells.covariance[0][mask], "target", sigmas=2.0, filled=True),)


def _soft(dial: Dial, moved: Array, course: Course | None) -> tuple[Mark, ...]:
    """Threads from a few source points to all target points; the larger a share at the first σ, the stronger."""
    target, source = dial.clouds.target, moved[::THREADED]
    shares = share_matrix(source, target, dial.length, 1e-12)
    i, j = np.nonzero(np.round(shares, 9) >= 0.004)
    strength = np.sqrt(shares[i, j] / shares.max())
    return (Segments(source[i], target[j], "pair", weight=0.6 * strength),)


def _waves(dial: Dial, moved: Array, course: Course | None) -> tuple[Mark, ...]:
    """The crests of one of the waves, as far as the ring."""
    frequency = unit_frequencies(np.array([dial.seed]), 1, 2)[0, 0] / dial.length
    size = float(np.hypot(*frequency))
    along = frequency / size
    gap, reach = 2.0 * np.pi / size, INNER - 0.5
    k = np.arange(np.ceil(-reach / gap), np.floor(reach / gap) + 1) * gap
    half = np.sqrt(reach**2 - k**2)[:, None] * np.array([-along[1], along[0]])
    return (Segments(k[:, None] * along - half, k[:, None] * along + half, "guide"),)


def _flow(dial: Dial, moved: Array, course: Course | None) -> tuple[Mark, ...]:
    """After the run, arrows from where some of the points began to where they ended."""
    if course is None:
        return ()
    ends = course.pose.apply(dial.clouds.source)
    begins = Pose.from_angle(float(course.headings[0])).apply(dial.clouds.source)
    return tuple(Arrow(a, b, "guide", head=6.0) for a, b in zip(begins[::THREADED], ends[::THREADED], strict=True))


def rim() -> Mark:
    """The circle on which a flat ring lies."""
    return Ring([0.0, 0.0], "guide", reach=INNER)
