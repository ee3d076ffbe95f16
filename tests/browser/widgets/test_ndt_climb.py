"""The climb as a reader drives it: back along the tape, a run to its stop, another start, a phone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.figures.ndt_climb.figure import WIDGET


def test_steps_back_answer_before_python_is_up(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back: two steps, and one back."""
    server.hold("/runtime/")
    climb = Figure(reader(reduced_motion="reduce").open("ndt-climb.html"), "fig-climb").seen()
    for status in ("running, 1", "running, 2"):
        climb.button("step").click()
        climb.shows("stop_fine", status)
    climb.button("back").click()
    climb.shows("stop_fine", "running, 1")


def test_a_run_stops_by_itself(reader: Callable[..., Reader]) -> None:
    """Both runs end as in the build, with the build's own frame."""
    climb = Figure(reader(reduced_motion="reduce").open("ndt-climb.html"), "fig-climb").live()
    climb.button("run").click()
    expect(climb.button("step")).to_be_disabled(timeout=60_000)
    climb.settled()
    assert not climb.readout("stop_fine").startswith("running")
    assert climb.frame() == Host().render("fig-climb", climb.record())


def test_a_key_moves_the_start_and_both_begin_anew(reader: Callable[..., Reader]) -> None:
    """Moved by half a unit with the keyboard, no step is taken, and both runs have the new start's error."""
    page = reader(reduced_motion="reduce").open("ndt-climb.html")
    climb = Figure(page, "fig-climb").live()
    before = climb.readout("translation_start")
    climb.handle("source").focus()
    page.keyboard.press("Shift+ArrowLeft")
    after = climb.changes("translation_start", before)
    assert [climb.settled().readout(f"translation_{name}") for name in ("one", "fine")] == [after, after]
    assert climb.readout("stop_one") == "not begun, 0"


def test_presets_are_the_build_s_byte_for_byte(reader: Callable[..., Reader]) -> None:
    """The start and ten steps of each preset."""
    climb = Figure(reader().open("ndt-climb.html"), "fig-climb").live()
    for name in WIDGET.presets:
        for log in ([], [["press", "step"]] * 10):
            record: dict[str, Any] = {**preset(WIDGET, name).plain(), "log": log}
            live = climb.page.evaluate("record => Ladder.runtime.frame({figure: 'fig-x', record})", record)
            assert live == Host().render("fig-x", record), (name, len(log))


def test_the_maps_stand_in_one_row_and_the_charts_in_the_next(reader: Callable[..., Reader]) -> None:
    """On a wide page; on a phone all five are stacked, none cut off."""
    for width, rows in ((1280, 2), (390, 5)):
        page = reader(width, 844).open("ndt-climb.html")
        page.locator("#fig-climb .figure-rest > summary").click()
        boxes = [panel.bounding_box() for panel in page.locator("#fig-climb [data-panel]:has(> svg)").all()]
        places = [box for box in boxes if box]
        assert len(places) == 5
        assert len({round(box["y"]) for box in places}) == rows
        assert all(box["x"] >= 0 and box["x"] + box["width"] <= width for box in places)
