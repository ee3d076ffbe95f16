"""Pointing is answered: with the mouse, by a tap, by arrow keys; and it never makes a page wait for Python."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer

PAGE, NAME = "ndt-map.html", "fig-cells"


@pytest.fixture
def cells(reader: Callable[..., Reader]) -> Figure:
    return Figure(reader(reduced_motion="reduce").open(PAGE), NAME).live()


def pixel(cells: Figure, x: float, y: float) -> tuple[float, float]:
    """The place on the screen of a world place of the map."""
    drawing = cells.root.locator('.figure-panel[data-panel="main"] svg')
    drawing.scroll_into_view_if_needed()
    box = drawing.bounding_box()
    assert box
    x0, x1, y0, y1 = cells.frame()["panels"][0]["view"][:4]
    return box["x"] + (x - x0) / (x1 - x0) * box["width"], box["y"] + (y1 - y) / (y1 - y0) * box["height"]


def test_the_cell_under_the_mouse_is_shown_and_hovers_replace_each_other(cells: Figure) -> None:
    """Over the stuck beam its cell is shown, over a wall the wall's; the log has one entry, at the place pointed at."""
    before = cells.readout("mean")
    cells.page.mouse.move(*pixel(cells, -2.5, 0.4))
    stuck = cells.changes("mean", before)
    assert cells.readout("cell") == "discarded"
    cells.page.mouse.move(*pixel(cells, 0.5, 1.4))
    cells.changes("mean", stuck)
    cells.settled()
    ((kind, panel, x, y),) = cells.record()["log"]
    assert (kind, panel) == ("hover", "main")
    assert (x, y) == pytest.approx((0.5, 1.4), abs=0.03)


def test_arrow_keys_point(cells: Figure) -> None:
    """The crosshair takes the focus; arrows move it over the map, and the cell under it is shown at each press."""
    cells.seen()
    cross = cells.root.locator('[data-pick="main"]')
    cross.focus()
    assert "Arrow keys move" in (cross.get_attribute("aria-description") or "")
    taken = """(cross, altKey) => !cross.dispatchEvent(
      new KeyboardEvent("keydown", { key: "ArrowLeft", altKey, bubbles: true, cancelable: true }))"""
    assert not cross.evaluate(taken, True), "the browser's own way back"
    before = cells.readout("mean")
    for _ in range(4):
        cells.page.keyboard.press("Shift+ArrowDown")
    cells.changes("mean", before)
    cells.settled()
    ((kind, _, x, y),) = cells.record()["log"]
    assert kind == "hover"
    assert x == pytest.approx(0.0)
    assert y == pytest.approx(-3.7)


def test_a_tap_points_and_a_finger_still_scrolls(reader: Callable[..., Reader]) -> None:
    """A tap on the drawing chooses the cell there; panning is left to the page."""
    page = reader(390, 800, has_touch=True, reduced_motion="reduce").open(PAGE)
    cells = Figure(page, NAME).live()
    before = cells.readout("cell")
    page.touchscreen.tap(*pixel(cells, -2.5, 0.4))
    assert cells.changes("cell", before) == "discarded"
    drawing = cells.root.locator("svg.panel").first.element_handle()
    assert page.evaluate("e => getComputedStyle(e).touchAction", drawing) != "none"


def test_passing_over_a_picture_asks_for_nothing_before_python_is_up(
    reader: Callable[..., Reader], server: SiteServer
) -> None:
    """While the runtime is not live, a mouse move changes no record and leaves the figure as built."""
    server.hold("/runtime/.*wasm")
    cells = Figure(reader().open(PAGE), NAME)
    cells.page.mouse.move(*pixel(cells, -2.5, 0.4))
    cells.page.mouse.move(*pixel(cells, 0.5, 1.4))
    assert cells.record()["log"] == []
    assert cells.root.get_attribute("data-state") == "static"


def test_a_window_made_wider_moves_what_is_pointed_at(cells: Figure) -> None:
    """The column keeps its width but moves, with no scroll or resize event of its own."""
    page = cells.page
    page.set_viewport_size({"width": 1500, "height": 800})
    before = cells.readout("mean")
    page.mouse.move(*pixel(cells, -2.5, 0.4))
    value = cells.changes("mean", before)
    page.set_viewport_size({"width": 1800, "height": 800})
    page.mouse.move(*pixel(cells, 0.5, 1.4))
    cells.changes("mean", value)
    cells.settled()
    ((_, _, x, y),) = cells.record()["log"]
    assert (x, y) == pytest.approx((0.5, 1.4), abs=0.03)
