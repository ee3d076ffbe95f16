"""Predictions: a reader answers before the run, by pointer, keys or touch; the run decides; the tab keeps the score."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Locator, Page, expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure, finger
from widgets.drawing.picture import Group, Points
from widgets.engine.contract import parsed
from widgets.engine.registry import WIDGETS

WRONG = "fig-wrong"
SLOWLY, USUALLY = ("Ladder.limits.run = 700", "Ladder.limits.run = 125")  # ms a step, so that a run waits for the test


def source(page: Page, state: str) -> np.ndarray[Any, Any]:
    """The source's points as Python draws them in one of the figure's states: its "record" or its "prediction"."""
    root = page.locator(f"#{WRONG}")
    plain = json.loads(root.locator("script.figure-record").text_content() or "")["record"]
    if state == "prediction":
        plain |= json.loads(root.locator(".predict").get_attribute("data-record") or "")
    widget = WIDGETS[plain["widget"]]
    record = parsed(widget, plain)
    current = widget.start(record.controls, record.seed)
    for action in record.log:
        current = widget.act(current, action)
    panel = next(panel for panel in widget.draw(current).panels if panel.name == "main")
    group = next(mark for mark in panel.marks if isinstance(mark, Group) and mark.name == "source")
    return np.concatenate([np.asarray(mark.xy) for mark in group.marks if isinstance(mark, Points)])


def question(page: Page, name: str) -> tuple[Figure, Locator]:
    """A figure, on screen, and its question."""
    figure = Figure(page, name).seen()
    return figure, figure.root.locator(".predict")


def test_every_chapter_asks_and_every_question_is_answered_from_disk(
    browser_page: Callable[[str], Page], site: Path
) -> None:
    """Each chapter has a question, and each is decided without Python, by the data that the page was built with."""
    chapters = [path.stem for path in sorted((site / "notebooks").glob("*.ipynb"))]
    assert len(chapters) >= 17
    for chapter in chapters:
        page = browser_page(f"{chapter}.html")
        boxes = page.locator(".predict")
        assert boxes.count() > 0, chapter
        for box in boxes.all():
            first = box.locator(".predict-answers button").first
            first.click()
            if first.get_attribute("data-right") is None:
                box.get_by_role("button", name="Run").click()
            expect(box, f"{chapter}: {box.inner_text()}").to_have_attribute("data-told", re.compile("right|wrong"))
            right = first.get_attribute("data-right")
            assert right is None or box.get_attribute("data-told") == {"yes": "right", "no": "wrong"}[right]
            expect(box.get_by_role("status")).to_contain_text("in this tab")
            root = box.locator("xpath=ancestor::figure")
            expect(root.locator(".figure-status")).not_to_contain_text("tape")
        page.close()


@pytest.fixture
def browser_page(reader: Callable[..., Reader], site: Path) -> Callable[[str], Page]:
    """Open a page of the site from disk."""
    visitor = reader(reduced_motion="reduce")
    visitor.expect("Access to font", "ERR_FAILED", "A preload for", "was preloaded using link preload")

    def open_page(name: str) -> Page:
        page = visitor.page()
        page.goto((site / name).as_uri())
        return page

    return open_page


def test_an_answer_by_keyboard_is_told_and_can_be_given_again(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("icp.html")
    figure, box = question(page, "fig-wall")
    wrong, right = (box.locator(f"[data-right={answer}]") for answer in ("no", "yes"))
    wrong.focus()
    page.keyboard.press("Enter")
    expect(box).to_have_attribute("data-told", "wrong")
    expect(wrong).to_have_attribute("aria-pressed", "true")
    assert figure.record()["log"] == [["press", "finish"]], "the figure has run"
    status = box.get_by_role("status")
    expect(status).to_contain_text((right.text_content() or "").strip())
    expect(status).to_contain_text("0 of 1 right in this tab")
    right.focus()
    page.keyboard.press("Enter")
    expect(box).to_have_attribute("data-told", "wrong")  # it has already been answered
    status.get_by_role("button", name="Ask again").press("Enter")
    expect(box).not_to_have_attribute("data-told", re.compile("."))
    assert box.locator(".predict-answers :focus").count() == 1
    assert figure.record()["log"] == []
    right.press("Space")
    expect(box).to_have_attribute("data-told", "right")
    expect(status).to_contain_text("0 of 1 right in this tab")  # the first answer counts


def test_the_score_goes_through_the_tab_and_no_further(reader: Callable[..., Reader]) -> None:
    visitor = reader(reduced_motion="reduce")
    page = visitor.open("icp.html")
    question(page, "fig-wall")[1].locator("[data-right=yes]").click()
    expect(question(page, "fig-wall")[1].get_by_role("status")).to_contain_text("1 of 1 right")
    page.goto(f"{visitor.origin}/surfaces.html")
    box = question(page, "fig-wall")[1]
    box.locator("[data-right=no]").first.click()
    expect(box.get_by_role("status")).to_contain_text("1 of 2 right in this tab")
    second = visitor.open("mmd.html")
    box = question(second, "fig-overlap")[1]
    box.locator("[data-right=yes]").click()
    expect(box.get_by_role("status")).to_contain_text("1 of 1 right in this tab")
    assert not visitor.foreign


def test_a_ghost_by_keyboard_is_as_far_off_as_it_was_put(reader: Callable[..., Reader]) -> None:
    """Moved three steps right and a large one up, turned by 15°: the distance is that from Python's final pose."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    start, end = source(page, "record"), source(page, "prediction")
    box.get_by_role("button", name="Place a ghost").press("Enter")
    move = figure.root.get_by_role("slider", name="Ghost, place")
    expect(move).to_be_focused()
    for key in ("ArrowRight",) * 3 + ("Shift+ArrowUp",):
        page.keyboard.press(key)
    turn = figure.root.get_by_role("slider", name="Ghost, turn")
    turn.press("Shift+ArrowUp")
    expect(turn).to_have_attribute("aria-valuenow", "15.00")
    box.get_by_role("button", name="Run").press("Enter")
    expect(box).to_have_attribute("data-told", "wrong")
    angle, middle = math.radians(15), start.mean(axis=0)
    rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    ghost = (start - middle) @ rotation.T + middle + (0.3, 0.5)
    distance = np.linalg.norm(ghost - end, axis=1).mean()
    match = re.search(r"are ([\d.]+)\xa0u away", box.get_by_role("status").inner_text())
    assert match
    assert abs(float(match[1]) - distance) < 0.02  # the drawing is in tenths of a px
    expect(figure.root.locator(".predict-ghost")).to_have_count(1)
    figure.button("reset").click()
    expect(figure.root.locator(".predict-ghost")).to_have_count(0)
    expect(box.get_by_role("button", name="Place a ghost")).to_be_visible()


def test_a_ghost_taken_where_the_run_stops_is_right(reader: Callable[..., Reader]) -> None:
    """By mouse: first the place, then the turn."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    start, end = source(page, "record"), source(page, "prediction")
    box.get_by_role("button", name="Place a ghost").click()
    view = figure.frame()["panels"][0]["view"]
    plot_box = figure.root.locator('[data-panel="main"] > svg.panel').first.bounding_box()
    assert plot_box
    scale = plot_box["width"] / view[4] * (view[4] - view[6] - view[8]) / (view[1] - view[0])  # px per u

    def drag(name: str, to: Callable[[float, float], tuple[float, float]]) -> None:
        box = figure.root.get_by_role("slider", name=name).bounding_box()
        assert box
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(*to(x, y), steps=6)
        page.mouse.up()

    a, b = start - start.mean(axis=0), end - end.mean(axis=0)
    angle = math.atan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    dx, dy = (end.mean(axis=0) - start.mean(axis=0)) * scale
    drag("Ghost, place", lambda x, y: (x + dx, y - dy))
    middle = figure.root.get_by_role("slider", name="Ghost, place").bounding_box()
    assert middle
    mx, my = middle["x"] + middle["width"] / 2, middle["y"] + middle["height"] / 2

    def around(x: float, y: float) -> tuple[float, float]:
        c, s = math.cos(-angle), math.sin(-angle)  # y points down on the screen
        return mx + c * (x - mx) - s * (y - my), my + s * (x - mx) + c * (y - my)

    drag("Ghost, turn", around)
    box.get_by_role("button", name="Run").click()
    expect(box).to_have_attribute("data-told", "right")
    expect(box.get_by_role("status")).to_contain_text("1 of 1 right in this tab")


def test_escape_puts_the_ghost_back(reader: Callable[..., Reader]) -> None:
    """While the pointer drags it, by its middle or its knob; further pointer moves then have no effect."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    box.get_by_role("button", name="Place a ghost").click()
    for name in ("Ghost, place", "Ghost, turn"):
        slider = figure.root.get_by_role("slider", name=name)
        before, at = slider.get_attribute("aria-valuetext") or "", slider.bounding_box()
        assert at
        x, y = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 40, y + 30, steps=3)
        expect(slider).not_to_have_attribute("aria-valuetext", before)
        page.keyboard.press("Escape")
        expect(slider).to_have_attribute("aria-valuetext", before)
        page.mouse.move(x + 80, y + 60, steps=3)
        page.mouse.up()
        expect(slider).to_have_attribute("aria-valuetext", before)


def test_a_finger_takes_the_ghost(reader: Callable[..., Reader]) -> None:
    page = reader(width=390, height=844, has_touch=True, is_mobile=True, reduced_motion="reduce").open("kabsch.html")
    figure, box = question(page, WRONG)
    box.get_by_role("button", name="Place a ghost").tap()
    move = figure.root.get_by_role("slider", name="Ghost, place")
    before, at = move.get_attribute("aria-valuetext"), move.bounding_box()
    assert at
    x, y = at["x"] + at["width"] / 2, at["y"] + at["height"] / 2
    finger(page, [(x, y), (x + 40, y + 10), (x + 60, y + 20)])
    expect(move).not_to_have_attribute("aria-valuetext", before or "")
    end_box = move.bounding_box()
    assert end_box
    assert (round(end_box["x"] - at["x"]), round(end_box["y"] - at["y"])) == (60, 20)


def test_without_scripts_nothing_is_asked(reader: Callable[..., Reader]) -> None:
    page = reader(java_script_enabled=False).open("kabsch.html")
    assert page.locator(".predict").count() > 0
    for box in page.locator(".predict").all():
        expect(box).to_be_hidden()


def steps(figure: Figure) -> list[int]:
    """The number of presses in each frame, as the page drew them."""
    return figure.page.evaluate("id => window.seen[id]", figure.name)


WATCH = """id => {
  const figure = Ladder.figures.get(id), box = figure.root.querySelector('.predict');
  window.seen = { [id]: [], told: [], running: [] };
  figure.on("frame", () => {
    window.seen[id].push(figure.shown.log.length);
    window.seen.told.push('told' in box.dataset);
    window.seen.running.push(figure.running);
  });
}"""


@pytest.mark.parametrize(
    ("page", "name", "most"), [("icp", "fig-wall", None), ("surfaces", "fig-three", 3)]
)  # to the end, and three presses
def test_the_run_that_decides_is_seen_step_by_step(
    reader: Callable[..., Reader], page: str, name: str, most: int | None
) -> None:
    """As if by Run; the outcome is told when it stops, and nothing before."""
    figure, box = question(reader().open(f"{page}.html"), name)
    figure.live()
    figure.page.evaluate(WATCH, name)
    box.locator("[data-right=yes]").first.click()
    expect(box).to_have_attribute("data-told", "right")
    counts = steps(figure)
    assert counts == list(range(len(counts)))
    report, running = figure.page.evaluate("[seen.told, seen.running]")
    assert not any(report[:-1])
    assert all(running[1:-1])
    assert figure.page.evaluate("id => Ladder.figures.get(id).running", figure.name) is False
    assert len(counts) - 1 == most or (most is None and len(counts) > 5)
    step = figure.root.locator('[data-button="step"]')
    expect(step).to_have_attribute("aria-disabled", str(most is None).lower())


def test_a_run_that_is_hurried_to_its_end_still_tells(reader: Callable[..., Reader]) -> None:
    """One that is reset half-way asks again."""
    figure, box = question(reader().open("icp.html"), "fig-wall")
    figure.live().page.evaluate(SLOWLY)
    for button, report in (("reset", None), ("finish", "right")):
        box.locator("[data-right=yes]").first.click()
        expect(figure.root.locator('[data-button="reset"]')).to_have_attribute("aria-disabled", "false")
        figure.button(button).click()
        if report:
            expect(box).to_have_attribute("data-told", report)
            assert figure.record()["log"][-1] == ["press", "finish"]
        else:
            expect(box.locator("[aria-pressed=true]")).to_have_count(0)
            assert box.get_attribute("data-told") is None


def test_run_takes_over_from_a_prediction_and_a_prediction_from_run(reader: Callable[..., Reader]) -> None:
    """Either continues at the pace of a run, and the outcome is told."""
    figure, box = question(reader().open("icp.html"), "fig-wall")
    figure.live()
    answer = box.locator("[data-right=yes]").first
    running = "Ladder.figures.get('fig-wall').running && Ladder.figures.get('fig-wall').shown.log.length > 1"
    figure.page.evaluate(WATCH, figure.name)
    for first, second in ((answer, figure.button("run")), (figure.button("run"), answer)):
        figure.settled().page.evaluate("seen.running.length = 0")
        figure.page.evaluate(SLOWLY)
        first.click()
        until(figure.page, running)
        second.click()
        figure.page.evaluate(USUALLY)
        expect(box).to_have_attribute("data-told", "right")
        assert figure.page.evaluate("seen.running.slice(2, -1).every(Boolean)")
        until(figure.page, "!Ladder.figures.get('fig-wall').running")  # the reader's run stops at its next press
        box.get_by_role("button", name="Ask again").click()


def test_a_prediction_waits_where_it_is_not_seen(reader: Callable[..., Reader]) -> None:
    figure, box = question(reader().open("icp.html"), "fig-wall")
    figure.live()
    box.locator("[data-right=yes]").first.click()
    until(figure.page, "Ladder.figures.get('fig-wall').shown.log.length > 1")
    figure.page.evaluate("scrollTo(0, 0)")
    until(figure.page, "!Ladder.figures.get('fig-wall').visible && !Ladder.figures.get('fig-wall').pending")
    before = figure.record()["log"]
    figure.page.evaluate("new Promise(done => setTimeout(done, 4 * Ladder.limits.run))")
    assert figure.record()["log"] == before
    figure.seen()
    expect(box).to_have_attribute("data-told", "right")


def test_a_prediction_that_cannot_be_drawn_is_asked_anew(reader: Callable[..., Reader]) -> None:
    figure, box = question(reader().open("icp.html"), "fig-wall")
    figure.live().page.evaluate(SLOWLY)
    box.locator("[data-right=yes]").first.click()
    until(figure.page, "Ladder.figures.get('fig-wall').shown.log.length > 1")
    figure.page.evaluate("Ladder.figures.get('fig-wall').leave()")
    expect(box.locator("[aria-pressed=true], [aria-disabled=true]")).to_have_count(0)


def test_settings_of_the_question_are_not_put_back(reader: Callable[..., Reader]) -> None:
    """A reader who has set exactly what the question asks about is told nothing of settings; one who places a ghost
    after changing a setting is."""
    figure, box = question(reader(reduced_motion="reduce").open("ndt-map.html"), "fig-cells")
    figure.live().set("size", "2.4")
    box.locator("[data-right=yes]").click()
    expect(box).to_have_attribute("data-told", "right")
    assert "settings" not in box.get_by_role("status").inner_text()
    figure, box = question(reader(reduced_motion="reduce").open("icp.html"), "fig-nearest")
    figure.live().set("turn", "60")
    box.get_by_role("button", name="Place a ghost").click()
    box.get_by_role("button", name="Run").click()
    expect(box.get_by_role("status")).to_contain_text("The settings were put back to those of the question.")


def test_settings_that_were_moved_are_put_back_and_that_is_told(reader: Callable[..., Reader]) -> None:
    figure, box = question(reader(reduced_motion="reduce").open("ransac.html"), "fig-consensus")
    figure.live()
    own = figure.control("outliers").input_value()
    for value in (own, "0.8"):
        figure.set("outliers", value)
        box.locator("[data-right=yes]").first.click()
        expect(box).to_have_attribute("data-told", "right")
        assert figure.control("outliers").input_value() == own
        words = "The settings were put back to those of the question."
        assert (words in box.get_by_role("status").inner_text()) is (value != own)
        box.get_by_role("button", name="Ask again").click()
