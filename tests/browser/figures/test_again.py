"""A press that is doubled, held down or made while pointing acts as often as the reader means."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.held import HELD
from tests.browser.widgets.test_atlas import log, pixel


@pytest.fixture
def slow(reader: Callable[..., Reader]) -> Figure:
    """ICP's figure with Python up, whose answers are held back from now on."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script(HELD)
    page = visitor.open("icp.html")
    name = page.locator("figure.figure:has([data-button=finish])").first.get_attribute("id")
    figure = Figure(page, name or "").live().settled()
    page.evaluate("window.holding = true")
    return figure


def test_to_the_end_is_pressed_once_by_a_double_click(slow: Figure) -> None:
    """A single Back then undoes it."""
    before = slow.readout("rms")
    slow.button("finish").dblclick()
    slow.page.evaluate("letGo()")
    slow.changes("rms", before)
    assert slow.record()["log"] == [["press", "finish"]]
    slow.button("back").click()
    slow.shows("rms", before)


def test_a_key_that_is_held_does_no_more_than_is_seen(slow: Figure) -> None:
    """While Enter repeats, no press queues behind the one being drawn; the repeats do not pause Run."""
    slow.button("step").focus()
    for _ in range(12):
        slow.page.keyboard.down("Enter")
    slow.page.keyboard.up("Enter")
    slow.page.evaluate("letGo()")
    slow.settled()
    assert slow.record()["log"] == [["press", "step"]]
    run = slow.button("run")
    run.focus()
    for _ in range(3):
        slow.page.keyboard.down("Enter")
    slow.page.keyboard.up("Enter")
    expect(run).to_have_text("Pause")


def test_a_handle_stops_with_the_key(slow: Figure) -> None:
    """A key held for twelve repeats moves the handle twice: for the frame being drawn and the one that waits."""
    handle = slow.handle("source")
    x = slow.frame()["handles"][0]["slider"][2]
    handle.focus()
    for _ in range(12):
        slow.page.keyboard.down("ArrowRight")
    slow.page.keyboard.up("ArrowRight")
    slow.page.evaluate("letGo()")
    slow.settled()
    (_, _, at, _) = slow.record()["log"][-1]
    assert at - x == pytest.approx(0.1, abs=0.01)


def test_a_link_to_a_state_works_again(reader: Callable[..., Reader]) -> None:
    """Even after a reset, when the address already has that state; and if a program has percent-encoded the address."""
    name = "fig-solve"
    page = reader(reduced_motion="reduce").open("kabsch.html")
    figure = Figure(page, name).live()
    figure.button("solve").click()
    record = figure.settled().record()
    address = page.evaluate(f"Ladder.figures.get({name!r}).link()").split("#")[1]
    page.evaluate("""address => {
      const link = Object.assign(document.createElement("a"), { href: `#${address}`, textContent: "that state" });
      document.querySelector("main").prepend(link);
    }""", address)
    link = page.get_by_role("link", name="that state")
    for _ in range(2):
        figure.button("reset").click()
        assert figure.settled().record() != record
        link.click()
        until(page, f"Ladder.figures.get({name!r}).record.log.length > 0")
        assert figure.settled().record() == record
    fragment = address.replace("?", "%3F").replace("=", "%3D") + "%26more"
    second = reader(reduced_motion="reduce").open(f"kabsch.html#{fragment}")
    until(second, f"Ladder.figures.get({name!r}).record.log.length > 0")
    assert Figure(second, name).settled().record() == record


@pytest.fixture
def atlas(reader: Callable[..., Reader]) -> Figure:
    return Figure(reader(reduced_motion="reduce").open("icp.html"), "fig-atlas").live().settled()


def test_pressing_while_pointing_leaves_nothing_of_the_pointing(atlas: Figure) -> None:
    """With the pointer on another start, Step continues the previous run, and Back undoes the step."""
    atlas.button("step").focus()
    atlas.page.mouse.move(*pixel(atlas, 170.0, 1.0))
    until(atlas.page, "Ladder.figures.get('fig-atlas').record.log.length === 1")
    atlas.settled()
    for count in (1, 2):
        atlas.page.keyboard.press("Enter")
        until(atlas.page, f"Ladder.figures.get('fig-atlas').record.log.length === {count}")
        atlas.settled()
    assert log(atlas) == [["press", "step"], ["press", "step"]]


def test_a_run_goes_on_where_it_was_after_pointing(atlas: Figure) -> None:
    atlas.button("run").focus()
    places = [pixel(atlas, x, 1.0) for x in (170.0, -90.0, 60.0)]  # before drawings follow each other
    atlas.page.keyboard.press("Enter")
    for x, y in places:
        atlas.page.mouse.move(x, y)
        until(atlas.page, "!Ladder.figures.get('fig-atlas').pending")
    until(atlas.page, "Ladder.figures.get('fig-atlas').record.log.filter(([kind]) => kind === 'press').length > 4")
    kinds = [kind for kind, *_ in log(atlas)]
    assert "hover" not in kinds[:-1]


def test_back_takes_back_a_doing_not_a_pointing(reader: Callable[..., Reader]) -> None:
    """In a figure where the last place pointed at stays."""
    cells = Figure(reader(reduced_motion="reduce").open("ndt-map.html"), "fig-cells").live().settled()
    button = cells.root.locator('.buttons [data-button]:not([aria-disabled="true"])').first
    name = button.get_attribute("data-button")
    button.click()
    until(cells.page, "Ladder.figures.get('fig-cells').record.log.length === 1")
    cells.settled()  # the picture must not change while it is measured
    box = cells.root.locator('.figure-panel[data-panel="main"] svg').bounding_box()
    assert box
    cells.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    until(cells.page, "Ladder.figures.get('fig-cells').record.log.at(-1)[0] === 'hover'")
    assert cells.record()["log"][0] == ["press", name]
    cells.settled().button("back").focus()
    cells.page.keyboard.press("Enter")
    cells.settled()
    assert [kind for kind, *_ in cells.record()["log"]] in ([], ["hover"])


def test_back_to_a_link_leaves_the_work_that_was_done_since(reader: Callable[..., Reader]) -> None:
    """Also after a second click on that link. The same link followed anew, from elsewhere, does set its state."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    address = page.evaluate("Ladder.figures.get('fig-solve').link()").split("#")[1]
    page.goto(f"{page.url}#{address}")
    solve = Figure(page, "fig-solve").live().settled()
    page.evaluate("""address => document.querySelector("main").insertAdjacentHTML("afterbegin",
      `<p><a href="#${address}">that state</a> <a href="#slides">elsewhere</a></p>`)""", address)
    state, elsewhere = (page.get_by_role("link", name=name, exact=True) for name in ("that state", "elsewhere"))
    stage = solve.root.locator(".figure-stage")
    for again in (False, True):
        if again:
            state.click()
            assert solve.settled().record()["log"] == []
        solve.button("solve").click()
        solve.settled()
        elsewhere.click()
        page.go_back()
        expect(stage).to_be_focused()
        assert solve.settled().record()["log"] == [["press", "solve"]]
    elsewhere.click()
    state.click()
    expect(stage).to_be_focused()
    until(page, "Ladder.figures.get('fig-solve').record.log.length === 0")


def test_back_from_one_state_to_another_shows_that_one(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live().settled()
    link = "Ladder.figures.get('fig-solve').link()"
    first = page.evaluate(link)
    solve.button("solve").click()
    second = solve.settled().page.evaluate(link)
    for address, count in ((first, 0), (second, 1)):
        page.goto(address)
        until(page, f"Ladder.figures.get('fig-solve').record.log.length === {count}")
    page.go_back()
    until(page, "Ladder.figures.get('fig-solve').record.log.length === 0")


def hold_enter(button: Locator) -> None:
    button.focus()
    for _ in range(4):
        button.page.keyboard.down("Enter")
    button.page.keyboard.up("Enter")


def test_a_held_enter_goes_no_further_than_its_button(reader: Callable[..., Reader]) -> None:
    """It moves the focus to the next pin's Remove, to the first answer and to Stop: the repeats press none of them."""
    page = reader(reduced_motion="reduce").open("icp.html")
    wall = Figure(page, "fig-wall").live()
    for _ in range(3):
        wall.reached("[data-pin]").click()
    rows = wall.root.locator(".runs tbody tr")
    expect(rows).to_have_count(3)
    hold_enter(rows.first.get_by_role("button", name="Remove"))
    expect(rows).to_have_count(2)
    question = wall.root.locator(".predict")
    question.locator("[data-right=no]").first.click()
    hold_enter(question.get_by_role("button", name="Ask again"))
    expect(question.locator(".predict-answers button").first).to_be_focused()
    expect(question.locator('[aria-pressed="true"]')).to_have_count(0)
    page.goto(page.url.replace("icp", "race"))
    job = Figure(page, "fig-race").live().reached("section.job").first
    hold_enter(job.locator('[data-do="begin"]'))
    expect(job.locator('[data-do="stop"]')).to_be_focused()
    expect(job).to_have_attribute("data-state", "running")
