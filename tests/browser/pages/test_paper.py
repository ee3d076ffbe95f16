"""Paper scrolls nowhere: what is wider than the text is printed whole."""

from __future__ import annotations

from collections.abc import Callable

from tests.browser.conftest import Reader

WIDTH = 642  # px: A4 within the margins of print.css
# What would have to be scrolled, or goes over the paper's edge.
CUT = """() => [...document.querySelectorAll('main :is(.table, .formula, pre, table)')]
  .filter(e => e.checkVisibility()).flatMap(e => {
    const scrolls = getComputedStyle(e).overflowX !== 'visible' && e.scrollWidth > e.clientWidth;
    const beyond = e.getBoundingClientRect().left + e.scrollWidth > document.documentElement.clientWidth;
    return scrolls || beyond ? [`${e.className || e.localName}: ${e.textContent.trim().slice(0, 40)}`] : [];
  })"""


def test_wide_tables_are_printed_whole(reader: Callable[..., Reader]) -> None:
    page = reader(width=WIDTH, height=900).open("reference.html")
    page.emulate_media(media="print")
    assert page.locator(".table table").count() > 20
    assert page.evaluate(CUT) == []
