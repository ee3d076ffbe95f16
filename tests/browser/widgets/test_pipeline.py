"""The figure of the stages, as a reader drives it: stage by stage from the tape, live verdicts, equal descriptions."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer
from widgets.engine.host import Host


def test_the_stages_answer_before_python_is_up(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back: proposal, refinement and verdict, each with its numbers."""
    server.hold("/runtime/")
    page = reader(reduced_motion="reduce").open("reading.html")
    stages = Figure(page, "fig-stages").seen()
    assert stages.readout("verdict") == "–"
    start = stages.readout("rotation_error")
    stages.button("next").click()
    proposal = stages.changes("rotation_error", start)
    assert float(proposal) < float(start)
    before = stages.readout("stop")
    stages.button("next").click()
    stages.changes("stop", before)
    assert stages.readout("verdict") == "–"
    stages.button("next").click()
    stages.shows("verdict", "accepted")
    expect(stages.button("next")).to_be_disabled()


def test_a_wrong_pose_is_accepted_and_then_refused(reader: Callable[..., Reader]) -> None:
    """In the hall the signs accept half a turn; trusting the prediction refuses it, in the build's words."""
    page = reader(reduced_motion="reduce").open("reading.html")
    hall = Figure(page, "fig-hall").live()
    hall.button("finish").click()
    hall.shows("verdict", "accepted").settled()
    assert hall.readout("right") == "no"
    trust = hall.reached('input[name="trust"]')
    trust.focus()
    trust.press("Home")
    hall.shows("verdict", "refused")
    assert "prediction" in hall.root.locator(".figure-status").inner_text()
    assert hall.frame()["description"] == Host().render("fig-hall", hall.record())["description"]


def test_the_signs_stand_beside_the_scene_or_below_it(reader: Callable[..., Reader]) -> None:
    """Below on a phone, beside on a wide page, never cut off."""
    for width, below in ((390, True), (1280, False)):
        page = reader(width, 844).open("reading.html")
        scene, signs = (panel.bounding_box() for panel in page.locator("#fig-stages [data-panel]:has(> svg)").all())
        assert scene
        assert signs
        assert signs["x"] >= 0
        assert signs["x"] + signs["width"] <= width
        assert (signs["y"] >= scene["y"] + scene["height"]) == below
