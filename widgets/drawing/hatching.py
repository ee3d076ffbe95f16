"""Hatching distinguishes the areas of a map without colour, for colour-blind readers and in print.

A line runs along the tiles' borders or from corner to corner through them, so that it ends where its area does.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from widgets.drawing.picture import Role

EVERY = 2  # tiles from one line to the next
LINES: dict[Role, tuple[str, ...]] = {
    "end-turned": ("rising",),
    "end-quarter": ("falling",),
    "end-half": ("rising", "falling"),
    "end-none": ("upright",),
}
"""The lines of each role that has any: the truth and `end-shifted` have none."""

Line = tuple[int, int, int, int]


def hatched(inside: NDArray[np.bool_], role: Role) -> list[Line]:
    """The lines over the tiles (rows, columns) of a role: column and row of both ends, counted in tile borders."""
    lines: list[Line] = []
    for way in LINES.get(role, ()):
        lines += {"rising": _rising, "falling": _falling, "upright": _upright}[way](inside)
    return lines


def _rising(inside: NDArray[np.bool_]) -> list[Line]:
    """Lines from lower left to upper right, row 0 being the lowest."""
    rows, columns = inside.shape
    lines = []
    for k in range(-(rows - 1) // EVERY * EVERY, columns, EVERY):  # the column in which the diagonal meets row 0
        low = max(0, -k)
        for first, last in _runs(np.diagonal(inside, k)):
            lines.append((k + low + first, low + first, k + low + last, low + last))
    return lines


def _falling(inside: NDArray[np.bool_]) -> list[Line]:
    columns = inside.shape[1]
    return [(columns - i, j, columns - u, v) for i, j, u, v in _rising(inside[:, ::-1])]


def _upright(inside: NDArray[np.bool_]) -> list[Line]:
    return [(i, j, i, v) for i in range(0, inside.shape[1], EVERY) for j, v in _runs(inside[:, i])]


def _runs(row: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """First and one past the last of each run of true values."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], row, [False]]).astype(np.int8)))
    return zip(change[::2].tolist(), change[1::2].tolist(), strict=True)
