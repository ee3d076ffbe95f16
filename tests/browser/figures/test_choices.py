"""Options that set other controls: a choice says when those have been moved since, and a click sets them again."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure

NOTE = ".control-adjusted"
PLACE = "e => { const { x, y } = e.getBoundingClientRect(); return [x + scrollX, y + scrollY]; }"


@pytest.mark.parametrize(("page", "name"), [("icp", "fig-nearest"), ("race", "fig-race")])  # a list, and radio buttons
def test_a_choice_says_that_what_it_set_was_moved(reader: Callable[..., Reader], page: str, name: str) -> None:
    """And no longer says so once it is moved back; nothing else moves meanwhile."""
    figure = Figure(reader(reduced_motion="reduce").open(f"{page}.html"), name).live()
    slider = figure.control("noise")
    room = figure.root.locator(f'.control:has([name="{"scene" if page == "icp" else "setting"}"])')
    expect(room.locator(NOTE)).to_be_hidden()
    figure.settled()
    own, top = slider.input_value(), slider.evaluate(PLACE)
    for value in ("0.15", own):
        figure.set("noise", value)
        expect(room.locator(NOTE)).to_be_visible(visible=value != own)
        assert slider.evaluate(PLACE) == top


@pytest.mark.parametrize("target", ["icp#fig-nearest", "surfaces#fig-look", "surfaces#fig-three", "clouds#fig-own"])
def test_a_start_says_that_a_handle_was_dragged(reader: Callable[..., Reader], target: str) -> None:
    """Until it is chosen again, which puts the source back."""
    page, _, name = target.partition("#")
    figure = Figure(reader(reduced_motion="reduce").open(f"{page}.html"), name).live()
    figure.root.locator(".figure-rest > summary").click()
    start = figure.root.locator('.control:has([name="start"])')
    record = figure.settled().record()
    expect(start.locator(NOTE)).to_be_hidden()
    figure.root.locator(".handle").first.press("ArrowRight")
    expect(start.locator(NOTE)).to_be_visible()
    figure.settled()
    expect(start.locator(NOTE)).to_be_visible()
    start.locator("label:has(:checked)").click()
    expect(start.locator(NOTE)).to_be_hidden()
    assert figure.settled().record() == record


def test_a_slider_is_called_what_it_stands_for(reader: Callable[..., Reader]) -> None:
    """It changes with the chosen option, at once and from the tape too."""
    figure = Figure(reader(reduced_motion="reduce").open("icp.html"), "fig-dial-nearest").live()
    label = figure.root.locator('.control:has([name="length"]) .control-label')
    expect(label).to_have_text("Cap τ")
    figure.root.locator(".figure-rest > summary").click()
    for rung, name in (("cells", "Cell size h"), ("surface", "Length scale (unused)"), ("nearest", "Cap τ")):
        figure.root.locator('[name="rung"]').select_option(rung)
        expect(label).to_have_text(name)


@pytest.mark.parametrize("way", ["pointer", "key"])
def test_the_chosen_option_sets_its_values_again(reader: Callable[..., Reader], way: str) -> None:
    """Without choosing another in between; once the values are set, another click requests nothing."""
    figure = Figure(reader(reduced_motion="reduce").open("icp.html"), "fig-nearest").live()
    figure.set("turn", "90")
    start = figure.root.locator('.control:has([name="start"])')
    expect(start.locator(NOTE)).to_be_visible()
    radio = start.locator("input:checked")
    frames = []
    for _ in range(2):
        if way == "key":
            radio.press("Space")
        else:
            start.locator("label:has(:checked)").click()
        expect(start.locator(NOTE)).to_be_hidden()
        expect(figure.control("turn")).to_have_value("15")
        frames.append(figure.settled().frames())
    assert frames[0] == frames[1]
    assert figure.record()["controls"]["offset"] == 0.5
