"""The marks of a search: the floor of every heading as a ring, that of every place as a field, and in both what was
just ruled out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray, IntArray
from solvers.methods.search.bounds import Boxes
from widgets.drawing.picture import Anchor, Array, Heat, Label, Mark, Path, Points, Ring, Role, Segments, number
from widgets.parts.ring import place

SIZE = 8.4  # u from the centre to the panel's sides
HEADINGS = 256  # places on the ring, a power of two, so that a box fills whole places or is part of one
TILES = 64  # along each side of the field, likewise
INNER, OUTER = 6.5, 7.9  # u from the centre to a floor of zero, and to the ceiling
TICK = (-0.65, 0.3)  # u from the inner circle: visible below the truth too, where the first two arcs meet
ROUND = 6.3  # u, the radius up to which the field is drawn


@dataclass(frozen=True, eq=False)
class Floors:
    """The lowest bound of the remaining boxes at every heading (HEADINGS,) and at every place (TILES, TILES), row 0
    lowest, in u²; infinite where none remains. headings_gone, places_gone: where the last step removed the last box.
    ends: (n,) where the remaining boxes begin and end around the circle, radians in [−π, π)."""

    headings: FloatArray
    places: FloatArray
    headings_gone: BoolArray
    places_gone: BoolArray
    ends: FloatArray

    @property
    def share_gone(self) -> float:
        """The fraction of all headings that are ruled out."""
        return float(np.mean(np.isinf(self.headings)))


def floors(root: Boxes, boxes: Boxes, discarded: Boxes, held: bool) -> Floors:
    """The floors of boxes in world units; `held` if there is only one place."""
    headings = _by_heading(root, boxes)
    headings_gone = np.isfinite(_by_heading(root, discarded)) & np.isinf(headings)
    empty = np.full((TILES, TILES), np.inf)
    ends = _ends(boxes)
    if held:
        return Floors(headings, empty, headings_gone, np.zeros_like(empty, dtype=np.bool_), ends)
    places = _by_place(root, boxes)
    return Floors(headings, places, headings_gone, np.isfinite(_by_place(root, discarded)) & np.isinf(places), ends)


def _span(middle: FloatArray, half: FloatArray, low: float, size: float, count: int) -> tuple[IntArray, IntArray]:
    """The first place and one past the last that each interval touches, of `count` places from `low` on."""
    first = np.floor((middle - half - low) / size * count + 1e-6)
    last = np.ceil((middle + half - low) / size * count - 1e-6)
    return np.clip(first, 0, count - 1).astype(np.int64), np.clip(last, 1, count).astype(np.int64)


def _by_heading(root: Boxes, boxes: Boxes) -> FloatArray:
    low, size = root.middle[0, 0] - root.half[0, 0], 2.0 * root.half[0, 0]
    first, last = _span(boxes.middle[:, 0], boxes.half[:, 0], low, size, HEADINGS)
    values = np.full(HEADINGS, np.inf)
    wide = last - first > 1
    np.minimum.at(values, first[~wide], boxes.bound[~wide])
    for a, b in {*zip(first[wide].tolist(), last[wide].tolist(), strict=True)}:
        values[a:b] = np.minimum(values[a:b], boxes.bound[wide & (first == a) & (last == b)].min())
    return values


def _ends(boxes: Boxes) -> FloatArray:
    """The ends of boxes around the circle, without duplicates and rounded to the borders of the ring's places."""
    middle, half = boxes.middle[:, 0], boxes.half[:, 0]
    indices = np.rint(np.concatenate([middle - half, middle + half]) / (2.0 * np.pi) * HEADINGS).astype(np.int64)
    half_turn = HEADINGS // 2
    borders = np.unique((indices + half_turn) % HEADINGS) - half_turn
    return np.asarray(borders * (2.0 * np.pi / HEADINGS), dtype=np.float64)


def _by_place(root: Boxes, boxes: Boxes) -> FloatArray:
    (x, y), half = root.middle[0, 1:] - root.half[0, 1], boxes.half[:, 1]
    size = 2.0 * float(root.half[0, 1])
    i, u = _span(boxes.middle[:, 1], half, x, size, TILES)
    j, v = _span(boxes.middle[:, 2], half, y, size, TILES)
    values = np.full((TILES, TILES), np.inf)
    wide = (u - i > 1) | (v - j > 1)
    np.minimum.at(values, (j[~wide], i[~wide]), boxes.bound[~wide])
    # Each square of the wide boxes once, with its lowest bound.
    squares = np.stack([i, u, j, v], axis=1)[wide]
    order = np.lexsort((boxes.bound[wide], *squares.T))
    squares, bound = squares[order], boxes.bound[wide][order]
    new = np.ones(len(squares), dtype=np.bool_)
    new[1:] = (squares[1:] != squares[:-1]).any(axis=1)
    for (a, b, c, d), low in zip(squares[new].tolist(), bound[new].tolist(), strict=True):
        values[c:d, a:b] = np.minimum(values[c:d, a:b], low)
    return values


def ring(current: Floors, ceiling: float, before: float) -> tuple[Mark, ...]:
    """A step for every heading: as high as its floor while it is open, up to the ceiling once it is ruled out. A tick
    where an open arc begins or ends, since neighbours' floors may be equal, and are zero at first.

    before: the ceiling before the last step; it scales the ring, so that a falling ceiling is seen to fall.
    """
    closed, new = np.isinf(current.headings), current.headings_gone
    top = INNER + (OUTER - INNER) * ceiling / before
    share = np.clip(np.where(closed, 1.0, current.headings / ceiling), 0.0, 1.0)
    radius = INNER + (top - INNER) * share
    return (
        Ring([0.0, 0.0], "guide", reach=INNER),
        *_steps(radius, closed & ~new, "ghost"),
        *_steps(radius, new, "weak"),
        *_steps(radius, ~closed, "accent"),
        Segments(place(current.ends, INNER + TICK[0]), place(current.ends, INNER + TICK[1]), "accent"),
        *_rims(ceiling, before, top),
    )


def _rims(ceiling: float, before: float, top: float) -> list[Mark]:
    """The ceiling with its value, and that before the last step if it was higher."""
    marks: list[Mark] = [
        Ring([0.0, 0.0], "source", reach=top, dashed=True),
        *_rim_labels("ceiling", ceiling, "source", "start"),
    ]
    if before > ceiling:
        around = place(np.linspace(0.0, 2.0 * np.pi, 129), OUTER)
        marks += [Path(around, "ghost", dotted=True), *_rim_labels("one step ago", before, "ghost", "end")]
    return marks


def _rim_labels(name: str, value: float, role: Role, side: Anchor) -> list[Mark]:
    """A rim's name and value in the upper corner on that side of the panel, which the ring leaves free."""
    sign = 1.0 if side == "start" else -1.0
    corner = [-sign * SIZE, SIZE]
    words = (name, f"{number(value, 4)} u²")
    return [Label(corner, word, role, side, dx=8.0 * sign, dy=20.0 + 18.0 * k) for k, word in enumerate(words)]


def _steps(radius: FloatArray, mask: BoolArray, role: str) -> list[Path]:
    """The runs of headings where `mask` is true, each filled from the inner circle up to its steps."""
    if not mask.any():
        return []
    edges = np.linspace(-np.pi, np.pi, HEADINGS + 1)
    runs = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    paths = []
    for a, b in runs.reshape(-1, 2).tolist():
        around = edges[a : b + 1]
        top = place(np.repeat(around, 2)[1:-1], np.repeat(radius[a:b], 2))
        paths.append(Path(np.concatenate([top, place(around[::-1], INNER)]), role, closed=True, filled=True))  # type: ignore[arg-type]
    return paths


def field(current: Floors, root: Boxes, ceiling: float) -> tuple[Mark, ...]:
    """The open places of the source's centre, strongest where the floor is lowest; dots where the last box went."""
    half = float(root.half[0, 1])
    (x, y), tile = root.middle[0, 1:] - half, 2.0 * half / TILES
    across, up = x + (np.arange(TILES) + 0.5) * tile, y + (np.arange(TILES) + 0.5) * tile
    near = np.hypot(across[None, :], up[:, None]) < ROUND
    visible = near & np.isfinite(current.places)
    strong = np.where(visible, 0.45 - 0.35 * np.clip(current.places / ceiling, 0.0, 1.0), np.nan)
    rows, columns = np.nonzero(near & current.places_gone)
    return (
        Heat(strong, (x, x + 2.0 * half, y, y + 2.0 * half), 0.0, 1.0),
        Points(np.stack([across[columns], up[rows]], axis=1), "weak", radius=1.5),
    )


def pointers(heading: float, at: Array) -> tuple[Mark, ...]:
    """The source's centre, its heading on the ring, and a line at the true heading."""
    spot = place(heading, 0.5 * (INNER + OUTER))
    return (
        Segments(place(0.0, INNER - 0.3), place(0.0, OUTER + 0.25), "truth"),
        Points(spot, "source", radius=6.5),
        Points(at, "source", "cross", radius=6.0),
    )
