"""A button in the text leads to its figure, and the way back stays visible until it is used or not needed."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, experiments


def test_back_to_where_you_were(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("icp.html")
    Figure(page, "fig-nearest").live()
    back = page.get_by_role("button", name="Back to where you were")
    tried = experiments(page, "fig-nearest").last
    tried.scroll_into_view_if_needed()
    place = page.evaluate("scrollY")
    tried.click()
    expect(page.locator(f"#{tried.get_attribute('data-figure')} .figure-stage")).to_be_in_viewport()
    assert abs(page.evaluate("scrollY") - place) > 500
    back.click()
    expect(tried).to_be_in_viewport()
    expect(tried).to_be_focused()
    expect(back).to_have_count(0)


def test_who_walks_back_needs_no_button(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("icp.html")
    Figure(page, "fig-nearest").live()
    back = page.get_by_role("button", name="Back to where you were")
    tried = experiments(page, "fig-nearest").last
    tried.scroll_into_view_if_needed()
    tried.focus()
    tried.press("Enter")
    expect(back).to_be_visible()
    expect(tried).not_to_be_in_viewport()
    tried.scroll_into_view_if_needed()
    expect(back).to_have_count(0)
    page.locator("button.try").first.evaluate(
        "node => document.getElementById(node.dataset.figure).querySelector('.figure-stage').scrollIntoView()"
    )
    expect(back).to_have_count(0)
