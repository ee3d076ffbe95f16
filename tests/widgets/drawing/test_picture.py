"""How numbers are formatted, and where arrow keys move a handle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from widgets.drawing.picture import View, degrees, move_keys, number, slide_keys, small, turn_keys, worded


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (1.005, 1, "1.0"),
        (-0.001, 2, "0.00"),
        (-0.0, 0, "0"),
        (-3.25, 1, "−3.2"),
        (0.125, 2, "0.13"),
        (0.125 - 1e-14, 2, "0.13"),
        (1e6, 0, "1000000"),
    ],
)
def test_a_number_is_rounded_alike_on_every_machine(value: float, decimals: int, text: str) -> None:
    assert number(value, decimals) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.25, "1.250"),
        (0.001, "0.001"),
        (3.2e-5, "3·10⁻⁵"),
        (4e-16, "< 10⁻¹²"),
        (0.0, "< 10⁻¹²"),
        (9.9e-4, "1·10⁻³"),
    ],
)
def test_a_small_number_keeps_its_magnitude(value: float, text: str) -> None:
    assert small(value) == text


@pytest.mark.parametrize(
    ("words", "text"),
    [
        ("every pair's weight is zero", "every pair’s weight is zero"),
        ("moved by -1.5 and -0.000", "moved by −1.5 and 0.000"),
        ("point-to-plane: expected 'x'", "point-to-plane: expected 'x'"),
    ],
)
def test_a_solvers_words_are_as_the_site_prints_them(words: str, text: str) -> None:
    assert worded(words) == text


@pytest.mark.parametrize(
    ("angle", "text"),
    [(0, "0"), (-25, "−25"), (180, "180"), (-180, "180"), (-180 - 1e-12, "180"), (359.9999999999, "0"), (270, "−90")],
)
def test_degrees_of_half_a_turn_have_one_name(angle: float, text: str) -> None:
    assert degrees(np.radians(angle)) == text


@settings(deadline=None)
@given(st.floats(-5, 5), st.floats(-5, 5))
def test_arrow_keys_move_the_way_they_point(x: float, y: float) -> None:
    keys = move_keys(x, y)
    assert len(keys) == 8
    assert keys["ArrowLeft"][0] < x < keys["ArrowRight"][0]
    assert keys["ArrowDown"][1] < y < keys["ArrowUp"][1]
    assert keys["Shift+ArrowLeft"][0] < keys["ArrowLeft"][0]
    ways = {"Left": (-1, 0), "Right": (1, 0), "Up": (0, 1), "Down": (0, -1)}
    for prefix, size in (("", 0.1), ("Shift+", 0.7)):
        for way, direction in ways.items():
            moved = np.subtract(move_keys(x, y, 0.1, 0.7)[f"{prefix}Arrow{way}"], (x, y))
            np.testing.assert_allclose(moved, np.multiply(direction, size), atol=1e-12)


@given(st.floats(-3, 3))
def test_slide_keys_take_one_step_or_five_and_stop_at_the_ends(x: float) -> None:
    keys = slide_keys(x, 0.4, -3.0, 3.0, 0.2)
    for prefix, size in (("", 0.2), ("Shift+", 1.0)):
        for way, sign in (("Left", -1), ("Down", -1), ("Right", 1), ("Up", 1)):
            assert keys[f"{prefix}Arrow{way}"] == (pytest.approx(np.clip(x + sign * size, -3.0, 3.0)), 0.4)


def test_turn_keys_keep_the_reach_and_turn_one_degree() -> None:
    keys = turn_keys((1.0, 2.0), 3.0, 0.5)
    for key, angle in {"ArrowLeft": 1, "ArrowUp": 1, "ArrowRight": -1, "Shift+ArrowDown": -15}.items():
        dx, dy = np.subtract(keys[key], (1.0, 2.0))
        assert np.hypot(dx, dy) == pytest.approx(3.0)
        assert np.degrees(np.arctan2(dy, dx) - 0.5) == pytest.approx(angle)


def test_equal_scales_give_the_height() -> None:
    view = View(-6, 6, -4, 4, width=660, pad=(10, 20, 10, 30))
    width, height = view.size
    assert (width, height) == pytest.approx((660, 8 * 640 / 12 + 50))
    np.testing.assert_allclose(view.px([[-6, 4], [6, -4]]), [[10, 20], [650, height - 30]])
    assert view.scale == pytest.approx(640 / 12)
