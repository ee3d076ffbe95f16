"""What is beside or below a figure's picture on a tablet or a phone on its side: charts no larger than the picture, and
questions and buttons on one screen with it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.browser.conftest import Reader
from tests.browser.layout import SIDEWAYS, low, remaining

LARGE = """() => [...document.querySelectorAll('.figure-charts > .figure-panel')].filter(e => {
  const main = e.closest('.figure-body').querySelector('.figure-stage > .figure-panel').getBoundingClientRect();
  const {width, height} = e.getBoundingClientRect();
  return width > Math.max(0.7 * main.width, 360) || height > main.height + 24;
}).map(e => `${e.closest('figure').id}: ${e.dataset.panel}`)"""
# Texts of a drawing that overlap others.
COLLIDING = """() => [...document.querySelectorAll('svg.panel')].flatMap(svg => {
  const words = [...svg.querySelectorAll('text')].filter(e => e.checkVisibility() && e.getBoundingClientRect().width)
    .map(e => [e.textContent, e.getBoundingClientRect()]);
  return words.flatMap(([one, a], i) => words.slice(i + 1).filter(([, b]) =>
    Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2
    && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.5 * a.height)
    .map(([other]) => `${svg.closest('figure').id}: ${one} lies on ${other}`));
})"""


@pytest.mark.parametrize("page", ["landscape.html", "ndt-map.html", "reading.html", "ransac.html"])
def test_a_chart_is_no_larger_than_its_picture(reader: Callable[..., Reader], page: str) -> None:
    tab = reader(768, 1024, reduced_motion="reduce").open(page)
    assert tab.locator(".figure-charts > .figure-panel").count()
    assert remaining(tab, LARGE) == []


@pytest.mark.parametrize("page", ["icp.html", "landscape.html", "ndt-map.html", "race.html", "search.html"])
def test_a_tablet_shows_the_question_before_the_run(reader: Callable[..., Reader], page: str) -> None:
    """Upright or not, the sentence, the picture, its controls, its numbers and the question are seen together."""
    tab = reader(reduced_motion="reduce").open(page)
    for width, height in [(768, 1024), (1024, 768)]:
        assert low(tab, ("stage", "button", "controls", "readouts", "asked"), width, height, 100)[1] == []


@pytest.mark.parametrize("page", ["clouds.html", "icp.html", "kabsch.html", "race.html", "ransac.html"])
def test_a_phone_on_its_side_shows_the_picture_and_its_button(reader: Callable[..., Reader], page: str) -> None:
    """The buttons are beside the picture, though the window is not wide, and nothing is too wide."""
    tab = reader(reduced_motion="reduce").open(page)
    for width, height in [(844, 390), (932, 430)]:
        assert low(tab, ("button",), width, height, 100)[1] == []
        assert remaining(tab, SIDEWAYS) == []


@pytest.mark.parametrize("width", [390, 768, 1024])
def test_words_over_a_chart_do_not_meet(reader: Callable[..., Reader], width: int) -> None:
    """With *More* open: the titles of the benchmark's strips, and the meaning of their bars and dashes."""
    page = reader(width, 900, reduced_motion="reduce").open("race.html")
    page.evaluate("for (const each of document.querySelectorAll('details')) each.open = true")
    assert page.locator("svg.panel text", has_text="bar: median").count()
    assert remaining(page, COLLIDING) == []
