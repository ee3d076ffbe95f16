"""A page saved by a browser, "complete": what its scripts had made of it is there, and the scripts run again."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure

SHOWN = "figure => [...figure.querySelectorAll('svg.panel, .readout')].map(e => e.textContent || e.innerHTML)"


@pytest.mark.parametrize(("path", "name"), [("icp.html", "fig-nearest"), ("race.html", "fig-race")])
def test_a_figure_of_a_saved_page_is_a_picture(reader: Callable[..., Reader], path: str, name: str) -> None:
    """It shows what it showed, in the picture as in the numbers, has nothing twice and nothing that seems to work."""
    visitor = reader(reduced_motion="reduce")
    visitor.expect("inline style")  # a saved page's policy forbids the places of what scripts had placed
    page = visitor.open(path)
    figure = Figure(page, name).live().settled()
    figure.button("step").click()
    figure.settled()
    shown = figure.root.evaluate(SHOWN)
    page.keyboard.press("/")
    page.locator("#search-field").fill("partner")
    expect(page.locator(".search-told")).to_contain_text("place")
    markup = page.evaluate("'<!doctype html>' + document.documentElement.outerHTML")
    copy = visitor.page()
    copy.route(f"**/{path}", lambda route: route.fulfill(content_type="text/html", body=markup))
    copy.goto(f"{visitor.origin}/{path}")
    copy.evaluate("Ladder.alive")
    saved = Figure(copy, name).seen()
    assert saved.root.evaluate(SHOWN) == shown
    expect(saved.root.locator(".figure-status")).to_contain_text("Saved as a picture")
    expect(saved.root.locator(".handle, .crosshair, .enlarge")).to_have_count(0)
    expect(saved.root.locator("button:not([data-picture]):enabled, input:enabled")).to_have_count(0)
    expect(copy.locator("button.try:enabled")).to_have_count(0)
    expect(saved.root.locator(".figure-take")).to_have_count(1)
    expect(copy.locator("dialog.search")).to_have_count(0)
    assert copy.evaluate("Ladder.runtime.state") == "idle"
