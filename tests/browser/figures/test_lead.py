"""The parts of a figure that do not lead are behind More; of many panels one is large. That the leading parts fit on
one screen is tested in tests/browser/accessibility/test_axe.py for every wide page and in
tests/browser/pages/test_static.py for every page on a phone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import LIVE, Figure


def test_more_opens_in_place_and_goes_with_the_link(reader: Callable[..., Reader]) -> None:
    visitor = reader()
    icp = Figure(visitor.open("icp.html"), "fig-nearest").live()
    gate = icp.root.locator('[name="gate"]')
    expect(gate).to_be_hidden()
    assert "&more" not in link(icp)
    before = icp.root.locator(".figure-stage").bounding_box()
    summary = icp.root.locator(".figure-rest > summary")
    summary.focus()
    summary.press("Enter")
    expect(gate).to_be_visible()
    assert icp.root.locator(".figure-stage").bounding_box() == before
    expect(icp.root.locator('[data-panel="errors"] svg')).to_be_visible()
    icp.set("gate", "0.8")
    until(icp.page, "Ladder.figures.get('fig-nearest').shown.controls.gate === 0.8")

    second = Figure(visitor.open(link(icp).removeprefix(f"{visitor.origin}/")), "fig-nearest").live()
    expect(second.root.locator("details.figure-rest")).to_have_attribute("open", "")
    expect(second.root.locator('[name="gate"]')).to_have_value("0.8", timeout=LIVE)


def link(figure: Figure) -> str:
    return figure.page.evaluate("name => Ladder.figures.get(name).link()", figure.name)  # type: ignore[no-any-return]


def test_a_click_on_a_chart_behind_more(reader: Callable[..., Reader]) -> None:
    """Its crosshair appears with the chart, and the chart answers."""
    race = Figure(reader(height=1400).open("race.html"), "fig-race").live()
    cross = race.root.locator('[data-pick="errors"]')
    expect(cross).to_be_hidden()
    race.root.locator(".figure-rest > summary").click()
    expect(cross).to_be_visible()
    cross.focus()
    cross.press("Enter")
    until(race.page, "Ladder.figures.get('fig-race').record.log.length === 1")


@pytest.mark.parametrize("name", ["race fig-race", "four fig-four", "contestants fig-nine", "surfaces fig-three"])
def test_a_panel_enlarged_at_a_touch(reader: Callable[..., Reader], name: str) -> None:
    page, figure_id = name.split()
    figure = Figure(reader(width=390, height=844, has_touch=True).open(f"{page}.html"), figure_id).seen()
    panels = figure.root.locator(".figure-stage > .figure-panel")
    first, second = panels.nth(0), panels.nth(1)
    assert width(first) > 2 * width(second)
    second.locator(".enlarge").tap()
    expect(second.locator(".enlarge")).to_have_attribute("aria-pressed", "true")
    assert width(second) > 2 * width(first)
    first.locator(".enlarge").focus()
    first.locator(".enlarge").press("Enter")
    assert width(first) > 2 * width(second)


def test_on_a_phone_the_large_panel_has_the_handles_for_keys(reader: Callable[..., Reader]) -> None:
    """Whichever panel is large, a handle is a slider there, and an arrow key moves the cloud."""
    four = Figure(reader(width=390, height=844).open("four.html"), "fig-four").live()
    handle = four.root.locator('.handle:not(.copy)[data-handle="source"]')
    expect(handle).to_have_attribute("data-panel", "cpd")
    four.root.locator('.figure-panel[data-panel="mmd"] .enlarge').click()
    expect(handle).to_have_attribute("data-panel", "mmd")
    handle.focus()
    before = handle.get_attribute("aria-valuetext")
    handle.press("ArrowLeft")
    expect(handle).not_to_have_attribute("aria-valuetext", before or "")
    expect(handle).to_be_focused()
    assert four.settled().record()["log"][0][:2] == ["drag", "source"]


@pytest.mark.parametrize(("page", "id_", "name"), [("race", "fig-race", "gicp"), ("index", "fig-map", "nearest"),
                                                   ("surfaces", "fig-three", "plane")])  # fmt: skip
def test_wide_a_panel_is_enlarged_and_let_go(reader: Callable[..., Reader], page: str, id_: str, name: str) -> None:
    figure = Figure(reader().open(f"{page}.html"), id_).seen()
    panel = figure.root.locator(f'.figure-panel[data-panel="{name}"]')
    small = width(panel)
    panel.locator(".enlarge").click()
    assert width(panel) > 1.8 * small
    panel.locator(".enlarge").click()
    assert width(panel) == small


@pytest.mark.parametrize("size", [(640, 400), (320, 256)])
@pytest.mark.parametrize("name", ["race fig-race", "four fig-four", "mmd fig-waves"])
def test_a_picture_in_a_zoomed_window(reader: Callable[..., Reader], name: str, size: tuple[int, int]) -> None:
    """At 200 % and 400 % zoom the main picture of several fills its column or the window's height."""
    page, figure_id = name.split()
    figure = Figure(reader(*size).open(f"{page}.html"), figure_id).seen()
    panel = figure.root.locator(".figure-stage > .figure-panel").first.locator("svg")
    box = panel.bounding_box()
    assert box is not None
    count = 2 if size[0] > 600 and name.startswith("mmd") else 1
    column = (width(figure.root) - 32) / count
    assert box["width"] >= 0.9 * column or box["height"] >= 0.6 * size[1]
    assert box["height"] < size[1]


@pytest.mark.parametrize("name", ["icp fig-atlas", "icp fig-dial-nearest", "ndt-map fig-cells", "contestants fig-nine",
                                  "landscape fig-mmd", "search fig-turns", "uncertainty fig-needle"])  # fmt: skip
def test_on_a_phone_the_question_is_on_the_first_screen(reader: Callable[..., Reader], name: str) -> None:
    """It comes before the numbers and charts, so that it is seen with the figure's sentence."""
    page, figure_id = name.split()
    figure = Figure(reader(width=390, height=844).open(f"{page}.html"), figure_id).seen()
    top, bottom = figure.root.evaluate("""root => [root.querySelector('.figure-lead').getBoundingClientRect().top,
      root.querySelector('.predict').getBoundingClientRect().bottom]""")
    assert bottom - top <= 844


def width(node: Any) -> float:
    box = node.bounding_box()
    assert box is not None
    return float(box["width"])
