"""A deck in use: keys, touch, the address, notes, paper; every slide of every deck fits the screen."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from tests.browser.accessibility.test_axe import violations
from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.layout import BEYOND, CUT, LATE_FONTS, MISFITS, SMALL, remaining

DECK = "slides-kabsch.html"
SIZES = [(1280, 720), (1366, 650), (1920, 1080)]
CURRENT = """() => {
  const at = [...document.querySelectorAll('.slide')].find(e => Math.abs(e.getBoundingClientRect().top) < 2);
  return at ? Number(at.id) : 0;
}"""


@pytest.fixture(scope="session")
def decks(site: Path, pytestconfig: pytest.Config) -> list[str]:
    """All decks; with --pages, only the given ones."""
    option = pytestconfig.getoption("--pages")
    paths = sorted(path.name for path in site.glob("slides-*.html"))
    assert len(paths) >= 16
    return [name for name in paths if not option or name in option.split(",")]


def stands_at(page: Page, number: int) -> None:
    """Check that the slide is at the top of the screen and named as the current one."""
    expect(page.locator(".deck-at")).to_have_text(re.compile(rf"^{number} of "))
    until(page, f"({CURRENT})() === {number}")


def page_of(reader: Callable[..., Reader], path: str = DECK, width: int = 1280, height: int = 720, **more: Any) -> Page:
    more.setdefault("reduced_motion", "reduce")
    return reader(width, height, **more).open(path)


def test_every_slide_of_every_deck_fits(reader: Callable[..., Reader], decks: list[str]) -> None:
    """At each size all of a slide is visible, words have their stated size, and no label is under 11 px of 1280; with
    scripts, which add the buttons."""
    visitor, result = reader(reduced_motion="reduce"), []
    for name in decks:
        page = visitor.open(name)
        assert page.evaluate(LATE_FONTS, True) == [], f"{name} asks for a font after its styles are read: it may shift"
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            result += [f"{name} at {width}: {fault}" for fault in remaining(page, MISFITS, CUT)]
        page.set_viewport_size({"width": 390, "height": 844})
        result += [f"{name} at 390: {fault}" for fault in remaining(page, BEYOND, SMALL)]
        assert page.title().endswith(": slides · The Registration Ladder")
        page.close()
    assert not result, "\n".join(result)


def test_sliders_side_by_side_stand_level(reader: Callable[..., Reader]) -> None:
    """Even where the label of one takes two lines."""
    page = page_of(reader, "slides-index.html#3", height=800)
    places = [slider.bounding_box() for slider in page.locator('[id="3"] input[type=range]').all()]
    first, second = (place for place in places if place)
    assert first["x"] + first["width"] < second["x"]
    assert abs(first["y"] - second["y"]) < 1


def test_keys_lead_through_a_deck(reader: Callable[..., Reader]) -> None:
    """Each key does what it says; address, words and focus follow; Back returns to where one jumped from."""
    page = page_of(reader, "kabsch.html")
    page.locator(f'a[href="{DECK}"]').click()
    page.wait_for_url(f"**/{DECK}")
    last = page.locator(".slide").count()
    stands_at(page, 1)
    for key, number in (
        ("ArrowRight", 2), ("ArrowDown", 3), ("PageDown", 4), ("Space", 5), ("Shift+Space", 4), ("ArrowLeft", 3),
        ("ArrowUp", 2), ("PageUp", 1), ("ArrowLeft", 1), ("End", last), ("ArrowRight", last), ("Home", 1),
    ):  # fmt: skip
        page.keyboard.press(key)
        stands_at(page, number)
        until(page, f"Number(document.activeElement.id || 1) === {number}")
    assert page.url.endswith("#1")
    page.go_back()
    stands_at(page, last)
    page.go_back()
    stands_at(page, 1)
    page.goto(f"{page.url.split('#')[0]}#4")
    stands_at(page, 4)
    page.reload()
    stands_at(page, 4)
    page.mouse.wheel(0, 720)
    stands_at(page, 5)
    until(page, "location.hash === '#5'")
    page.keyboard.press("Control+ArrowRight")
    page.get_by_role("button", name="Next slide").click()
    stands_at(page, 6)
    page.keyboard.press("Space")  # the button still has the focus
    stands_at(page, 7)
    page.get_by_role("button", name="Previous slide").click()
    stands_at(page, 6)


def test_keys_in_a_figure_stay_the_figures(reader: Callable[..., Reader]) -> None:
    """Arrows move a focused handle, keys a slider, and Space presses a button; other keys turn the slides."""
    page = page_of(reader, f"{DECK}#7")
    wrong = Figure(page, "fig-wrong").live().settled()
    before = wrong.record()
    wrong.handle("source").focus()
    page.keyboard.press("ArrowRight")
    wrong.settled()
    assert wrong.record()["log"] != before["log"]
    slider = wrong.control("wrong")
    slider.focus()
    for key, value in (("ArrowRight", "4"), ("Home", "0"), ("End", "6")):
        page.keyboard.press(key)
        expect(slider).to_have_value(value)
    stands_at(page, 7)
    wrong.button("reset").focus()
    frames = wrong.settled().frames()
    page.keyboard.press("Space")
    until(page, f"Number(document.querySelector('#fig-wrong').dataset.frame) > {frames}")
    stands_at(page, 7)
    page.keyboard.press("ArrowRight")  # a button does not use it
    stands_at(page, 8)
    page.goto(f"{page.url.split('#')[0]}#6")
    switch = Figure(page, "fig-mirror").control("correct")
    switch.focus()
    page.keyboard.press("Space")
    expect(switch).not_to_be_checked()
    stands_at(page, 6)


def test_a_figure_on_a_slide_is_the_chapters(reader: Callable[..., Reader]) -> None:
    """Off screen it loads nothing; on its slide it draws the chapter's exact bytes, live, and its links work."""
    visitor = reader(1280, 720, reduced_motion="reduce")
    drawings = {}
    for path in ("kabsch.html", DECK):
        page = visitor.open(path)
        solve = Figure(page, "fig-solve")
        if path == DECK:
            until(page, "document.readyState === 'complete'")
            assert page.locator("script[src^='tapes/']").count() == 0
            expect(page.locator("html")).to_have_attribute("data-runtime", "idle")
            page.goto(f"{page.url.split('#')[0]}#5")
        assert solve.live().root.get_attribute("data-widget") == "kabsch"
        drawings[path] = [solve.root.locator(".figure-panel svg").evaluate("svg => svg.outerHTML")]
        solve.set("scene", "noisy")
        solve.settled().button("solve").click()
        solve.becomes("live").settled()
        drawings[path] += [panel["svg"] for panel in solve.frame()["panels"]]
        readouts = page.evaluate("[...document.querySelectorAll('#fig-solve .readout')].map(e => e.dataset.readout)")
        link = page.evaluate("Ladder.figures.get('fig-solve').link()")
    assert drawings[DECK] == drawings["kabsch.html"]
    assert readouts == ["rms", "rms_truth", "rotation_error", "spread"]
    second = visitor.open(link.rpartition("/")[2])
    stands_at(second, 5)
    expect(second.locator("#fig-solve [name=scene][value=noisy]")).to_be_checked()
    assert "?s=" in second.url


def test_a_finger_turns_the_slides(reader: Callable[..., Reader]) -> None:
    """A swipe across words turns a slide, one on a picture or slider does not; vertical swipes scroll."""
    page = page_of(reader, f"{DECK}#5", 1280, 720, has_touch=True)
    stands_at(page, 5)
    touch = page.context.new_cdp_session(page)

    def swipe(x: float, y: float, dx: float, dy: float = 0) -> None:
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
        for part in (0.25, 0.5, 0.75, 1):
            at = {"x": x + part * dx, "y": y + part * dy}
            touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [at]})
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    swipe(1100, 140, -200)
    stands_at(page, 6)
    swipe(900, 140, 200)
    stands_at(page, 5)
    box = page.locator("#fig-solve .figure-stage").bounding_box()
    assert box is not None
    swipe(box["x"] + 40, box["y"] + 30, 300)
    swipe(1100, 140, -20)
    page.keyboard.press("ArrowRight")  # had one of these swipes counted, the next slide would be another
    stands_at(page, 6)


def test_notes_and_overview(reader: Callable[..., Reader]) -> None:
    """N shows the notes beside the slide, and handles stay where they are drawn; Escape shows all slides, where arrows
    and Enter choose one and nothing on a slide can be reached."""
    page = page_of(reader, f"{DECK}#5")
    solve = Figure(page, "fig-solve").live().settled()
    notes = page.locator("[id='5'] .slide-notes")
    expect(notes).to_be_hidden()
    page.keyboard.press("n")
    expect(notes).to_be_visible()
    expect(page.get_by_role("button", name="Notes")).to_have_attribute("aria-pressed", "true")
    assert remaining(page, BEYOND) == []
    before = solve.record()["log"]
    solve.drag("source", 60, 0)
    solve.settled()
    (kind, name, x, _) = solve.record()["log"][-1]
    assert (before, kind, name) == ([], "drag", "source")
    width = page.locator("#fig-solve svg.panel").evaluate("svg => svg.getBoundingClientRect().width")
    assert x == pytest.approx(-2.883 + 60 * 12 / width, abs=0.03)
    middle = solve.handle("source").evaluate(
        "e => (r => r.left + r.width / 2)(e.getBoundingClientRect()) - "
        "document.querySelector('#fig-solve svg.panel').getBoundingClientRect().left"
    )
    assert middle == pytest.approx((x + 6) / 12 * width, abs=1.5), "the handle lies where its point is drawn"
    page.keyboard.press("n")
    expect(notes).to_be_hidden()

    page.keyboard.press("Escape")
    links = page.locator(".slide-open")
    expect(links.nth(4)).to_be_focused()
    assert page.evaluate("document.querySelector('#fig-solve').closest('[inert]') !== null")
    tops = page.locator(".slide").evaluate_all("all => all.map(e => Math.round(e.getBoundingClientRect().top))")
    assert max(tops) < 720, "all of them on one screen"
    page.keyboard.press("ArrowRight")
    expect(links.nth(5)).to_be_focused()
    page.keyboard.press("Enter")
    stands_at(page, 6)
    page.go_back()
    stands_at(page, 5)
    page.keyboard.press("Escape")
    links.nth(1).click()
    stands_at(page, 2)
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    stands_at(page, 2)
    expect(page.locator("[id='2']")).to_be_focused()


def test_the_bar_moves_the_focus_through_the_overview(reader: Callable[..., Reader]) -> None:
    """From the slide that last had it, one on or back; Home and End too. Closed, the overview leaves it on the slide,
    however that was reached."""
    page = page_of(reader, f"{DECK}#5")
    links = page.locator(".slide-open")
    page.keyboard.press("Escape")
    for button, slide in (("after", 6), ("after", 7), ("before", 6)):
        page.locator(f'.deck-bar [data-slides="{button}"]').click()
        expect(links.nth(slide - 1)).to_be_focused()
    for key, slide in (("Home", 1), ("End", links.count())):
        page.keyboard.press(key)
        expect(links.nth(slide - 1)).to_be_focused()
    page.keyboard.press("Escape")
    stands_at(page, 5)
    expect(page.locator("[id='5']")).to_be_focused()


def test_a_deck_works_where_no_channel_is_allowed(reader: Callable[..., Reader]) -> None:
    """As in Firefox without cookies: only the second window is missing."""
    visitor = reader(1280, 720, alone=True, reduced_motion="reduce")
    visitor.context.add_init_script("""globalThis.BroadcastChannel = class {
      constructor() { throw new DOMException("The operation is insecure.", "SecurityError"); }
    };""")
    page = visitor.open(f"{DECK}#2")
    stands_at(page, 2)
    page.keyboard.press("ArrowRight")
    stands_at(page, 3)
    page.locator('.deck-bar [data-slides="after"]').click()
    stands_at(page, 4)
    expect(page.locator('.deck-bar [data-slides="second"]')).to_be_hidden()


def test_a_second_window_goes_along(reader: Callable[..., Reader]) -> None:
    """The notes are in a separate window, in step in both directions."""
    page = page_of(reader, f"{DECK}#2")
    with page.expect_popup() as opening:
        page.get_by_role("button", name="Second window").click()
    second = opening.value
    stands_at(second, 2)
    expect(second.locator("[id='2'] .slide-notes")).to_be_visible()
    page.keyboard.press("ArrowRight")
    stands_at(second, 3)
    second.keyboard.press("ArrowRight")
    stands_at(page, 4)


def test_the_screen_is_filled(reader: Callable[..., Reader]) -> None:
    page = page_of(reader, f"{DECK}#3")
    full = page.get_by_role("button", name="Full screen")
    page.keyboard.press("f")
    expect(full).to_have_attribute("aria-pressed", "true")
    assert page.evaluate("document.fullscreenElement === document.documentElement")
    page.keyboard.press("f")
    expect(full).to_have_attribute("aria-pressed", "false")
    stands_at(page, 3)


def test_without_scripts_and_from_disk(reader: Callable[..., Reader], site: Path) -> None:
    """Without scripts, a column that scrolls, whose numbers are addresses; from disk, with keys and recorded frames."""
    plain = page_of(reader, f"{DECK}#5", java_script_enabled=False)
    expect(plain.locator("[id='5'] h2")).to_be_in_viewport()
    expect(plain.locator(".deck-steps")).to_be_hidden()
    expect(plain.locator("[id='5'] svg.panel")).to_be_visible()
    assert plain.locator("h1").count() == 1
    visitor = reader(1280, 720, reduced_motion="reduce")
    visitor.expect("Access to font", "ERR_FAILED", "A preload for")  # as on every page opened from disk
    page = visitor.page()
    page.goto((site / DECK).as_uri())
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    stands_at(page, 5)
    solve = Figure(page, "fig-solve")
    start = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", start)
    solve.becomes("tape")
    expect(page.get_by_role("button", name="Second window")).to_be_hidden()
    page.keyboard.press("n")
    expect(page.locator("[id='5'] .slide-notes")).to_be_visible()


def test_on_paper_a_slide_is_a_page(reader: Callable[..., Reader]) -> None:
    """Landscape pages, as many as slides; taller ones if the notes are shown; no buttons."""
    page = page_of(reader, DECK)
    count = page.locator(".slide").count()

    def pages() -> set[str]:
        paper = page.pdf(prefer_css_page_size=True)
        assert len(re.findall(rb"/Type\s*/Page\b", paper)) == count
        return {box.decode() for box in re.findall(rb"/MediaBox\s*\[([^\]]*)\]", paper)}

    assert pages() == {"0 0 841.91998 473.03998"}
    page.keyboard.press("n")
    assert pages() == {"0 0 841.91998 594.95996"}
    page.emulate_media(media="print")
    for selector in (".deck-bar", "#fig-solve .buttons", "#fig-solve .controls", ".figure-handles"):
        expect(page.locator(selector).first).to_be_hidden()
    expect(page.locator("[id='5'] .slide-notes")).to_be_visible()


def test_a_phone_scrolls_through(reader: Callable[..., Reader]) -> None:
    """Slides are as tall as their content and do not snap, but can still be stepped through; the overview is a list."""
    page = page_of(reader, "slides-icp.html", 390, 844, has_touch=True)
    assert page.evaluate("getComputedStyle(document.documentElement).scrollSnapType") == "none"
    heights = page.locator(".slide").evaluate_all("all => all.map(e => e.scrollHeight - e.clientHeight)")
    assert set(heights) == {0}, "nothing hidden"
    for number in range(2, page.locator(".slide").count() + 1):
        page.get_by_role("button", name="Next slide").tap()
        stands_at(page, number)
    page.get_by_role("button", name="Overview").tap()
    page.locator(".slide-open").nth(2).tap()
    stands_at(page, 3)
    page.get_by_role("button", name="Notes").tap()
    expect(page.locator("[id='3'] .slide-notes")).to_be_visible()
    assert remaining(page, BEYOND) == []


def test_axe_finds_nothing_on_a_deck(reader: Callable[..., Reader]) -> None:
    """With a live figure and the notes shown, in the overview, on a phone; colours once more in the other theme."""
    page = page_of(reader, f"{DECK}#5", color_scheme="light")
    Figure(page, "fig-solve").live()
    page.keyboard.press("n")
    faults = [*violations(page, "notes")]
    page.emulate_media(color_scheme="dark")
    faults += violations(page, "dark", runOnly={"type": "rule", "values": ["color-contrast"]})
    page.keyboard.press("Escape")
    faults += violations(page, "overview")
    page.keyboard.press("Escape")
    page.set_viewport_size({"width": 390, "height": 844})
    faults += violations(page, "narrow")
    assert not faults, "\n".join(faults)
