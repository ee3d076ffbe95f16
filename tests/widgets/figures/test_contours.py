"""Contour lines of fields whose contours are known."""

from __future__ import annotations

import numpy as np
import pytest

from widgets.drawing.picture import Array
from widgets.figures.landscape.contours import contours
from widgets.figures.landscape.terrain import minima, places
from widgets.parts.field import within

X, Y = np.linspace(-1.0, 1.0, 81), np.linspace(-1.2, 1.2, 97)


def test_the_contours_of_a_bowl_are_circles() -> None:
    """Every end lies on the circle to second order in the lattice spacing, and the pieces add up to its length."""
    bowl = np.hypot(X[None, :], Y[:, None])
    for radius in (0.3, 0.85):
        a, b = contours(bowl, X, Y, [radius])
        np.testing.assert_allclose(np.hypot(*np.concatenate([a, b]).T), radius, atol=1e-3)
        assert np.hypot(*(b - a).T).sum() == pytest.approx(2 * np.pi * radius, rel=2e-3)


def test_lines_are_closed_or_end_at_the_border(rng_field: Array) -> None:
    """Each end not at the border belongs to exactly two pieces, even where lines nearly cross."""
    a, b = contours(rng_field, X, Y, [0.0, 0.4])
    ends, count = np.unique(np.round(np.concatenate([a, b]), 9), axis=0, return_counts=True)
    border = (np.abs(ends[:, 0]) > 1.0 - 1e-9) | (np.abs(ends[:, 1]) > 1.2 - 1e-9)
    assert len(a) > 500
    assert (count[~border] == 2).all()


def test_the_pieces_of_a_line_are_in_a_row(rng_field: Array) -> None:
    """The pieces of a line follow each other, with higher ground to the right, until it closes or meets the border; no
    other line continues it."""
    bowl = np.hypot(X[None, :], Y[:, None])
    a, b = contours(bowl, X, Y, [0.3, 0.85])
    assert np.count_nonzero(np.any(b[:-1] != a[1:], axis=1)) == 1
    a, b = contours(rng_field, X, Y, [0.4])
    breaks = np.flatnonzero(np.any(b[:-1] != a[1:], axis=1)) + 1
    lines = np.split(np.arange(len(a)), breaks)
    assert 10 < len(lines) < len(a) / 5
    for line in lines:
        begin, end = a[line[0]], b[line[-1]]
        at_border = [np.any(np.abs(point) >= (1.0, 1.2)) for point in (begin, end)]
        assert np.array_equal(begin, end) or all(at_border)
    along, middle = b - a, (a + b) / 2
    right = 1e-6 * np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    assert (bilinear(rng_field, middle + right) > bilinear(rng_field, middle - right)).all()


def bilinear(values: Array, points: Array) -> Array:
    """The field at points, interpolated from the four surrounding nodes."""
    i, j = np.searchsorted(Y, points[:, 1]) - 1, np.searchsorted(X, points[:, 0]) - 1
    u, v = (points[:, 0] - X[j]) / (X[1] - X[0]), (points[:, 1] - Y[i]) / (Y[1] - Y[0])
    low, high = ((1 - u) * values[k, j] + u * values[k, j + 1] for k in (i, i + 1))
    return np.asarray((1 - v) * low + v * high)


@pytest.fixture
def rng_field() -> Array:
    """Independent noise at every node: saddles everywhere."""
    return np.asarray(np.random.default_rng(3).standard_normal((len(Y), len(X))))


def test_a_flat_field_has_no_contours() -> None:
    a, b = contours(np.zeros((5, 5)), np.arange(5.0), np.arange(5.0), [0.0, 1.0])
    assert len(a) == len(b) == 0


def test_minima_are_nodes_below_all_about_them() -> None:
    """Two pits give two minima; neither the lowest value at a border nor a valley's flat floor counts."""
    field = np.minimum(np.hypot(X[None, :] - 0.5, Y[:, None]), np.hypot(X[None, :] + 0.4, Y[:, None] - 0.3) + 0.1)
    assert minima(field) == 2
    assert minima(np.broadcast_to(X, (9, 81))) == 0
    assert minima(np.broadcast_to(np.abs(X), (9, 81))) == 0


def test_places_take_neighbours_together() -> None:
    ends = np.array([[0.0, 0.0], [0.05, 0.0], [1.0, 1.0], [0.0, 0.11]])
    assert places(ends, 0.1) == 3
    assert places(ends[:0], 0.1) == 0


def test_a_line_is_cut_at_the_window() -> None:
    """A line that leaves the window and comes back makes two parts, each up to the border; a line outside, or a point,
    makes none. Random walks lose no node inside the window, no piece has zero length, and parts end at the border or at
    an end of the walk."""
    window = (-1.0, 1.0, -1.0, 1.0)
    way = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 0.5], [0.0, 0.5], [0.0, 0.75]])
    first, second = within(way, window)
    np.testing.assert_allclose(first, [[0.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(second, [[1.0, 0.5], [0.0, 0.5], [0.0, 0.75]])
    assert within(way + 3.0, window) == []
    assert within(way[:1], window) == []
    assert within(np.array([[0.0, 2.0], [2.0, 0.0]]), window) == []  # it only touches a corner
    (line,) = within(way * 0.4, window)
    np.testing.assert_allclose(line, way * 0.4)
    rng, count = np.random.default_rng(1), 0
    for _ in range(50):
        walk = np.cumsum(rng.standard_normal((20, 2)), axis=0)
        parts = within(walk, window)
        for part in parts:
            assert (np.abs(part) <= 1.0 + 1e-12).all()
            assert np.hypot(*np.diff(part, axis=0).T).min() > 0.0
            for end, own in ((part[0], walk[0]), (part[-1], walk[-1])):
                assert np.array_equal(end, own) or np.abs(end).max() == pytest.approx(1.0, abs=1e-12)
        inside = walk[(np.abs(walk) < 1.0).all(axis=1)]
        points = np.concatenate([np.zeros((0, 2)), *parts])
        assert (inside[:, None] == points).all(axis=2).any(axis=1).all()
        count += len(parts)
    assert count > 50
