"""A button in the text leads to its figure, and the way back stays visible until it is used or not needed."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, experiments


def test_back_to_where_you_were(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("icp.html")
    Figure(page, "fig-nearest").live()
    button = page.get_by_role("button", name="Back to where you were")
    experiment = experiments(page, "fig-nearest").last
    experiment.scroll_into_view_if_needed()
    position = page.evaluate("scrollY")
    experiment.click()
    expect(page.locator(f"#{experiment.get_attribute('data-figure')} .figure-stage")).to_be_in_viewport()
    assert abs(page.evaluate("scrollY") - position) > 500
    button.click()
    expect(experiment).to_be_in_viewport()
    expect(experiment).to_be_focused()
    expect(button).to_have_count(0)


def test_who_walks_back_needs_no_button(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("icp.html")
    Figure(page, "fig-nearest").live()
    button = page.get_by_role("button", name="Back to where you were")
    experiment = experiments(page, "fig-nearest").last
    experiment.scroll_into_view_if_needed()
    experiment.focus()
    experiment.press("Enter")
    expect(button).to_be_visible()
    expect(experiment).not_to_be_in_viewport()
    experiment.scroll_into_view_if_needed()
    expect(button).to_have_count(0)
    page.locator("button.try").first.evaluate(
        "node => document.getElementById(node.dataset.figure).querySelector('.figure-stage').scrollIntoView()"
    )
    expect(button).to_have_count(0)
