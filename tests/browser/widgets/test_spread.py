"""The figure of redrawn scans, as a reader drives it: the end wall is dragged, and the slider follows."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import LIVE, Figure


@pytest.mark.parametrize("way", ["pointer", "key"])
def test_a_pulled_wall_is_the_slider_moved(reader: Callable[..., Reader], way: str) -> None:
    """The handle and the slider make the same record and the same frame, and each follows the other."""
    room = Figure(reader(reduced_motion="reduce").open("uncertainty.html"), "fig-room").live()
    slider = room.control("wall")
    own = slider.input_value()
    if way == "pointer":
        room.drag("wall", 60, 25)
    else:
        room.handle("wall").focus()
        for key in ("ArrowRight", "ArrowUp", "Shift+ArrowRight"):
            room.page.keyboard.press(key)
    expect(slider).not_to_have_value(own)
    wall = room.settled().record()["controls"]["wall"]
    record, frame = room.record(), room.frame()
    assert record["log"] == []
    assert frame["handles"][0]["world"] == [wall, 0]
    expect(slider).to_have_value(f"{wall:g}")
    for value in (own, f"{wall:g}"):
        room.set("wall", value)
        expect(room.handle("wall")).to_have_attribute("aria-valuenow", value, timeout=LIVE)
    until(room.page, f"Ladder.figures.get({room.name!r}).shown.controls.wall === {wall}")
    assert room.settled().record() == record
    assert room.frame() == frame
