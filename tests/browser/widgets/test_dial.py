"""The dial of a rung, as a reader drives it."""

from __future__ import annotations

from collections.abc import Callable

from tests.browser.conftest import Reader
from tests.browser.figure import Figure


def test_the_slider_of_the_start_turns_a_robot_that_was_dragged(reader: Callable[..., Reader]) -> None:
    """The run that was begun goes on from the new heading."""
    page = reader(reduced_motion="reduce").open("four.html")
    dial = Figure(page, "fig-dial-flow").live()
    dial.handle("turn").focus()
    before = dial.readout("rotation_error")
    dial.button("roll").click()
    dial.changes("rotation_error", before)
    dial.handle("turn").focus()
    page.keyboard.press("ArrowRight")
    dial.settled()
    assert [entry[0] for entry in dial.record()["log"]] == ["press", "drag"]
    dial.set("turn", "180")
    dial.settled()
    assert dial.record()["log"] == [["press", "roll"]]
    assert "starts 180° from the true heading" in dial.frame()["description"]
