"""The walkthrough as a reader drives it: stages from the tape, a jump and Back, a toggle, and a phone."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, experiments
from tests.browser.server import SiteServer
from widgets.engine.host import Host


def test_the_first_stages_and_the_end_answer_before_python_is_up(
    reader: Callable[..., Reader], server: SiteServer
) -> None:
    """With the runtime held back, three presses of Next reach the fourth stage, where the pose changes; then an
    experiment runs to its end."""
    server.hold("/runtime/")
    page = reader(reduced_motion="reduce").open("four.html")
    four = Figure(page, "fig-four").seen()
    first = four.readout("mmd_rotation")
    for _ in range(3):
        four.button("next").click()
    four.changes("mmd_rotation", first)
    expect(four.root.locator(".panel-caption").first).to_contain_text("4 of 5 · translation and scale")
    experiments(page, "fig-four").get_by_text("The moving cloud 15 % smaller, to the end").click()
    four.shows("mmd_scale", "−15.0")


def test_chips_back_and_a_toggle_live(reader: Callable[..., Reader]) -> None:
    """After stage 4, Next iteration and Back, live frames equal native ones; the scale switch replays the walk."""
    page = reader(reduced_motion="reduce").open("four.html")
    four = Figure(page, "fig-four").live()
    four.button("stage-4").click()
    rotation = four.changes("cpd_rotation", "60.0")
    four.button("iterate").click()
    four.changes("cpd_rotation", rotation)
    assert four.settled().frame()["readouts"] == Host().render("fig-four", four.record())["readouts"]
    four.button("back").click()
    four.shows("cpd_rotation", rotation)
    four.reached("[name=smaller]").click()
    four.shows("mmd_scale", "−15.0")
    frame, native = four.settled().frame(), Host().render("fig-four", four.record())
    assert frame["readouts"] == native["readouts"]
    assert frame["description"] == native["description"]


@pytest.mark.parametrize("name", ["fig-four", "fig-junk"])
def test_on_a_phone_every_stage_is_named_in_full(reader: Callable[..., Reader], name: str) -> None:
    """Below the small pictures, that is: what changes with Next is the end of the name's second line."""
    four = Figure(reader(390, 844, reduced_motion="reduce").open("four.html"), name).live()
    heads = four.root.locator(".figure-panel:not(.large) .panel-caption > :first-child")
    for _ in range(5):
        assert heads.evaluate_all("all => all.filter(one => one.scrollHeight > one.clientHeight + 1).length") == 0
        note = four.root.locator(".panel-caption").first.inner_text()
        four.button("next").click()
        expect(four.root.locator(".panel-caption").first).not_to_have_text(note)


def test_on_a_phone_nothing_is_cut_off(reader: Callable[..., Reader]) -> None:
    """At 390 px, one panel is as wide as the page with three small ones in a row below it; focused, Next is below them,
    in sight together with all four."""
    four = Figure(reader(390, 844).open("four.html"), "fig-four").live()
    four.button("next").focus()
    first, *small = four.boxes(".figure-panel")
    (button,) = four.boxes("[data-button=next]")
    assert first["width"] > 340
    assert len(small) == 3
    assert len({box["y"] for box in small}) == 1
    for left, right in pairwise(small):
        assert left["x"] + left["width"] <= right["x"]
    assert 0 <= first["y"] < first["y"] + first["height"] <= small[0]["y"]
    assert small[0]["y"] + small[0]["height"] <= button["y"] < button["y"] + button["height"] <= 844
    for box in (first, *small, button):
        assert 0 <= box["x"] < box["x"] + box["width"] <= 390
