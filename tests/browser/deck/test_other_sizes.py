"""A deck in windows of other sizes, and two of it at once: the slide that is seen stays, and all of it can be read."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.deck.test_slides import opened, stands_at


def test_a_window_of_another_size_keeps_the_slide(reader: Callable[..., Reader]) -> None:
    """A tablet that is turned, a window made wider or taller: neither this window nor the second one leaves it."""
    one = reader(768, 1024, reduced_motion="reduce")
    page, second = one.open("slides-icp.html#4"), one.open("slides-icp.html#4")
    resized = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
    for width, height in [(1024, 768), (390, 844), (844, 390), (900, 800), (1280, 500), (1280, 900), (768, 1024)]:
        page.set_viewport_size({"width": width, "height": height})
        page.evaluate(resized)
        expect(page.locator(".deck-at")).to_have_text("4 of 8")
        assert page.evaluate(
            "(([{ top, bottom }, middle]) => top <= middle && bottom > middle)"
            "([document.getElementById('4').getBoundingClientRect(), innerHeight / 2])"
        ), (width, height)
    assert page.url.endswith("#4")
    expect(second.locator(".deck-at")).to_have_text("4 of 8")


def test_keys_scroll_through_a_slide_taller_than_the_screen(reader: Callable[..., Reader]) -> None:
    """At 200 % zoom: down to its end before the next one comes, and back up; across they turn slides at once."""
    page = opened(reader, "slides-icp.html#3", 640, 500)
    tall = "(id => document.getElementById(id).getBoundingClientRect())('3')"

    def still() -> None:
        """Waits for the end of a scroll, which the browser draws out."""
        until(page, "(now => now === (window.stood ?? -1) || (window.stood = now, false))(scrollY)")

    assert page.evaluate(f"{tall}.height") > 1000
    for key in ("PageDown", " ", "ArrowDown"):
        top = page.evaluate(f"{tall}.top")
        page.keyboard.press(key)
        until(page, f"{tall}.top < {top}")
        still()
        expect(page.locator(".deck-at")).to_have_text("3 of 8")
    for _ in range(10):
        if page.evaluate(f"{tall}.bottom <= innerHeight + 1"):
            break
        top = page.evaluate(f"{tall}.top")
        page.keyboard.press("PageDown")
        until(page, f"{tall}.top < {top}")
        still()
    page.keyboard.press("PageDown")
    stands_at(page, 4)
    page.keyboard.press("ArrowLeft")
    stands_at(page, 3)
    page.keyboard.press("PageDown")
    until(page, f"{tall}.top < -100")
    still()
    page.keyboard.press("PageUp")
    until(page, f"{tall}.top > -2")
    page.keyboard.press("ArrowRight")
    stands_at(page, 4)


def test_a_key_that_is_held_opens_the_overview_once(reader: Callable[..., Reader]) -> None:
    page = opened(reader)
    for _ in range(4):
        page.keyboard.down("Escape")
    expect(page.locator("html")).to_have_attribute("data-slides", "grid")
    page.keyboard.up("Escape")
    page.keyboard.press("Escape")
    expect(page.locator("html")).not_to_have_attribute("data-slides", "grid")


def test_a_second_window_goes_back_as_well(reader: Callable[..., Reader]) -> None:
    one = reader(1280, 720, reduced_motion="reduce")
    page, second = one.open("slides-icp.html#4"), one.open("slides-icp.html#4")
    page.keyboard.press("End")
    stands_at(second, 8)
    page.go_back()
    stands_at(page, 4)
    stands_at(second, 4)
