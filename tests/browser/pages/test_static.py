"""Before any script runs: every page is complete."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, figures
from tests.browser.layout import CUT, LATE_FONTS, SIDEWAYS, SMALL_TEXT, UNUSED_FONTS, remaining

SHIFT = """() => new Promise(done => {
  let moved = 0;
  new PerformanceObserver(list => { for (const e of list.getEntries()) if (!e.hadRecentInput) moved += e.value; })
    .observe({type: 'layout-shift', buffered: true});
  requestAnimationFrame(() => requestAnimationFrame(() => done(moved)));
})"""


@pytest.mark.parametrize("width", [1280, 390])
def test_every_page_is_complete_without_scripts(reader: Callable[..., Reader], pages: list[str], width: int) -> None:
    """Text, mathematics and every figure are there with scripts switched off, and nothing overflows."""
    one = reader(width, java_script_enabled=False)
    for name in pages:
        page = one.open(name)
        assert page.locator("h1").count() == 1, name
        assert page.title().strip()
        for figure in figures(page):
            drawings = figure.root.locator("svg.plot")
            assert drawings.count() >= 1, f"{name}#{figure.name}: nothing drawn"
            for i in range(drawings.count()):
                assert drawings.nth(i).locator("path").count() > 1, f"{name}#{figure.name}: an empty drawing"
            expect(figure.root.locator(".buttons:visible, form.controls:visible")).to_have_count(0)
            assert figure.root.locator("figcaption").inner_text().startswith("Figure")
        page.close()


def test_mathematics_is_rendered_at_build_time(reader: Callable[..., Reader]) -> None:
    """The chapter on known pairs holds MathML and numbered equations, and no dollar signs left over."""
    page = reader(java_script_enabled=False).open("kabsch.html")
    assert page.locator("math").count() > 10
    assert page.locator("main").inner_text().count("$") == 0


def test_nothing_overflows_or_moves(reader: Callable[..., Reader], pages: list[str]) -> None:
    """No page shifts while it becomes alive or uses an id twice; at any width none scrolls sideways, has tiny text or
    cuts off a label."""
    one = reader(390)
    for name in pages:
        page = one.open(name)
        for figure in figures(page):
            figure.live()
        assert page.evaluate(SHIFT) < 0.001, f"{name} shifts"
        assert page.evaluate(LATE_FONTS) == [], f"{name} asks for a font after its styles are read: it may shift"
        assert page.evaluate(UNUSED_FONTS) == [], f"{name} asks for a font ahead of need that it does not use"
        twice = page.evaluate(
            "(ids => ids.filter((x, i) => ids.indexOf(x) !== i))([...document.querySelectorAll('[id]')].map(e => e.id))"
        )
        assert twice == [], name
        for width in (390, 768, 1280):
            page.set_viewport_size({"width": width, "height": 1000})
            assert remaining(page, SIDEWAYS) == [], f"{name} at {width}"
            assert remaining(page, SMALL_TEXT) == [], f"{name} at {width}"
            assert remaining(page, CUT) == [], f"{name} at {width}"
        page.close()


def test_figure_numbers_and_anchors_agree(reader: Callable[..., Reader]) -> None:
    """A link to a figure leads to the figure with that number."""
    page = reader().open("kabsch.html")
    links = page.locator('main a.ref[href^="#fig-"]').all()
    assert links
    for link in links:
        target = (link.get_attribute("href") or "#")[1:]
        assert Figure(page, target).root.locator(".figure-number").text_content() == link.text_content()
