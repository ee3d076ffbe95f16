"""Contour lines of a field on a lattice: a piece for each tile that a line crosses, in order along each line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from solvers.core.arrays import IntArray
from widgets.drawing.picture import Array

# The sides of a tile that a line joins, by the sum over its corners above the level: 1 lower left, 2 lower right,
# 4 upper right, 8 upper left. Sides: 0 below, 1 right, 2 above, 3 left. The higher corners are to a line's right.
_JOINS: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((3, 0),), 2: ((0, 1),), 3: ((3, 1),), 4: ((1, 2),), 6: ((0, 2),), 7: ((3, 2),), 8: ((2, 3),), 9: ((2, 0),),
    11: ((2, 1),), 12: ((1, 3),), 13: ((1, 0),), 14: ((0, 3),),
    5: ((3, 0), (1, 2)), 10: ((0, 1), (2, 3)),  # two opposite corners above the level, the centre below it
    21: ((3, 2), (1, 0)), 26: ((0, 3), (2, 1)),  # the same, with the centre above it
}  # fmt: skip
_NONE = (-1, -1)
_FIRST, _SECOND = (np.array([(*_JOINS.get(code, ()), _NONE, _NONE)[k] for code in range(27)]) for k in range(2))


def contours(values: Array, x: Array, y: Array, levels: Sequence[float]) -> tuple[Array, Array]:
    """Both ends (k, 2) of the pieces of all lines on which a field has one of `levels`, in order along each line.

    values: (len(y), len(x)) at the lattice's nodes, finite; linear between neighbouring nodes. In a tile with two
    opposite corners above the level, its centre, the mean of the four corners, decides which of them are joined.
    """
    ends: list[tuple[Array, Array]] = [(np.zeros((0, 2)), np.zeros((0, 2)))]
    corners = np.stack([values[:-1, :-1], values[:-1, 1:], values[1:, 1:], values[1:, :-1]])
    for level in levels:
        code = ((corners > level) * np.array([1, 2, 4, 8])[:, None, None]).sum(axis=0)
        rows, columns = np.nonzero((code > 0) & (code < 15))
        at, code = corners[:, rows, columns], code[rows, columns]
        code = np.where(((code == 5) | (code == 10)) & (at.mean(axis=0) > level), code + 16, code)
        tiles = np.concatenate([np.arange(len(code)), np.flatnonzero(_SECOND[code, 0] >= 0)])
        begins, stops = np.concatenate([_FIRST[code], _SECOND[code[tiles[len(code) :]]]]).T
        edges = _edges(rows, columns, values.shape)
        order = _in_order(edges[begins, tiles].tolist(), edges[stops, tiles].tolist())
        tiles, begins, stops = tiles[order], begins[order], stops[order]
        sides = np.stack(_crossings(at, x, y, rows, columns, level))
        ends.append((sides[begins, tiles], sides[stops, tiles]))
    return np.concatenate([a for a, _ in ends]), np.concatenate([b for _, b in ends])


def _edges(rows: IntArray, columns: IntArray, shape: tuple[int, ...]) -> IntArray:
    """The index of the lattice's edge at each side (4, k) of tiles: neighbouring tiles share an edge."""
    below, left = rows * shape[1] + columns, rows * shape[1] + columns + shape[0] * shape[1]
    return np.stack([below, left + 1, below + shape[1], left])


def _in_order(begins: list[int], stops: list[int]) -> list[int]:
    """The order of the pieces in which each is followed by the one that begins where it stops: lines that end at the
    border start with their first piece, closed ones with any."""
    at, inner = dict(zip(begins, range(len(begins)), strict=True)), set(stops)
    order: list[int] = []
    for edge in [*(edge for edge in begins if edge not in inner), *begins]:
        while edge in at:
            piece = at.pop(edge)
            order.append(piece)
            edge = stops[piece]
    return order


def _crossings(at: Array, x: Array, y: Array, rows: IntArray, columns: IntArray, level: float) -> list[Array]:
    """Where the field crosses the level on each side of the tiles with corner values (4, k), as arrays (k, 2); an
    arbitrary point of a side that it does not cross."""
    left, right, lower, upper = x[columns], x[columns + 1], y[rows], y[rows + 1]
    corners = [np.stack(corner, axis=1) for corner in ((left, lower), (right, lower), (right, upper), (left, upper))]
    sides = []
    for i, j in ((0, 1), (1, 2), (3, 2), (0, 3)):
        rise = at[j] - at[i]
        part = np.clip((level - at[i]) / np.where(rise == 0.0, 1.0, rise), 0.0, 1.0)
        sides.append(corners[i] + part[:, None] * (corners[j] - corners[i]))
    return sides
