"""The figure of nearest points, as a reader drives it: taped steps, a run to its stop, other starts, a phone."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer
from widgets.engine.host import Host


def test_steps_answer_before_python_is_up(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back: a step, another, and back, each with its numbers."""
    server.hold("/runtime/")
    page = reader(reduced_motion="reduce").open("icp.html")
    nearest = Figure(page, "fig-nearest").seen()
    first = nearest.readout("rms")
    nearest.button("step").click()
    second = nearest.changes("rms", first)
    nearest.button("step").click()
    third = nearest.changes("rms", second)
    assert float(first) > float(second) > float(third)
    nearest.button("back").click()
    nearest.shows("rms", second)


def test_a_run_stops_by_itself_and_says_why(reader: Callable[..., Reader]) -> None:
    """Run takes steps until the figure has converged; the description is then the build's."""
    page = reader(reduced_motion="reduce").open("icp.html")
    nearest = Figure(page, "fig-nearest").live()
    nearest.button("run").click()
    expect(nearest.button("step")).to_be_disabled(timeout=60_000)
    nearest.settled()
    assert nearest.readout("stop").startswith("converged")
    assert "come to rest" in nearest.root.locator(".figure-status").inner_text()
    assert nearest.frame()["description"] == Host().render("fig-nearest", nearest.record())["description"]


def test_a_key_turns_the_start_and_the_run_begins_anew(reader: Callable[..., Reader]) -> None:
    """Turned by fifteen degrees with the keyboard after a step, the figure has taken no step and has a larger error."""
    page = reader(reduced_motion="reduce").open("icp.html")
    nearest = Figure(page, "fig-nearest").live()
    before = nearest.readout("rotation_error")
    nearest.button("step").click()
    after_step = nearest.changes("rotation_error", before)
    nearest.handle("turn").focus()
    page.keyboard.press("Shift+ArrowLeft")
    after_turn = nearest.changes("rotation_error", after_step)
    assert float(after_turn) > float(after_step) + 14
    assert nearest.settled().readout("rises") == "0 of 0"


def test_on_a_phone_the_charts_stand_below_each_other(reader: Callable[..., Reader]) -> None:
    """The map, the leading chart and those behind More, none cut off; on a wide page the first is beside the map."""
    for width, below in ((390, True), (1280, False)):
        page = reader(width, 844).open("icp.html")
        page.locator("#fig-nearest .figure-rest > summary").click()
        page.evaluate("scrollTo(0, 0)")
        boxes = [panel.bounding_box() for panel in page.locator("#fig-nearest [data-panel]:has(> svg)").all()]
        places = [box for box in boxes if box]
        assert len(places) == 4
        assert all(box["x"] >= 0 and box["x"] + box["width"] <= width for box in places)
        end = places[0]["y"] + places[0]["height"]
        assert (places[1]["y"] >= end) == below
        assert all(box["y"] >= end for box in places[2:])
        assert all((b["y"] > a["y"]) or not below for a, b in pairwise(places[1:]))
