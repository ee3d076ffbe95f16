"""What a figure takes from keys and pointers and what it leaves to the browser."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.figures.test_again import slow
from tests.browser.figures.test_hover import cells, pixel
from tests.browser.layout import FRAMES

__all__ = ["cells", "slow"]  # fixtures
TAKEN = """(element, init) => !element.dispatchEvent(
  new KeyboardEvent("keydown", { bubbles: true, cancelable: true, ...init }))"""


@pytest.fixture
def solve(reader: Callable[..., Reader]) -> Figure:
    return Figure(reader(reduced_motion="reduce").open("kabsch.html"), "fig-solve").live().settled()


def middle(node: Locator) -> tuple[float, float]:
    box = node.bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_keys_pressed_one_by_one_all_count(slow: Figure) -> None:
    """However slow Python is: four presses are four moves."""
    x = slow.frame()["handles"][0]["slider"][2]
    slow.handle("source").focus()
    for _ in range(4):
        slow.page.keyboard.press("ArrowRight")
    slow.page.evaluate("letGo()")
    slow.settled()
    (_, _, at, _) = slow.record()["log"][-1]
    assert at - x == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize("modifier", ["altKey", "ctrlKey", "metaKey"])
def test_the_browser_s_own_keys_move_no_handle(solve: Figure, modifier: str) -> None:
    """Alt and an arrow lead back to the last page."""
    assert not solve.handle("source").evaluate(TAKEN, {"key": "ArrowLeft", modifier: True})
    assert solve.handle("source").evaluate(TAKEN, {"key": "ArrowLeft"})
    assert len(solve.settled().record()["log"]) == 1
    cross = Figure(solve.page, "fig-wrong")
    cross.root.get_by_role("button", name="Place a ghost").click()
    ghost = cross.root.get_by_role("slider", name="Ghost, place")
    assert not ghost.evaluate(TAKEN, {"key": "ArrowLeft", modifier: True})
    assert ghost.evaluate(TAKEN, {"key": "ArrowLeft"})


def test_a_key_does_not_move_what_the_pointer_holds(solve: Figure) -> None:
    x, y = middle(solve.seen().handle("source"))
    solve.page.mouse.move(x, y)
    solve.page.mouse.down()
    solve.page.keyboard.press("ArrowRight")
    solve.page.evaluate(FRAMES)
    solve.page.mouse.up()
    assert solve.settled().record()["log"] == []


def test_escape_takes_back_a_move_that_was_not_yet_asked_for(solve: Figure) -> None:
    """Two moves and Escape before the next animation frame: nothing of them comes later."""
    solve.seen().handle("source").evaluate("""handle => {
      const { left, top } = handle.getBoundingClientRect();
      const send = (type, to) => handle.dispatchEvent(new PointerEvent(type, { bubbles: true, pointerId: 7, buttons: 1,
        pointerType: "mouse", isPrimary: true, clientX: left + 22 + to, clientY: top + 22 }));
      send("pointerdown", 0);
      for (const to of [20, 40, 60]) for (const type of ["pointerrawupdate", "pointermove"]) send(type, to);
      handle.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape", bubbles: true, cancelable: true }));
    }""")
    solve.page.evaluate(FRAMES)
    assert solve.settled().record()["log"] == []
    place, (x, _) = solve.frame()["handles"][0], middle(solve.handle("source"))
    drawing = solve.root.locator('[data-panel="main"] > svg.panel').bounding_box()
    assert drawing is not None
    assert x == pytest.approx(drawing["x"] + place["left"] / 100 * drawing["width"], abs=1.5)


def test_a_crosshair_stays_inside_its_picture(cells: Figure) -> None:
    """Beyond an edge the arrows lead nowhere; a screen reader hears the place with true minus signs."""
    cross = cells.seen().root.locator('[data-pick="main"]')
    x0, x1, y0, y1 = cells.frame()["panels"][0]["view"][:4]
    for across, down, x, y in (("ArrowLeft", "ArrowDown", x0, y0), ("ArrowRight", "ArrowUp", x1, y1)):
        for key in (across, down):
            for _ in range(9):
                cross.press(f"Shift+{key}")
        expect(cross).to_have_attribute("aria-valuetext", f"x {x:.2f}, y {y:.2f}".replace("-", "−"))
        expect(cross).to_have_attribute("aria-valuenow", f"{x:.2f}")
    assert cells.settled().record()["log"] == [["hover", "main", x1, y1]]


def test_a_pointer_that_is_held_down_points_at_nothing(cells: Figure) -> None:
    """It selects text, or drags something in from elsewhere."""
    x, y = pixel(cells, 0.5, 1.4)
    cells.page.mouse.move(2, y)
    cells.page.mouse.down()
    cells.page.mouse.move(x, y, steps=4)
    cells.page.evaluate(FRAMES)
    assert cells.settled().record()["log"] == []
    cells.page.mouse.move(2, y)
    cells.page.mouse.up()


HIDE = """hidden => {
  Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
  document.dispatchEvent(new Event("visibilitychange"));
}"""


@pytest.mark.parametrize("begin", ['[data-button="run"]', ".predict [data-right=yes]"])
def test_nothing_runs_in_a_tab_that_is_behind_another(reader: Callable[..., Reader], begin: str) -> None:
    """A run and the run of a question wait there, and go on where they were."""
    wall = Figure(reader().open("icp.html"), "fig-wall").live().settled()
    count = "Ladder.figures.get('fig-wall').record.log.length"
    wall.root.locator(begin).first.click()
    until(wall.page, f"{count} > 1")
    wall.page.evaluate(HIDE, True)
    until(wall.page, "!Ladder.figures.get('fig-wall').pending")
    before = wall.page.evaluate(count)
    wall.page.evaluate("new Promise(done => setTimeout(done, 4 * Ladder.limits.run))")
    assert wall.page.evaluate(count) == before
    wall.page.evaluate(HIDE, False)
    until(wall.page, f"{count} > {before}")


def test_a_window_made_narrow_keeps_the_large_panel_and_its_name(reader: Callable[..., Reader]) -> None:
    """On a phone one panel is large and the others are buttons, named after what they show; wide, none is a button
    only."""
    figure = Figure(reader().open("race.html"), "fig-race").seen()
    panels = figure.root.locator(".figure-stage > .figure-panel")
    thumbs = figure.root.locator(".figure-panel[data-thumb]")
    expect(thumbs).to_have_count(0)
    figure.page.set_viewport_size({"width": 390, "height": 844})
    expect(thumbs).to_have_count(panels.count() - 1)
    second = panels.nth(1)
    name = second.locator(".panel-caption > :first-child").inner_text()
    second.get_by_role("button", name=f"Enlarge {name}", exact=True).click()
    expect(figure.root.locator(".figure-panel.large")).to_have_attribute(
        "data-panel", second.get_attribute("data-panel") or ""
    )
    figure.page.set_viewport_size({"width": 1280, "height": 1000})
    expect(thumbs).to_have_count(0)


def test_quick_taps_enlarge_nothing(reader: Callable[..., Reader]) -> None:
    """Whatever is pressed repeatedly refuses the double tap, which enlarges the page in Safari, and no other gesture;
    handles refuse all."""
    page = reader().open("race.html")
    Figure(page, "fig-race").seen()
    touch = """selector => [...new Set([...document.querySelectorAll(`.figure :is(${selector})`)]
      .map(e => getComputedStyle(e).touchAction))]"""
    assert page.evaluate(touch, "button:not(.handle, .crosshair), summary, label") == ["manipulation"]
    assert page.evaluate(touch, ".handle") == ["none"]
