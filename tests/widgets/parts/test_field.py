"""A field computed level by level: the same whatever was requested before, and nothing computed twice."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.drawing.picture import Array, Heat, Label, Path, View
from widgets.parts.field import PAD, STRIDE, Field, scale_marks

WINDOW = (-1.0, 2.0, 0.0, 3.0)
SHAPES = pytest.mark.parametrize(("side", "bands"), [(63, 4), (9, 1), (9, 3), (12, 5), (60, 7)])


def bumps(x: Array, y: Array) -> Array:
    return np.asarray(np.sin(3 * x)[None, :] * np.cos(2 * y)[:, None] + x[None, :])


def field_and_calls(side: int, bands: int) -> tuple[Field, list[int]]:
    """A field over `bumps`, and the list of how many places each call computed."""
    calls: list[int] = []

    def of(x: Array, y: Array) -> Array:
        calls.append(len(x) * len(y))
        return bumps(x, y)

    return Field(of, WINDOW, side, bands), calls


@SHAPES
def test_the_finest_level_is_the_field_and_no_place_is_computed_twice(side: int, bands: int) -> None:
    """All levels together compute side × side places, and the last equals one call for all of them."""
    field, calls = field_and_calls(side, bands)
    for level in range(bands + 1):
        field.values(level)
        assert field.known == level
    np.testing.assert_allclose(field.values(bands), bumps(field.x, field.y), rtol=0, atol=0)
    assert sum(calls) == side**2
    assert calls[0] == (side // STRIDE) ** 2


@SHAPES
def test_no_level_costs_much_more_than_its_share(side: int, bands: int) -> None:
    """The bands differ by at most one coarse row, so that no slice keeps a reader waiting."""
    field, calls = field_and_calls(side, bands)
    field.values(0)
    costs = []
    for level in range(1, bands + 1):
        calls.clear()
        field.values(level)
        costs.append(sum(calls))
    assert max(costs) - min(costs) <= 8 * (side // STRIDE)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 4), min_size=1, max_size=6))
def test_a_level_does_not_depend_on_what_was_asked_before(levels: list[int]) -> None:
    """Whatever the order of requests, each level's values and highest place are those of a fresh field."""
    field, _ = field_and_calls(63, 4)
    for level in levels:
        fresh, _ = field_and_calls(63, 4)
        np.testing.assert_array_equal(field.values(level), fresh.values(level))
        point, value = field.highest(level)
        np.testing.assert_array_equal(point, fresh.highest(level)[0])
        assert value == field.values(level).max()
        assert value == pytest.approx(float(bumps(point[:1], point[1:])[0, 0]), abs=1e-15)


def test_levels_get_finer_from_the_top() -> None:
    """At level 1 of 3 the top third has the full lattice; the rest has three-by-three tiles of the coarse one."""
    field, _ = field_and_calls(9, 3)
    whole, coarse = bumps(field.x, field.y), field.values(1)
    np.testing.assert_array_equal(coarse[6:], whole[6:])
    np.testing.assert_array_equal(coarse[:6], whole[1:6:3, 1::3].repeat(3, axis=0).repeat(3, axis=1))


def test_tiles_fill_the_window() -> None:
    """The places are the tiles' centres, half a tile from the window's border."""
    field, _ = field_and_calls(12, 2)
    np.testing.assert_allclose(field.x[[0, -1]], [-1 + 0.125, 2 - 0.125])
    assert isinstance(field.heat(0, 0.0, 1.0), Heat)
    assert field.heat(2, 0.0, 1.0).window == WINDOW


def test_a_side_that_does_not_divide_is_refused() -> None:
    with pytest.raises(ValueError, match="side: expected a multiple of 3, got 64"):
        Field(bumps, WINDOW, side=64)


def test_the_scale_stands_beside_the_window_and_numbers_its_ends() -> None:
    """The bar is in the padding at the right, as high as the window and in a frame, and its numbers, at their heights
    beside it, include both ends."""
    view = View(*WINDOW, width=400.0, pad=PAD)
    bar, frame, *labels = scale_marks(view, (0.0, 0.4), "score")
    assert isinstance(bar, Heat)
    left, right, low, high = bar.window
    assert isinstance(frame, Path)
    assert {tuple(corner) for corner in np.asarray(frame.xy)} == {(x, y) for x in (left, right) for y in (low, high)}
    places = [label.xy for label in labels if isinstance(label, Label)]
    np.testing.assert_allclose(places, [(right, y) for y in (0.0, 0.75, 1.5, 2.25, 3.0, 3.0)])
    assert view.x1 < left < right
    assert (low, high) == (0.0, 3.0)
    assert view.px([[right, low]])[0, 0] < 400
    assert [getattr(label, "text", "") for label in labels] == ["0.0", "0.1", "0.2", "0.3", "0.4", "score"]


def test_strong_may_be_low() -> None:
    """With low values strong, the strongest colours become the faintest, on the field and on its scale."""
    field, _ = field_and_calls(63, 4)
    high, low = (field.heat(4, -1.0, 3.0, deep) for deep in ("high", "low"))
    part = [(np.asarray(mark.values) - mark.low) / (mark.high - mark.low) for mark in (high, low)]
    np.testing.assert_allclose(part[0] + part[1], 1.0)
    view = View(*WINDOW, width=300.0, pad=PAD)
    bars = [scale_marks(view, (-1.0, 3.0), "value", strong=strong)[0] for strong in ("high", "low")]
    assert all(isinstance(bar, Heat) for bar in bars)
    np.testing.assert_allclose(*[np.asarray(bar.values)[:: 1 if k else -1] for k, bar in enumerate(bars)])  # type: ignore[union-attr]


def test_roots_and_their_scale_agree() -> None:
    """A value's colour step, by its root, and its number's height beside the bar are the same fraction of the whole."""
    field = Field(lambda x, y: np.outer(y, np.ones_like(x)) - 0.5, WINDOW, 9, 1)
    mark = field.roots(1, 4.0)
    np.testing.assert_allclose(np.asarray(mark.values), np.sqrt(np.fmax(field.values(1), 0.0)))
    assert (mark.low, mark.high) == (0.0, 2.0)
    assert field.roots(1, 4.0) is mark
    assert field.heat(1, 0.0, 4.0) is not mark
    view = View(0.0, 1.0, 0.0, 2.0, pad=PAD)
    labels = [mark for mark in scale_marks(view, (0.0, 4.0), "n", 0, roots=True) if isinstance(mark, Label)]
    heights = {label.text: float(np.asarray(label.xy)[1]) for label in labels if label.text != "n"}
    assert heights["4"] == 2.0
    assert heights["1"] == 1.0
    assert heights["0"] == 0.0
