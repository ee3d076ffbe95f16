"""Presses and choices in a figure do not move the page below it: words appear in space reserved for them."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure

pytestmark = pytest.mark.browser

SIZES = [(1280, 1000), (1024, 768), (390, 844)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    ("page", "name", "buttons", "values"),
    [
        ("four.html", "fig-four", ("stage-2", "finish"), {}),
        ("uncertainty.html", "fig-room", ("more", "finish"), {}),
        ("uncertainty.html", "fig-hall", ("finish",), {}),
        ("surfaces.html", "fig-three", ("finish",), {}),
        ("soft.html", "fig-soft", ("step", "finish"), {"method": "gmmreg"}),
    ],
)
def test_a_figure_keeps_its_height(
    reader: Callable[..., Reader],
    size: tuple[int, int],
    page: str,
    name: str,
    buttons: tuple[str, ...],
    values: dict[str, str],
) -> None:
    """With *More* open: initially, after each choice and after each press."""
    figure = Figure(reader(*size, reduced_motion="reduce").open(page), name).live()
    figure.root.locator("details.figure-rest > summary").click()
    heights = [_height(figure)]
    for control, value in values.items():
        figure.set(control, value)
        heights.append(_height(figure))
    for button in buttons:
        figure.button(button).click()
        heights.append(_height(figure))
    assert len(set(heights)) == 1, f"{name} at {size[0]} px is {heights} px tall"


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    ("page", "name", "button"),
    [("search.html", "fig-turns", "run"), ("mmd.html", "fig-waves", "run"), ("clouds.html", "fig-own", "finish")],
)
def test_a_button_that_runs_stays_as_wide(
    reader: Callable[..., Reader], size: tuple[int, int], page: str, name: str, button: str
) -> None:
    """*Pause* is as wide as what it stands for: no button beside it moves, nor to another line."""
    figure = Figure(reader(*size, reduced_motion="reduce").open(page), name).live()
    before = _buttons(figure)
    figure.button(button).click()
    expect(figure.button(button)).to_have_text("Pause")
    assert _buttons(figure) == before
    text = "e => { const all = new Range(); all.selectNodeContents(e); return all.getBoundingClientRect().width; }"
    assert figure.button(button).evaluate(text) < figure.button(button).evaluate("e => e.clientWidth") - 2


def _buttons(figure: Figure) -> list[list[float]]:
    """Where the buttons are in their row, and how wide."""
    return figure.root.locator(".figure-desk .buttons button").evaluate_all(  # type: ignore[no-any-return]
        "all => all.map((e) => [e.offsetLeft - all[0].offsetLeft, e.offsetTop - all[0].offsetTop, e.offsetWidth])"
    )


def _height(figure: Figure) -> int:
    box = figure.settled().root.bounding_box()
    assert box is not None
    return round(box["height"])
