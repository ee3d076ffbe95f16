"""Drawing two clouds by hand: the line under the pen, and the keyboard's place."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.held import HELD


def pen(reader: Callable[..., Reader]) -> tuple[Page, Figure]:
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script(HELD)
    page = visitor.open("clouds.html")
    own = Figure(page, "fig-own").live().settled()
    own.root.locator('[data-pen="source"]').click()
    return page, own.settled()


def test_a_frame_leaves_the_line_that_is_being_drawn(reader: Callable[..., Reader]) -> None:
    """The answer to the first stroke arrives while the second one is being drawn."""
    page, own = pen(reader)
    page.evaluate("window.holding = true")
    panel = own.root.locator('.figure-panel[data-panel="main"]')
    box = panel.bounding_box()
    assert box
    x, y = box["x"] + 80, box["y"] + 80
    lines = panel.locator("svg.panel > path.line.thick.source")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y + 10, steps=4)
    page.mouse.up()
    page.mouse.move(x, y + 60)
    page.mouse.down()
    page.mouse.move(x + 60, y + 70, steps=4)
    expect(lines).to_have_count(2)
    frames = own.frames()
    page.evaluate("window.letGo()")
    until(page, f"Number(document.getElementById('fig-own').dataset.frame) > {frames}")
    expect(lines).to_have_count(1)
    page.mouse.move(x + 120, y + 80, steps=4)
    page.mouse.up()
    own.settled()
    expect(lines).to_have_count(0)


def test_the_last_undo_leaves_the_keyboard_somewhere(reader: Callable[..., Reader]) -> None:
    page, own = pen(reader)
    cross = own.root.locator('[data-pick="main"]')
    cross.focus()
    page.keyboard.press("Enter")
    undo = own.root.locator("[data-own=undo]")
    expect(undo).to_be_enabled()
    undo.focus()
    page.keyboard.press("Enter")
    expect(undo).to_be_disabled()
    expect(own.root.locator('[data-pen="source"]')).to_be_focused()


def test_escape_takes_back_the_line_under_the_pen(reader: Callable[..., Reader]) -> None:
    """None of its points is placed, and the pen is ready for another line."""
    page, own = pen(reader)
    panel = own.root.locator('.figure-panel[data-panel="main"]')
    box = panel.bounding_box()
    assert box
    x, y = box["x"] + 80, box["y"] + 80
    lines = panel.locator("svg.panel > path.line.thick.source")
    undo = own.root.locator("[data-own=undo]")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y + 10, steps=4)
    expect(lines).to_have_count(1)
    page.keyboard.press("Escape")
    expect(lines).to_have_count(0)
    page.mouse.move(x + 120, y + 40, steps=2)
    page.mouse.up()
    expect(undo).to_be_disabled()
    page.mouse.down()
    page.mouse.move(x + 60, y + 90, steps=4)
    page.mouse.up()
    expect(undo).to_be_enabled()
