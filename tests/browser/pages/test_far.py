"""What is far from what is seen is not drawn, and nobody can tell: heights, addresses, search and paper stay."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader

FAR = "document.querySelectorAll('[data-far]').length > 3"
# Every part's top and height while what is far is skipped, and again with all of it drawn.
MOVED = """() => {
  const parts = [...document.querySelectorAll('.text > *, .onward, .chapter-footer, .site-footer')];
  const boxes = () => parts.map(e => e.getBoundingClientRect()).map(({ top, height }) => [top, height]);
  const skipped = boxes();
  document.querySelectorAll('[data-far]').forEach(e => e.removeAttribute('data-far'));
  const drawn = boxes();
  const far = i => drawn[i].some((value, k) => Math.abs(value - skipped[i][k]) > 0.1);
  return parts.filter((_, i) => far(i)).map(e => `${e.localName}.${e.className} ${e.textContent.slice(0, 40)}`);
}"""


def far(page: Page) -> Page:
    until(page, FAR)
    return page


@pytest.mark.parametrize("width", [1280, 390])
def test_what_is_skipped_keeps_its_height(reader: Callable[..., Reader], pages: list[str], width: int) -> None:
    one = reader(width, 800)
    page = one.open()
    for path in pages if width == 1280 else ["icp.html", "drive.html", "four.html"]:
        page.goto(f"{one.origin}/{path}", wait_until="load")
        page.evaluate("document.fonts.ready.then(() => new Promise(done => setTimeout(done, 100)))")
        assert page.evaluate(MOVED) == [], path


def test_a_new_width_is_laid_out_before_anything_is_skipped(reader: Callable[..., Reader]) -> None:
    """Heights that were remembered belong to the old width."""
    page = far(reader(1280, 800).open("icp.html"))
    page.set_viewport_size({"width": 700, "height": 800})
    page.evaluate("new Promise(done => setTimeout(done, 300))")
    far(page)
    assert page.evaluate(MOVED) == []


def test_an_address_leads_to_what_is_far(reader: Callable[..., Reader]) -> None:
    """To a figure near the end and to a part within one; it stands at the top and the page stays there."""
    page = far(reader(1280, 800).open("icp.html"))
    for name in ("fig-wall", "fig-dial-nearest-more", "notebook"):
        page.evaluate("name => { location.hash = name; }", name)
        expect(page.locator(f"#{name}")).to_be_in_viewport()
        top = page.locator(f"#{name}").evaluate("e => e.getBoundingClientRect().top")
        page.evaluate("new Promise(done => setTimeout(done, 200))")
        assert abs(page.locator(f"#{name}").evaluate("e => e.getBoundingClientRect().top") - top) < 1
        page.evaluate("scrollTo({ top: 0, behavior: 'instant' })")
        far(page)


def test_the_browser_finds_words_that_are_far(reader: Callable[..., Reader]) -> None:
    page = far(reader(1280, 800).open("icp.html"))
    last = page.locator(".text > p[data-far]").last
    words = " ".join((last.text_content() or "").split()[:3])
    assert page.evaluate("words => find(words)", words)
    assert page.evaluate("scrollY") > 1000


def test_paper_has_all_of_it(reader: Callable[..., Reader]) -> None:
    page = far(reader(1280, 800).open("icp.html"))
    page.emulate_media(media="print")
    skipped = "[...document.querySelectorAll('[data-far]')].map(e => getComputedStyle(e).contentVisibility)"
    assert set(page.evaluate(skipped)) == {"visible"}
