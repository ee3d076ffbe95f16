"""Texts around a figure: they keep their place, appear in time and name their units."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.layout import CUT, FRAMES, SIDEWAYS, remaining


def test_notes_fit_the_status_line_of_a_phone(reader: Callable[..., Reader]) -> None:
    """Whatever Solve reports, nothing below it moves."""
    solve = Figure(reader(390, 844).open("kabsch.html"), "fig-solve").live()
    line = solve.root.locator(".figure-status")
    empty = line.evaluate("node => node.getBoundingClientRect().height")
    for scene, wrong, correct in [("noisy", "0", True), ("outliers", "6", True), ("reflect", "0", False)]:
        solve.set("scene", scene)
        solve.set("wrong", wrong)
        solve.set("correct", correct)
        solve.settled().button("solve").click()
        expect(line).to_contain_text("Solved")
        assert line.evaluate("node => node.getBoundingClientRect().height") == empty, line.inner_text()


@pytest.mark.parametrize("page", ["kabsch.html", "search.html", "drive.html"])
def test_a_tablet_shows_lines_of_code_whole(reader: Callable[..., Reader], page: str) -> None:
    """Where no margin stands beside the text, code takes its place; short code is as wide as the text."""
    blocks = reader(1024, 768).open(page).locator(".text > pre")
    assert blocks.count()
    for block in blocks.all():
        width, whole, text = block.evaluate("e => [e.clientWidth, e.scrollWidth, e.previousElementSibling.clientWidth]")
        assert width >= max(whole, text)


def test_an_answer_that_takes_long_is_announced(reader: Callable[..., Reader]) -> None:
    """A request that is never answered is acknowledged at once."""
    solve = Figure(reader().open("kabsch.html"), "fig-solve").live().settled()
    solve.page.evaluate("Ladder.runtime.kill()")
    solve.button("new").click()
    expect(solve.root.locator(".figure-status")).to_have_text("Python is working on this.", timeout=5000)


def test_a_column_of_pinned_runs_keeps_its_unit(reader: Callable[..., Reader]) -> None:
    """The error of a reflection has no unit; that of the rotation pinned before it has."""
    mirror = Figure(reader().open("kabsch.html"), "fig-mirror").live()
    pin = mirror.reached("[data-pin]")
    mirror.button("solve").click()
    mirror.changes("rotation_error", "75.0")
    pin.click()
    mirror.set("correct", False)
    mirror.shows("rotation_error", "not a rotation")
    pin.click()
    heads = mirror.root.locator(".runs thead th").all_inner_texts()
    assert "Rotation error (°)" in heads
    assert "Translation error (u)" in heads


def test_after_a_touch_a_link_with_a_card_is_still_followed_by_key(reader: Callable[..., Reader]) -> None:
    """The first tap shows the card; Enter follows the link at once, whatever was touched before."""
    page = reader(has_touch=True).open("kabsch.html")
    link = page.locator("a.cite[data-card]").last
    page.locator("h1").tap()
    link.tap()
    expect(page.locator(f"#{link.get_attribute('data-card')}")).to_be_visible()
    page.locator("h1").tap()
    link.focus()
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile("#ref-|references"))


def test_a_pointer_at_rest_does_not_close_the_card_of_a_focused_citation(reader: Callable[..., Reader]) -> None:
    """A keyboard user's pointer rests somewhere, and the page scrolls under it."""
    visitor = reader(alone=True)  # the clock belongs to the whole context
    visitor.context.clock.install()
    page = visitor.open("kabsch.html")
    link = page.locator("a.cite[data-card]").last
    link.focus()
    card = page.locator(f"#{link.get_attribute('data-card')}")
    expect(card).to_be_in_viewport()
    for x in (300, 320):
        page.mouse.move(x, 400)
    visitor.context.clock.run_for(5000)
    expect(card).to_be_visible()
    page.keyboard.press("Escape")
    expect(card).to_be_hidden()


def test_the_pages_own_rung_is_in_sight_on_a_phone(reader: Callable[..., Reader]) -> None:
    """Not all rungs fit side by side: the ladder scrolls to the page's own rung, and the page does not scroll."""
    page = reader(390, 844).open("ndt-climb.html")
    rung = page.locator(".ladder [aria-current]")
    expect(rung).to_be_in_viewport()
    box = rung.bounding_box()
    assert box is not None
    assert 120 < box["x"] + box["width"] / 2 < 270
    assert page.evaluate("scrollX") == 0


def test_an_equation_too_wide_for_its_column_can_be_reached_by_key(reader: Callable[..., Reader]) -> None:
    """It can be focused if it is cut off; if it fits, it is not a tab stop."""
    page = reader(240, 844).open("kabsch.html")
    wide = page.locator(".formula[tabindex='0']").first
    wide.focus()
    expect(wide).to_be_focused()
    page.set_viewport_size({"width": 1280, "height": 800})
    expect(page.locator(".formula[tabindex]")).to_have_count(0)


@pytest.mark.parametrize(
    ("page", "name", "size"),
    [
        ("mmd.html", "fig-dial-means", (390, 844)),
        ("ransac.html", "fig-repeated", (390, 844)),
        ("icp.html", "fig-atlas", (1024, 768)),
    ],
)
def test_a_turned_screen_keeps_what_is_in_the_middle(
    reader: Callable[..., Reader], page: str, name: str, size: tuple[int, int]
) -> None:
    """At least half of a picture, or of the window, when a phone or tablet is turned and turned back. At the top of the
    page it stays there."""
    tab = reader(*size, reduced_motion="reduce").open(page)
    tab.evaluate("Ladder.alive")
    stage = Figure(tab, name).root.locator(".figure-stage")
    for begin in (
        "scrollTo({ top: 0, behavior: 'instant' })",
        "stage.scrollIntoView({ block: 'center', behavior: 'instant' })",
        "scrollTo({ top: 0, behavior: 'instant' })",
    ):
        stage.evaluate(f"""stage => new Promise((done) => {{
          const before = scrollY;
          addEventListener("scrollend", done, {{ once: true }});
          {begin};
          if (scrollY === before) done();
        }})""")
        for width, height in (size[::-1], size):
            tab.set_viewport_size({"width": width, "height": height})
            tab.evaluate(FRAMES)
            top, bottom = stage.evaluate("e => (({ top, bottom }) => [top, bottom])(e.getBoundingClientRect())")
            if begin.startswith("scrollTo"):
                assert tab.evaluate("scrollY") == 0
            else:
                assert min(bottom, height) - max(top, 0) > min(bottom - top, height) / 2, (top, bottom, height)


def figure_on_its_side(tab: Page, scrolled: str) -> tuple[float, float]:
    """Scroll a figure's controls to the middle of an upright phone, and turn it: the figure's top and bottom.

    scrolled: the script that calls `done` once the scroll is over.
    """
    figure = Figure(tab, "fig-repeated").root
    figure.locator(".controls").first.evaluate(f"""e => new Promise((done) => {{
      {scrolled};
      e.scrollIntoView({{ block: "center", behavior: "instant" }});
    }})""")
    tab.set_viewport_size({"width": 844, "height": 390})
    tab.evaluate(FRAMES)
    top, bottom = figure.evaluate("e => (({ top, bottom }) => [top, bottom])(e.getBoundingClientRect())")
    return top, bottom


def test_a_turned_phone_keeps_the_figure_whose_controls_are_in_the_middle(reader: Callable[..., Reader]) -> None:
    """On its side, a figure's desk has no box of its own; its parts have."""
    tab = reader(390, 844, reduced_motion="reduce").open("ransac.html")
    tab.evaluate("Ladder.alive")
    top, bottom = figure_on_its_side(tab, 'addEventListener("scrollend", done, { once: true })')
    assert top < 390 / 2 < bottom


def test_a_browser_that_tells_no_end_of_a_scroll_keeps_the_place_too(reader: Callable[..., Reader]) -> None:
    """Some tell each step of a scroll and not its end."""
    visitor = reader(390, 844, alone=True, reduced_motion="reduce")
    visitor.context.add_init_script("delete globalThis.onscrollend;")
    tab = visitor.open("ransac.html")
    once = 'addEventListener("scroll", () => requestAnimationFrame(done), { once: true })'
    top, bottom = figure_on_its_side(tab, once)
    assert top < 390 / 2 < bottom


@pytest.mark.parametrize("page", ["kabsch.html", "mmd.html", "ransac.html", "soft.html", "space.html"])
def test_a_formula_in_large_text_does_not_move_the_page(reader: Callable[..., Reader], page: str) -> None:
    """At half a phone's width, which is its width with text at twice the size: a wide formula scrolls in its paragraph,
    with nothing above or below it cut off."""
    tab = reader(195, 422, reduced_motion="reduce").open(page)
    assert remaining(tab, SIDEWAYS) == []
    cut = "getComputedStyle(e).overflowY === 'hidden' && e.scrollHeight > e.clientHeight + 1"
    assert tab.locator(".text p:has(> math, > .held)").evaluate_all(f"all => all.filter(e => {cut}).length") == 0


@pytest.mark.parametrize("page", ["about.html", "docs-style.html"])
def test_long_words_in_large_text_do_not_move_the_page(reader: Callable[..., Reader], page: str) -> None:
    tab = reader(195, 422).open(page)
    assert remaining(tab, SIDEWAYS) == []


@pytest.mark.parametrize("page", ["icp.html", "landscape.html", "mmd.html", "ransac.html", "search.html"])
def test_charts_keep_their_words_in_large_text(reader: Callable[..., Reader], page: str) -> None:
    """They used to grow as the panel shrinks: beyond its edge, and the numbers of an axis over one another."""
    tab = reader(195, 422, reduced_motion="reduce").open(page)
    assert remaining(tab, CUT) == []


SELECT = """([first, last]) => {
  const [from, to] = [first, last].map(s => document.querySelector(s));
  getSelection().setBaseAndExtent(from, 0, to, to.childNodes.length);
}"""
AROUND = "[...document.querySelectorAll('main .text > :has(math)')].map(e => e.textContent)"
DISPLAYED = r"E(T) = \sum_{i=1}^{m} \min_j \, \lVert T p_i - q_j \rVert^2 ."


@pytest.mark.parametrize(
    ("ends", "lines"),
    [
        (["#objective + p"] * 2, ["Let T be the pose, p_1,…,p_m the source and q_1,…,q_n the target. ICP’s"]),
        (["#eq-closest .formula"] * 2, [DISPLAYED]),
        (["#eq-closest mo", "#eq-closest msup"], [DISPLAYED]),
        (["#eq-closest msup", "#eq-closest + p"], [DISPLAYED, "The minimum inside hides a second unknown: which"]),
    ],
)
def test_copied_text_has_its_formulas_in_one_line(
    reader: Callable[..., Reader], ends: list[str], lines: list[str]
) -> None:
    """As TeX has them, also if the selection begins or ends inside one; the page stays as it was."""
    visitor = reader(permissions=["clipboard-read", "clipboard-write"])
    tab = visitor.open("icp.html")
    before = tab.evaluate(AROUND)
    tab.evaluate(SELECT, ends)
    tab.keyboard.press("Control+c")
    copied = tab.evaluate("navigator.clipboard.readText()").splitlines()
    expect(tab.locator("math[style*=display]")).to_have_count(0)
    for line in lines:
        assert any(found.startswith(line) for found in copied), copied
    assert tab.evaluate(AROUND) == before


@pytest.mark.parametrize(
    ("page", "parts"),
    [
        ("kabsch.html", ["H=UΛV^⊤", "tr(RH)=tr(MΛ)=∑_km_{kk}λ_k", "p̃_i=p_i−p̄", "det M=−1", "σ/√{∑_i‖p̃_i‖^2}", "σ/√n"]),
        ("mmd.html", ["μ_X(ω)=1/m∑_je^{iω^⊤x_j}"]),
        ("uncertainty.html", ["T=exp(ξ) T̂.", "through exp, the"]),
    ],
)
def test_a_whole_page_is_copied_with_its_formulas_as_one_writes_them(
    reader: Callable[..., Reader], page: str, parts: list[str]
) -> None:
    """Fractions, roots, accents, and names like det: a bracket may follow those at once, a letter does not."""
    visitor = reader(permissions=["clipboard-read", "clipboard-write"])
    tab = visitor.open(page)
    tab.keyboard.press("Control+a")
    tab.keyboard.press("Control+c")
    copied = tab.evaluate("navigator.clipboard.readText()")
    assert [part for part in parts if part not in copied] == []


def test_what_is_said_to_screen_readers_is_not_copied(reader: Callable[..., Reader]) -> None:
    """A figure's status line is copied once, though it is also announced."""
    visitor = reader(permissions=["clipboard-read", "clipboard-write"])
    tab = visitor.open("kabsch.html")
    figure = Figure(tab, "fig-solve").live()
    figure.button("solve").click()
    figure.settled()
    voice, status = figure.root.locator(".figure-voice"), figure.root.locator(".figure-status")
    expect(voice).not_to_be_empty()
    said = status.inner_text()
    assert said
    assert said in voice.inner_text()
    tab.evaluate(SELECT, ["#fig-solve .figure-lead", "#fig-solve figcaption"])
    tab.keyboard.press("Control+c")
    copied = tab.evaluate("navigator.clipboard.readText()")
    assert copied.count(said) == 1, copied


def test_translators_leave_formulas_and_code_alone(reader: Callable[..., Reader]) -> None:
    """Also the Python of a figure that has been used; the words around them are for translators."""
    page = reader().open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    solve.button("solve").click()
    solve.settled()
    symbols = page.locator("main :is(math, code)")
    assert symbols.count() > 50
    assert not any(symbols.evaluate_all("nodes => nodes.map(node => node.translate)"))
    words = page.locator("main :is(p, h2, button, td)")
    assert all(words.evaluate_all("nodes => nodes.map(node => node.translate)"))
