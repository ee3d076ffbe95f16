"""The figure of corrupted pairs, as a reader drives it: taped trials, a run to its end, a pulled partner, a phone."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer
from widgets.engine.host import Host


def test_trials_answer_before_python_is_up(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back: one trial, another, and back."""
    server.hold("/runtime/")
    page = reader(reduced_motion="reduce").open("ransac.html")
    figure = Figure(page, "fig-consensus").seen()
    figure.shows("trials", "0")
    for count in ("1", "2"):
        figure.button("step").click()
        figure.shows("trials", count)
    figure.button("back").click()
    figure.shows("trials", "1")


def test_a_run_ends_where_to_the_end_does(reader: Callable[..., Reader]) -> None:
    """Run goes on until the consensus is stable, with To the end's numbers; the description is the build's."""
    page = reader(reduced_motion="reduce").open("ransac.html")
    figure = Figure(page, "fig-consensus").live()
    figure.button("finish").click()
    figure.changes("trials", "0")
    whole = {name: figure.readout(name) for name in ("trials", "count", "capped_sum", "rotation_error")}
    figure.button("reset").click()
    figure.shows("trials", "0")
    figure.button("run").click()
    expect(figure.button("step")).to_be_disabled(timeout=60_000)
    figure.settled()
    assert {name: figure.readout(name) for name in whole} == whole
    assert figure.frame()["description"] == Host().render("fig-consensus", figure.record())["description"]


def test_a_partner_pulled_by_keys_moves_the_ghost_and_leaves_the_consensus(reader: Callable[..., Reader]) -> None:
    """Pulled two units left by keyboard, it moves the least-squares fit; the consensus has one pair fewer."""
    page = reader(reduced_motion="reduce").open("ransac.html")
    figure = Figure(page, "fig-consensus").live()
    figure.button("finish").click()
    figure.changes("trials", "0")
    ghost, count = figure.readout("ghost_translation"), int(figure.readout("count"))
    figure.handle("partner").focus()
    for _ in range(4):
        page.keyboard.press("Shift+ArrowLeft")
    figure.changes("ghost_translation", ghost)
    figure.settled()
    assert int(figure.readout("count")) == count - 1
    assert float(figure.readout("translation_error")) < 0.1


@pytest.mark.parametrize("epsilon", ["0.1", "1.6", "0.02"])
def test_notes_fit_the_status_line_of_a_phone(reader: Callable[..., Reader], epsilon: str) -> None:
    """Whatever a run reports, nothing below it moves."""
    figure = Figure(reader(390, 844, reduced_motion="reduce").open("ransac.html"), "fig-consensus").live()
    line = figure.root.locator(".figure-status")
    empty = line.evaluate("node => node.getBoundingClientRect().height")
    figure.set("epsilon", epsilon)
    figure.set("outliers", "0.8")
    figure.settled()
    for button in ("step", "finish"):
        figure.button(button).click()
        expect(line).to_contain_text("within ε")
        assert line.evaluate("node => node.getBoundingClientRect().height") == empty, line.inner_text()
