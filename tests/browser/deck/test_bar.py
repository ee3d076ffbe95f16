"""A deck's bar says where one is, and keys and fingers do on a slide what they do elsewhere."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.deck.test_slides import DECK, page_of, stands_at
from tests.browser.figure import Figure, finger


def test_the_bar_says_how_far_one_is(reader: Callable[..., Reader]) -> None:
    """Its line is empty at first and full at last, where a button leads no further and says so."""
    page = page_of(reader)
    before, after = (page.locator(f'.deck-bar [data-slides="{way}"]') for way in ("before", "after"))
    line = "e => parseFloat(getComputedStyle(e).backgroundSize)"
    last = page.locator(".slide").count()
    for key, number, part, first_off, last_off in (
        ("Home", 1, 0, "true", "false"), ("ArrowRight", 2, 100 / (last - 1), "false", "false"),
        ("End", last, 100, "false", "true"),
    ):  # fmt: skip
        page.keyboard.press(key)
        stands_at(page, number)
        expect(before).to_have_attribute("aria-disabled", first_off)
        expect(after).to_have_attribute("aria-disabled", last_off)
        assert page.locator(".deck-progress").evaluate(line) == pytest.approx(part, abs=0.1)


def test_the_overview_is_told_and_only_there_slides_are_stops_of_the_keyboard(reader: Callable[..., Reader]) -> None:
    """The slide that was left is marked. A capital letter is the same key."""
    page = page_of(reader, f"{DECK}#3")
    button, links = page.get_by_role("button", name="Overview"), page.locator(".slide-open")
    stops = "all => all.filter(e => e.tabIndex >= 0).length"
    for shown in (True, False):
        page.keyboard.press("Escape")
        expect(button).to_have_attribute("aria-pressed", str(shown).lower())
        assert links.evaluate_all(stops) == (links.count() if shown else 0)
        expect(page.locator(".slide.current")).to_have_id("3")
    for shown in (True, False):
        page.keyboard.press("Shift+N")
        expect(page.locator("[id='3'] .slide-notes")).to_be_visible(visible=shown)


def test_in_a_low_window_arrows_lead_through_the_overview(reader: Callable[..., Reader]) -> None:
    """The slides are higher than the window there: a key moves the focus and does not scroll first."""
    page = page_of(reader, "slides-icp.html#3", 640, 300)
    page.keyboard.press("Escape")
    links = page.locator(".slide-open")
    for number in (4, 5):
        page.keyboard.press("ArrowDown")
        expect(links.nth(number - 1)).to_be_focused()


def test_space_on_what_it_unfolds_turns_no_slide(reader: Callable[..., Reader]) -> None:
    """Arrows on an option choose the next one."""
    page = page_of(reader, f"{DECK}#5")
    solve = Figure(page, "fig-solve").live().settled()
    fold = solve.root.locator("summary").first
    fold.focus()
    page.keyboard.press("Space")
    expect(fold.locator("xpath=..")).to_have_attribute("open", "")
    option = solve.root.locator('[name="scene"]:checked')
    before = option.get_attribute("value")
    option.focus()
    page.keyboard.press("ArrowRight")
    until(page, f"document.querySelector('#fig-solve [name=scene]:checked').value !== {before!r}")
    stands_at(page, 5)


def test_a_finger_on_a_slider_turns_no_slide(reader: Callable[..., Reader]) -> None:
    page = page_of(reader, f"{DECK}#7", has_touch=True)
    wrong = Figure(page, "fig-wrong").live().settled()
    slider = wrong.control("wrong")
    box = slider.bounding_box()
    assert box is not None
    right, y = box["x"] + box["width"] - 6, box["y"] + box["height"] / 2
    finger(page, [(right + part * (12 - box["width"]), y) for part in (0, 0.25, 0.5, 0.75, 1)])
    expect(slider).to_have_value("0")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("PageUp")  # had the swipe counted, the previous slide would be another
    stands_at(page, 6)


def test_a_second_window_goes_along_with_a_scroll(reader: Callable[..., Reader]) -> None:
    visitor = reader(1280, 720, reduced_motion="reduce")
    page, second = visitor.open("slides-icp.html#4"), visitor.open("slides-icp.html#4")
    page.mouse.move(640, 360)
    page.mouse.wheel(0, 720)
    stands_at(page, 5)
    stands_at(second, 5)
