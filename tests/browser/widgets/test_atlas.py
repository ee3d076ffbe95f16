"""The atlas in the browser: a tile is shown while it is pointed at, and a clicked one stays."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from widgets.figures.atlas.figure import WIDGET

FINEST = WIDGET.details - 1
# The levels that Python answers with, shown or not.
LISTEN = """() => {
  window.drawn = [];
  const { frame } = Ladder.runtime;
  Ladder.runtime.frame = (wanted) =>
    frame(wanted).then((answer) => {
      window.drawn.push(answer.detail);
      return answer;
    });
}"""


@pytest.fixture
def atlas(reader: Callable[..., Reader]) -> Figure:
    return Figure(reader(reduced_motion="reduce").open("icp.html"), "fig-atlas").live()


def pixel(atlas: Figure, x: float, y: float) -> tuple[float, float]:
    """The place of a start on the screen."""
    drawing = atlas.root.locator('.figure-panel[data-panel="map"] svg')
    drawing.scroll_into_view_if_needed()
    box = drawing.bounding_box()
    assert box
    x0, x1, y0, y1, width, height, left, top, right, bottom = atlas.frame()["panels"][0]["view"]
    px = left + (x - x0) / (x1 - x0) * (width - left - right), top + (y1 - y) / (y1 - y0) * (height - top - bottom)
    return box["x"] + px[0] / width * box["width"], box["y"] + px[1] / height * box["height"]


def log(atlas: Figure) -> list[list[str | float]]:
    return atlas.record()["log"]  # type: ignore[no-any-return]


def test_a_tile_is_shown_while_it_is_pointed_at_and_a_picked_one_stays(atlas: Figure) -> None:
    """A hover leaves nothing when the mouse goes; a click is one entry, and is shown again after other tiles."""
    mouse = atlas.page.mouse
    mouse.move(*pixel(atlas, 10.0, 1.0))
    assert atlas.changes("end", "–") == "the truth"
    mouse.move(*pixel(atlas, 10.0, 3.6))  # above the map, still in its panel
    mouse.move(2, 2)
    assert atlas.changes("end", "the truth") == "–"
    assert log(atlas) == []
    mouse.click(*pixel(atlas, 170.0, 1.0))
    assert atlas.changes("end", "–") == "half turn"
    mouse.move(*pixel(atlas, 10.0, 1.0))
    assert atlas.changes("end", "half turn") == "the truth"
    mouse.move(2, 2)
    assert atlas.changes("end", "the truth") == "half turn"
    assert [entry[0] for entry in log(atlas)] == ["click"]


def test_the_crosshair_shows_and_picks(atlas: Figure) -> None:
    """Arrows look, Enter picks; when the focus leaves, a tile that was only looked at is dropped."""
    atlas.seen()
    cross = atlas.root.locator('[data-pick="map"]')
    assert cross.count() == 1
    cross.focus()
    atlas.page.keyboard.press("Shift+ArrowLeft")
    assert atlas.changes("end", "–") != "–"
    assert [entry[0] for entry in log(atlas)] == ["hover"]
    cross.evaluate("e => e.blur()")
    atlas.settled()
    assert log(atlas) == []
    cross.focus()
    atlas.page.keyboard.press("Shift+ArrowLeft")
    atlas.page.keyboard.press("Enter")
    cross.evaluate("e => e.blur()")
    atlas.settled()
    assert [entry[0] for entry in log(atlas)] == ["click"]


def test_a_touch_does_not_coarsen_a_map_that_was_left_to_itself(reader: Callable[..., Reader]) -> None:
    """Off screen, Python reaches the resolution of the map that came with the page, and the first step has it."""
    atlas = Figure(reader(reduced_motion="reduce").open("icp.html"), "fig-atlas")
    atlas.page.evaluate(LISTEN)
    atlas.live()
    until(atlas.page, f"window.drawn.includes({FINEST})")
    atlas.page.evaluate(
        "() => { window.seen = []; Ladder.figures.get('fig-atlas').on('frame', f => seen.push(f.detail)); }"
    )
    atlas.button("finish").click()
    assert atlas.changes("end", "–") == "turned"
    assert set(atlas.page.evaluate("seen")) == {FINEST}
