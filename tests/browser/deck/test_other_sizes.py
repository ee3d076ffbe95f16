"""A deck in windows of other sizes, and in two at once: the current slide stays, and all of it can be read."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.deck.test_slides import page_of, stands_at
from tests.browser.figure import Figure


def test_a_window_of_another_size_keeps_the_slide(reader: Callable[..., Reader]) -> None:
    """When a tablet is rotated or a window is resized, neither this window nor the second one leaves the slide."""
    visitor = reader(768, 1024, reduced_motion="reduce")
    page, second = visitor.open("slides-icp.html#4"), visitor.open("slides-icp.html#4")
    two_frames = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
    for width, height in [(1024, 768), (390, 844), (844, 390), (900, 800), (1280, 500), (1280, 900), (768, 1024)]:
        page.set_viewport_size({"width": width, "height": height})
        page.evaluate(two_frames)
        expect(page.locator(".deck-at")).to_have_text("4 of 8")
        assert page.evaluate(
            "(([{ top, bottom }, middle]) => top <= middle && bottom > middle)"
            "([document.getElementById('4').getBoundingClientRect(), innerHeight / 2])"
        ), (width, height)
    assert page.url.endswith("#4")
    expect(second.locator(".deck-at")).to_have_text("4 of 8")


@pytest.mark.parametrize("deck", ["icp", "race", "four", "landscape"])
def test_a_finger_reaches_every_button_of_a_slide(reader: Callable[..., Reader], deck: str) -> None:
    """On a phone a slide is taller than the screen: wherever a button is scrolled to, no picture covers it."""
    page = reader(390, 844, has_touch=True, is_mobile=True, reduced_motion="reduce").open(f"slides-{deck}.html")
    page.evaluate("Ladder.alive")
    buttons = page.locator(".slide .figure-desk > .buttons button:visible").all()
    assert buttons
    for button in buttons:
        at = button.evaluate("""button => {
          button.scrollIntoView({ block: "center", behavior: "instant" });
          const { left, top, width, height } = button.getBoundingClientRect();
          return document.elementFromPoint(left + width / 2, top + height / 2)?.closest("button") === button;
        }""")
        assert at, button.inner_text()


@pytest.mark.parametrize("deck", ["index", "icp", "ndt-climb", "race", "landscape", "search"])
def test_a_tablet_shows_the_pictures_and_what_drives_them(reader: Callable[..., Reader], deck: str) -> None:
    """Upright, a slide's main button and first control are on the screen, below its pictures and charts."""
    page = page_of(reader, f"slides-{deck}.html", 768, 1024)
    ends = page.locator(".slide:has(.figure-stage)").evaluate_all("""slides => slides.flatMap(slide =>
      [...slide.querySelectorAll('.primary, .control:first-child')].map(part =>
        part.getBoundingClientRect().bottom - slide.getBoundingClientRect().top))""")
    bar = page.locator(".deck-bar").bounding_box()
    assert bar is not None
    assert ends
    assert max(ends) <= bar["y"]


def test_keys_scroll_through_a_slide_taller_than_the_screen(reader: Callable[..., Reader]) -> None:
    """At 200 % zoom, keys scroll a screen at a time to the next slide and back; left and right turn slides."""
    page = page_of(reader, "slides-icp.html#3", 640, 500)
    at = page.locator(".deck-at")
    assert page.locator("[id='3']").evaluate("slide => slide.offsetHeight") > 1000

    def press(key: str) -> float:
        """How far the column has moved, in px, once it has stood elsewhere for ten frames."""
        before = page.evaluate("(window.still = 0, window.place = scrollY)")
        page.keyboard.press(key)
        page.wait_for_function(
            """before => {
              window.still = scrollY !== before && scrollY === window.place ? window.still + 1 : 0;
              window.place = scrollY;
              return window.still > 9;
            }""",
            arg=before,
        )
        return float(page.evaluate("scrollY") - before)

    for key in ("PageDown", " ", "ArrowDown"):
        assert 0 < press(key) < 500
        expect(at).to_have_text("3 of 8")
    for _ in range(10):
        assert 0 < press("PageDown") < 500
        if at.inner_text() == "4 of 8":
            break
    expect(at).to_have_text("4 of 8")
    page.keyboard.press("ArrowLeft")
    stands_at(page, 3)
    assert 0 < press("PageDown") < 500
    assert -500 < press("PageUp") < 0
    stands_at(page, 3)
    page.keyboard.press("ArrowRight")
    stands_at(page, 4)


def test_a_key_that_is_held_opens_the_overview_once(reader: Callable[..., Reader]) -> None:
    page = page_of(reader)
    for _ in range(4):
        page.keyboard.down("Escape")
    expect(page.locator("html")).to_have_attribute("data-slides", "grid")
    page.keyboard.up("Escape")
    page.keyboard.press("Escape")
    expect(page.locator("html")).not_to_have_attribute("data-slides", "grid")


def test_a_second_window_goes_back_as_well(reader: Callable[..., Reader]) -> None:
    visitor = reader(1280, 720, reduced_motion="reduce")
    page, second = visitor.open("slides-icp.html#4"), visitor.open("slides-icp.html#4")
    page.keyboard.press("End")
    stands_at(second, 8)
    page.go_back()
    stands_at(page, 4)
    stands_at(second, 4)


def test_what_is_pressed_stays_under_the_pointer(reader: Callable[..., Reader]) -> None:
    """Where slides do not snap, a handle of the next slide is dragged without a jump; Tab then goes to that slide."""
    page = page_of(reader, "slides-icp.html#2", 900, 1000)
    nearest = Figure(page, "fig-nearest").live().settled()
    handle = nearest.handle("source")
    handle.evaluate("handle => scrollBy(0, handle.getBoundingClientRect().top - innerHeight + 150)")
    expect(page.locator(".deck-at")).to_have_text("2 of 8")
    before, scrolled = nearest.frame()["handles"][0]["world"], page.evaluate("scrollY")
    nearest.drag("source", 40, 0)
    nearest.settled()
    ((kind, _, x, y),) = nearest.record()["log"]
    assert kind == "drag"
    assert x > before[0] + 0.3
    assert y == pytest.approx(before[1], abs=0.1)
    assert page.evaluate("scrollY") == scrolled
    expect(page.locator(".deck-at")).to_have_text("2 of 8")
    page.keyboard.press("Tab")
    stands_at(page, 3)


@pytest.mark.parametrize(("width", "percent"), [(320, 100), (390, 200)])
def test_the_bar_is_on_the_screen(reader: Callable[..., Reader], width: int, percent: int) -> None:
    """On the narrowest phone, and with large text: the bar is fixed, so nothing beside it can be scrolled to."""
    page = page_of(reader, "slides-icp.html", width, 640)
    page.evaluate("percent => { document.documentElement.style.fontSize = `${percent}%`; }", percent)
    buttons = page.locator(".deck-bar :is(a, button):visible")
    boxes = [box for button in buttons.all() if (box := button.bounding_box())]
    assert len(boxes) > 3
    assert min(box["x"] for box in boxes) >= 0
    assert max(box["x"] + box["width"] for box in boxes) <= width
    assert max(box["y"] + box["height"] for box in boxes) <= 640
    assert min(box["width"] for box in boxes) >= 43.5
