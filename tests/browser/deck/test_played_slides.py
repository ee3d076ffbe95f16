"""A slide whose figure has run: its words, captions and legend fit the screen as before."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.deck.test_slides import page_of
from tests.browser.figure import Figure
from tests.browser.layout import CUT, MISFITS, remaining

# Captions wider than their panels.
WIDE_CAPTIONS = """() => [...document.querySelectorAll('.slide .panel-caption > *')].filter(e =>
  e.checkVisibility() && e.getBoundingClientRect().right > e.closest('.figure-panel').getBoundingClientRect().right + 1)
  .map(e => `wider than its panel: ${e.textContent}`)"""
# Legends that overlap a picture.
COVERED = """() => [...document.querySelectorAll('.slide .legend')].flatMap(legend =>
  [...legend.closest('.slide').querySelectorAll('.figure-panel:not([hidden])')].filter(panel =>
    panel.getBoundingClientRect().bottom > legend.getBoundingClientRect().top + 1)
  .map(panel => `${legend.closest('.slide').id}: the legend lies on ${panel.dataset.panel}`))"""

# Words of a chart that its left edge cuts off, or that lie on a line of its key.
CUT_KEY = """() => [...document.querySelectorAll('#fig-three [data-panel=errors] text')].filter(word => {
  const svg = word.closest('svg'), r = word.getBoundingClientRect();
  const lines = [...svg.querySelectorAll('path.line:not(.guide)')].map(e => e.getBoundingClientRect());
  return r.left < svg.getBoundingClientRect().left || lines.some(line =>
    line.width && line.right > r.left && line.left < r.right && line.bottom > r.top && line.top < r.bottom);
}).map(word => word.textContent)"""


@pytest.mark.parametrize(
    ("deck", "figure"), [("four", "fig-four"), ("mmd", "fig-waves"), ("race", "fig-race"), ("search", "fig-everywhere")]
)
def test_a_slide_fits_after_the_run(reader: Callable[..., Reader], deck: str, figure: str) -> None:
    """With the longest status, the longest captions, and the full legend."""
    page = page_of(reader, f"slides-{deck}.html")
    run = Figure(page, figure).live()
    if "finish" not in run.frame()["disabled"]:
        run.button("finish").click()
        run.settled()
    assert "finish" in run.frame()["disabled"]
    for width, height in [(1280, 720), (1024, 768), (1920, 1080)]:
        page.set_viewport_size({"width": width, "height": height})
        assert remaining(page, MISFITS, CUT, WIDE_CAPTIONS, COVERED) == [], (width, height)


def test_a_chart_among_four_panels_is_whole(reader: Callable[..., Reader]) -> None:
    """Its longest number is not cut off, and the lines of its key end before their names."""
    page = page_of(reader, "slides-surfaces.html")
    for width, height in [(1280, 720), (1024, 768), (1920, 1080)]:
        page.set_viewport_size({"width": width, "height": height})
        assert remaining(page, CUT_KEY) == [], (width, height)


def test_charts_beside_two_maps_share_a_row(reader: Callable[..., Reader]) -> None:
    """On a tablet too; in two rows they used to push the legend under the bar."""
    page = page_of(reader, "slides-ndt-climb.html", 1024, 768)
    assert remaining(page, MISFITS, CUT, COVERED) == []


def test_a_button_keeps_its_width_while_it_says_pause(reader: Callable[..., Reader]) -> None:
    """Beside the notes too, where the slide is scaled."""
    page = page_of(reader, "slides-icp.html#3")
    run = Figure(page, "fig-nearest").live().settled().button("run")
    page.keyboard.press("n")
    before = run.bounding_box()
    run.click()
    expect(run).to_have_text("Pause")
    during = run.bounding_box()
    assert before
    assert during
    assert during["width"] == pytest.approx(before["width"], abs=0.5)
