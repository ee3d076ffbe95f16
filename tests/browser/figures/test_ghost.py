"""When a ghost comes, is judged and goes: it belongs to one question about one scene."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figures.test_predict import WRONG, question
from tests.browser.layout import FRAMES


def test_a_ghost_begins_where_the_figure_does(reader: Callable[..., Reader]) -> None:
    """Pressing the figure's own button first does not affect the question."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    figure.button("solve").click()
    figure.settled()
    box.get_by_role("button", name="Place a ghost").click()
    expect(figure.root.locator(".predict-ghost")).to_have_count(1)
    assert figure.record()["log"] == [], "the ghost begins where the figure does"
    expect(figure.handle("source")).to_be_hidden()


def test_a_ghost_is_judged_when_the_figure_s_own_buttons_run_it(reader: Callable[..., Reader]) -> None:
    """After as many steps as are asked about, no sooner: otherwise the answer is on the screen without a verdict."""
    page = reader(reduced_motion="reduce").open("icp.html")
    figure, box = question(page, "fig-nearest")
    box.get_by_role("button", name="Place a ghost").click()
    ghost = figure.root.locator(".predict-ghost")
    expect(ghost).to_have_count(1)
    figure.button("step").click()
    figure.settled()
    expect(ghost).to_have_count(1)
    expect(box).not_to_have_attribute("data-told", re.compile("."))
    figure.button("step").click()
    figure.settled()
    expect(box).to_have_attribute("data-told", "wrong")
    expect(box.locator(".predict-says")).to_contain_text("Your ghost’s points are")
    assert [name for _, name, *_ in figure.record()["log"]] == ["step", "step"]


@pytest.mark.parametrize("button", ["new", "far"])
def test_a_ghost_goes_when_its_scene_does(reader: Callable[..., Reader], button: str) -> None:
    """It is a copy of the source of the question; the source itself can be dragged again."""
    page = reader(reduced_motion="reduce").open("icp.html")
    figure, box = question(page, "fig-nearest")
    place = box.get_by_role("button", name="Place a ghost")
    place.click()
    expect(figure.root.locator(".predict-ghost")).to_have_count(1)
    expect(figure.handle("source")).to_be_hidden()
    if button == "new":
        figure.button("new").click()
    else:
        figure.set("start", "far")
    figure.settled()
    expect(figure.root.locator(".predict-ghost")).to_have_count(0)
    expect(place).to_be_visible()
    expect(figure.handle("source")).to_be_visible()


def test_a_ghost_comes_only_to_who_waits_for_it(reader: Callable[..., Reader]) -> None:
    """Not to a reader who went elsewhere before its picture arrived, and only once to one who pressed twice."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    figure.live()
    ghost = figure.root.locator(".predict-ghost")
    press = "(figure, names) => names.forEach(name => figure.querySelector(name).click())"  # before any picture arrives
    place_button, new = "[data-do=place]", "[data-button=new]"
    figure.button("solve").click()
    figure.settled()
    figure.root.evaluate(press, [place_button, new])
    figure.settled()
    figure.button("reset").click()
    figure.settled()
    expect(ghost).to_have_count(0)
    figure.button("solve").click()
    figure.settled()
    figure.root.evaluate(press, [place_button, place_button])
    expect(ghost).to_have_count(1)
    box.get_by_role("button", name="Run").click()
    expect(box).to_have_attribute("data-told", re.compile("."))
    box.get_by_role("button", name="Ask again").click()
    figure.settled()
    expect(ghost).to_have_count(0)


def test_a_ghost_stays_in_its_picture_and_turns_all_the_way_round(reader: Callable[..., Reader]) -> None:
    """By key as by pointer, its middle ends at an edge; a turn is told from −180° to 180°."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    box.get_by_role("button", name="Place a ghost").click()
    move, turn = (figure.root.get_by_role("slider", name=f"Ghost, {name}") for name in ("place", "turn"))
    for _ in range(13):
        turn.press("Shift+ArrowUp")
    expect(turn).to_have_attribute("aria-valuenow", "-165.00")
    for key in ("ArrowLeft", "ArrowDown"):
        for _ in range(20):
            move.press(f"Shift+{key}")
    picture = figure.root.locator('[data-panel="main"] > svg.panel').first.bounding_box()
    middle = move.bounding_box()
    assert picture is not None
    assert middle is not None
    assert middle["x"] + middle["width"] / 2 == pytest.approx(picture["x"], abs=1)
    assert middle["y"] + middle["height"] / 2 == pytest.approx(picture["y"] + picture["height"], abs=1)


def test_a_ghost_that_is_held_is_judged_where_it_is(reader: Callable[..., Reader]) -> None:
    """Run by key while the pointer drags it: it moves no more, neither with the pointer nor back by Escape."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    box.get_by_role("button", name="Place a ghost").click()
    at = figure.root.get_by_role("slider", name="Ghost, place").bounding_box()
    assert at is not None
    x, y = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y + 30, steps=3)
    box.get_by_role("button", name="Run").press("Enter")
    expect(box).to_have_attribute("data-told", re.compile("."))
    ghost = figure.root.locator(".predict-ghost > g")
    place = ghost.get_attribute("transform") or ""
    page.mouse.move(x + 80, y + 60, steps=3)
    page.evaluate(FRAMES)
    expect(ghost).to_have_attribute("transform", place)
    page.keyboard.press("Escape")
    expect(ghost).to_have_attribute("transform", place)
    page.mouse.up()
