"""Plots in a browser: one drawing per width, legible type, words and numbers below."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.browser.conftest import Reader

# For the visible drawing: which it is, its smallest type in screen px, and the texts that extend beyond it.
SEEN = """root => {
  const shown = [...root.querySelectorAll('.plot-svg')].filter(svg => svg.getBoundingClientRect().width > 0);
  const [svg] = shown, box = svg.getBoundingClientRect(), scale = box.width / svg.viewBox.baseVal.width;
  const texts = [...svg.querySelectorAll('text')];
  const leaves = text => { const b = text.getBoundingClientRect();
    return b.left < box.left - 1 || b.right > box.right + 1 || b.top < box.top - 1 || b.bottom > box.bottom + 1; };
  return { count: shown.length, kind: svg.parentElement.className, width: box.width,
    smallest: Math.min(...texts.map(text => scale * parseFloat(getComputedStyle(text).fontSize))),
    outside: texts.filter(leaves).map(text => text.textContent) };
}"""


@pytest.fixture(scope="session")
def with_plots(site: Path, pages: list[str]) -> list[str]:
    """The pages that contain plots."""
    return [name for name in pages if 'class="plot wide"' in (site / name).read_text("utf-8")]


@pytest.mark.parametrize(("width", "kind"), [(1280, "plot-wide"), (390, "plot-narrow")])
def test_each_width_has_a_drawing_that_can_be_read(
    reader: Callable[..., Reader], with_plots: list[str], width: int, kind: str
) -> None:
    """Type of at least 11 px inside the drawing, at both widths; the page does not scroll sideways."""
    visitor = reader(width, java_script_enabled=True)
    assert len(with_plots) >= 6
    for name in with_plots:
        page = visitor.open(name)
        plots = page.locator("figure.plot").all()
        assert plots, name
        for root in plots:
            facts = root.evaluate(SEEN)
            assert (facts["count"], facts["kind"]) == (1, kind), name
            assert facts["smallest"] >= 11.0, (name, facts)
            assert facts["outside"] == [], (name, facts)
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.close()


def test_paper_gets_the_wide_drawing(reader: Callable[..., Reader], with_plots: list[str]) -> None:
    """Printed on an A4 page with its margins."""
    page = reader(642).open(with_plots[0])
    page.emulate_media(media="print")
    assert page.locator("figure.plot").first.evaluate(SEEN)["kind"] == "plot-wide"


def test_words_and_numbers_stand_beneath(reader: Callable[..., Reader], with_plots: list[str]) -> None:
    """The description of a drawing unfolds together with a table, and the drawing's colours follow the theme."""
    page = reader(1280, color_scheme="dark").open(with_plots[0])
    root = page.locator("figure.plot").first
    root.locator("summary").click()
    assert len(root.locator(".figure-words").inner_text()) > 100
    assert root.locator("tbody tr").count() > 2
    colour = "root => getComputedStyle(root.querySelector('.plot-svg text')).fill"
    dark = root.evaluate(colour)
    page.emulate_media(color_scheme="light")
    assert root.evaluate(colour) != dark
