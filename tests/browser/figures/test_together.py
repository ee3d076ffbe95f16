"""Parts of figures that belong together stand together, and none of their words are cut off."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.browser.conftest import Reader
from tests.browser.figure import Figure

LINES = "all => all.map((e) => Math.round(e.getBoundingClientRect().top))"
LEFT = "e => e.getBoundingClientRect().left"
# Lines of a label that begin left of its first letter.
UNDER = """all => all.flatMap((e) => {
  const words = new Range();
  words.selectNodeContents(e);
  const [first, ...more] = [...words.getClientRects()];
  return more.filter((line) => line.left < first.left - 1).map(() => e.textContent);
})"""


@pytest.mark.parametrize(
    ("page", "name"),
    [("icp", "fig-atlas"), ("drive", "fig-drive"), ("uncertainty", "fig-hall"), ("landscape", "fig-mmd")],
)
def test_pin_and_link_share_a_line(reader: Callable[..., Reader], page: str, name: str) -> None:
    """On a phone, where they need not share it with the figure's own buttons."""
    figure = Figure(reader(390, 844, reduced_motion="reduce").open(f"{page}.html"), name).seen()
    figure.reached("[data-link]").scroll_into_view_if_needed()
    assert len(set(figure.root.locator(".buttons > div > button").evaluate_all(LINES))) == 1


@pytest.mark.parametrize(("page", "name"), [("search", "fig-everywhere"), ("drive", "fig-four-poses")])
def test_no_option_stands_alone(reader: Callable[..., Reader], page: str, name: str) -> None:
    """Beside a picture, where the column of the controls is narrow."""
    figure = Figure(reader(reduced_motion="reduce").open(f"{page}.html"), name).seen()
    choices = figure.root.locator(".figure-desk .options").all()
    assert choices
    for options in choices:
        lines = options.locator("label").evaluate_all(LINES)
        assert lines.count(lines[-1]) > 1, options.text_content()


@pytest.mark.parametrize(("page", "name"), [("uncertainty", "fig-hall"), ("drive", "fig-four-poses")])
def test_a_long_label_does_not_run_under_its_dot(reader: Callable[..., Reader], page: str, name: str) -> None:
    figure = Figure(reader(reduced_motion="reduce").open(f"{page}.html"), name).seen()
    figure.reached(".readout >> nth=-1")
    labels = figure.root.locator('.readout[class*=" "] dt')
    assert labels.count() >= 1
    assert labels.evaluate_all(UNDER) == []


def test_readouts_begin_where_the_picture_above_them_does(reader: Callable[..., Reader]) -> None:
    """And the status is not taken for the help of the control above it."""
    waves = Figure(reader(reduced_motion="reduce").open("mmd.html"), "fig-waves").seen()
    picture = waves.root.locator(".figure-stage > .figure-panel").last
    assert abs(waves.root.locator(".readouts").first.evaluate(LEFT) - picture.evaluate(LEFT)) < 1
    [desk], [status] = waves.boxes(".figure-desk"), waves.boxes(".figure-status")
    assert status["y"] - desk["y"] - desk["height"] > 16


def test_a_thumbnail_has_its_whole_name(reader: Callable[..., Reader]) -> None:
    """*3½ · The nearest surface* used to end like *3 · The nearest point*."""
    figure = Figure(reader(390, 844, reduced_motion="reduce").open("index.html"), "fig-map").seen()
    names = figure.root.locator(".figure-panel:not(.large) > .panel-caption > :first-child")
    assert names.count() == 7
    cut = "all => all.filter((e) => e.scrollHeight > e.clientHeight + 2).map((e) => e.textContent)"
    assert names.evaluate_all(cut) == []


# Names whose words are divided between lines, or that end early.
DIVIDED = """all => all.filter((e) => {
  if (e.scrollHeight > e.clientHeight + 2) return true;
  const text = e.firstChild, range = document.createRange();
  return [...text.data.matchAll(/\\p{L}+/gu)].some((word) => {
    range.setStart(text, word.index);
    range.setEnd(text, word.index + word[0].length);
    return new Set([...range.getClientRects()].map((box) => box.top)).size > 1;
  });
}).map((e) => e.textContent)"""


@pytest.mark.parametrize("size", [(320, 640), (195, 422)])
@pytest.mark.parametrize("name", ["index.html#fig-map", "race.html#fig-race", "four.html#fig-four"])
def test_a_narrow_thumbnail_has_its_name_in_whole_words(
    reader: Callable[..., Reader], name: str, size: tuple[int, int]
) -> None:
    """On the narrowest phone, and on a phone with text at twice the size."""
    page, figure = name.split("#")
    stage = Figure(reader(*size, reduced_motion="reduce").open(page), figure).seen()
    names = stage.root.locator(".figure-stage > .figure-panel:not(.large) > .panel-caption > :first-child")
    assert names.count() > 2
    assert names.evaluate_all(DIVIDED) == []
