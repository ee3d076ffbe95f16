"""Cards of citations and terms: where they stand, and what keeps and closes them."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import FloatRect, Locator, Page, expect

from tests.browser.conftest import Reader
from tests.browser.layout import FRAMES

EDGE = 8  # px between a card and the window's edge


def link_and_card(page: Page, selector: str = "a.cite[data-card]") -> tuple[Locator, Locator]:
    """The first such link in the text, and its card."""
    link = page.locator(f".text p {selector}").first
    return link, page.locator(f"#{link.get_attribute('data-card')}")


def box(node: Locator) -> FloatRect:
    place = node.bounding_box()
    assert place is not None
    return place


def scroll_to(link: Locator, top: float) -> None:
    """Scroll the page until the link is this far below the window's top, px."""
    link.evaluate("(e, top) => scrollBy({ top: e.getBoundingClientRect().top - top, behavior: 'instant' })", top)


def test_a_card_stands_under_its_link_or_over_it_and_inside_the_window(reader: Callable[..., Reader]) -> None:
    """Over it where there is no room below; and it goes along when the page scrolls or the window changes."""
    page = reader(390, 700, reduced_motion="reduce").open("kabsch.html")
    link, card = link_and_card(page)
    scroll_to(link, 100)
    link.focus()
    expect(card).to_be_visible()
    for top in (100, 660, 300):
        scroll_to(link, top)
        page.evaluate(FRAMES)
        place, at = box(card), box(link)
        assert place["x"] >= EDGE - 0.5
        assert place["x"] + place["width"] <= 390 - EDGE + 0.5
        gap = at["y"] - place["y"] - place["height"] if top == 660 else place["y"] - at["y"] - at["height"]
        assert -2 <= gap <= EDGE, top
    page.set_viewport_size({"width": 390, "height": 320})
    page.evaluate(FRAMES)
    place, at = box(card), box(link)
    assert at["y"] > place["height"], "it has room over the link only"
    assert place["y"] + place["height"] <= at["y"]


def test_a_card_goes_with_its_link_out_of_the_window(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("kabsch.html")
    link, card = link_and_card(page)
    for top in (-200, 1200):
        scroll_to(link, 300)
        link.focus()
        expect(card).to_be_visible()
        scroll_to(link, top)
        expect(card).to_be_hidden()
        link.blur()


def test_the_pointer_may_go_from_a_link_into_its_card(reader: Callable[..., Reader]) -> None:
    """There it stays open, also when it is pressed; beside both it closes, and another link's card takes its place."""
    visitor = reader(alone=True, reduced_motion="reduce")  # the clock belongs to the whole context
    visitor.context.clock.install()
    page, clock = visitor.open("kabsch.html"), visitor.context.clock
    link, card = link_and_card(page)
    scroll_to(link, 300)
    link.hover()
    clock.run_for(500)
    expect(card).to_be_visible()
    inside = box(card)
    page.mouse.move(inside["x"] + 20, inside["y"] + inside["height"] - 8)
    clock.run_for(5000)
    expect(card).to_be_visible()
    card.evaluate("card => card.dispatchEvent(new MouseEvent('click', { bubbles: true, detail: 1 }))")
    expect(card).to_be_visible()
    page.mouse.move(2, 2)
    clock.run_for(5000)
    expect(card).to_be_hidden()
    links = page.locator("a[data-card]")
    for number in range(2):
        links.nth(number).focus()
        expect(page.locator(".card:visible")).to_have_count(1)
    page.locator("button.theme").focus()
    expect(page.locator(".card:visible")).to_have_count(0)


def test_a_finger_opens_a_card_and_then_follows_its_link(reader: Callable[..., Reader]) -> None:
    """A tap elsewhere closes it; the tap after that is a first one again."""
    page = reader(390, 800, has_touch=True, reduced_motion="reduce").open("kabsch.html")
    link, card = link_and_card(page)
    scroll_to(link, 300)
    link.tap()
    expect(card).to_be_visible()
    page.touchscreen.tap(4, 795)
    expect(card).to_be_hidden()
    link.tap()
    expect(card).to_be_visible()
    assert "#ref-" not in page.url
    assert "references" not in page.url
    link.tap()
    page.wait_for_url(lambda url: "#ref-" in url or "references" in url)


def test_a_mouse_follows_a_link_at_once_after_a_touch(reader: Callable[..., Reader]) -> None:
    """On a laptop that has both."""
    page = reader(has_touch=True, reduced_motion="reduce").open("kabsch.html")
    page.locator("h1").tap()
    link, _ = link_and_card(page)
    link.click()
    page.wait_for_url(lambda url: "#ref-" in url or "references" in url)


def test_a_page_that_was_left_with_a_card_comes_back_without(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("kabsch.html")
    link, card = link_and_card(page)
    link.focus()
    expect(card).to_be_visible()
    page.evaluate("dispatchEvent(new PageTransitionEvent('pagehide', { persisted: true }))")
    expect(card).to_be_hidden()


@pytest.mark.parametrize("page", ["kabsch.html", "surfaces.html"])
def test_a_link_is_described_by_its_card(reader: Callable[..., Reader], page: str) -> None:
    links = reader().open(page).locator("a[data-card]")
    described, cards = links.evaluate_all(
        "all => [all.map(e => e.getAttribute('aria-describedby')), all.map(e => e.dataset.card)]"
    )
    assert described == cards
