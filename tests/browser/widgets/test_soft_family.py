"""The soft family and the nine contestants, as a reader drives them: σ by hand, each method, taped steps, a drag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import pairwise

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, experiments
from tests.browser.server import SiteServer
from widgets.engine.host import Host


def test_steps_and_a_try_answer_before_python_is_up(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back: two steps, each with a higher likelihood, and one of the page's experiments."""
    server.hold("/runtime/")
    page = reader(reduced_motion="reduce").open("soft.html")
    soft = Figure(page, "fig-soft").seen()
    first = soft.readout("objective")
    soft.button("step").click()
    second = soft.changes("objective", first)
    soft.button("step").click()
    third = soft.changes("objective", second)
    assert float(first) > float(second) > float(third)
    experiments(page, "fig-soft").get_by_text("Ten clutter points, no clutter term").click()
    soft.shows("stop", "step 40")
    assert float(soft.readout("rotation_error")) > 45


def test_sigma_by_hand_hardens_and_moves_nothing(reader: Callable[..., Reader]) -> None:
    """Lowering the slider leaves fewer effective partners and the same pose; the description is the build's."""
    page = reader(reduced_motion="reduce").open("soft.html")
    soft = Figure(page, "fig-soft").live()
    soft.set("width", "held")
    soft.settled()
    rotation, many = soft.readout("rotation_error"), soft.readout("partners")
    soft.set("sigma", "0.1")
    few = soft.changes("partners", many)
    assert float(few) < 1.5 < float(many)
    assert soft.readout("rotation_error") == rotation
    frame, native = soft.settled().frame(), Host().render("fig-soft", soft.record())
    assert frame["description"] == native["description"]
    assert soft.root.locator("svg.panel").first.evaluate("e => e.outerHTML.length") > 1000


def test_each_method_runs_to_its_stop(reader: Callable[..., Reader]) -> None:
    """CPD, FilterReg on the lattice and GMMReg each run to their end and stop, with the native numbers."""
    page = reader(reduced_motion="reduce").open("soft.html")
    soft = Figure(page, "fig-soft").live()
    for method in ("cpd-similarity", "filterreg", "gmmreg"):
        soft.set("method", method)
        soft.settled()
        if method == "filterreg":
            soft.set("filter", "lattice")
            soft.settled()
        soft.button("finish").click()
        expect(soft.button("step")).to_be_disabled(timeout=30_000)
        frame, native = soft.settled().frame(), Host().render("fig-soft", soft.record())
        assert frame["readouts"] == native["readouts"]
        assert float(soft.readout("rotation_error")) < 5
        soft.button("reset").click()
        expect(soft.button("step")).to_be_enabled()


def test_the_bird_is_dragged_in_one_panel_and_moves_in_nine(reader: Callable[..., Reader]) -> None:
    """A drag in the first panel changes ICP's link, not RANSAC's; nine panels are drawn, in the build's words."""
    page = reader(reduced_motion="reduce").open("contestants.html")
    nine = Figure(page, "fig-nine").live()
    before, search = nine.readout("icp"), nine.readout("ransac_congruent")
    nine.drag("source", 40, 25)
    nine.changes("icp", before)
    assert nine.settled().readout("ransac_congruent") == search
    assert nine.root.locator("svg.panel").count() == 9
    assert nine.frame()["description"] == Host().render("fig-nine", nine.record())["description"]


def test_on_a_phone_nothing_is_cut_off(reader: Callable[..., Reader]) -> None:
    """At 390 px, the three panels of the soft family are stacked, and those of the nine contestants are a large one
    above two rows of four; none is cut off or covers another, and no drawing is less than 50 px high."""
    soft = Figure(reader(390, 844).open("soft.html"), "fig-soft").seen()
    soft.reached("[data-panel=sigma]")
    nine = Figure(reader(390, 844).open("contestants.html"), "fig-nine").seen()
    for figure, rows in ((soft, [1, 1, 1]), (nine, [1, 4, 4])):
        figure.page.evaluate("scrollTo(0, 0)")  # scrolled, a panel may stick while others pass below
        boxes = figure.boxes(".figure-panel")
        assert list(Counter(box["y"] for box in boxes).values()) == rows
        for box, after in pairwise(boxes):
            assert box["y"] + box["height"] <= after["y"] or box["x"] + box["width"] <= after["x"]
        for box in boxes:
            assert 0 <= box["x"] < box["x"] + box["width"] <= 390
        assert all(box["height"] > 50 for box in figure.boxes(".figure-panel > svg"))
