"""What leads in a figure is seen at one look, wide and on a phone; the rest waits behind More; of many one is large."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import LIVE, Figure, figures

# From the lead sentence's top to the bottoms of what must be seen with it, per figure.
BOTTOMS = """() => [...document.querySelectorAll('figure.figure')].map(figure => {
  const first = figure.querySelector('.figure-lead') ?? figure.querySelector('.figure-stage');
  const {top} = first.getBoundingClientRect();
  const bottom = selector => Math.max(0, ...[...figure.querySelectorAll(selector)]
    .map(e => e.getBoundingClientRect()).filter(r => r.height).map(r => r.bottom - top));
  const many = figure.querySelector('.many > .figure-stage > .large');
  return {
    id: figure.id,
    stage: bottom('.figure-stage'),
    panel: many ? bottom('.figure-panel.large > svg') : bottom('.figure-stage > .figure-panel:first-child > svg'),
    button: bottom('.figure-desk > .buttons > :is(.primary, button:first-child)'),
    controls: bottom('.figure-desk .control'),
    first: bottom('.figure-desk .control:first-child'),
    readouts: bottom('.figure-desk .readouts'),
  };
})"""
# The part of the first panel that is in the window and under nothing, while something of its figure has the focus.
SEEN = """([id, index]) => {
  const figure = document.getElementById(id);
  const fields = figure.querySelectorAll('.figure-body :is(input, select, .buttons button)');
  const field = fields[index];
  field.focus();
  const r = field.getBoundingClientRect(), at = document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2);
  const panel = figure.querySelector('.figure-stage > .large > svg, .figure-stage > .figure-panel > svg');
  const box = panel.getBoundingClientRect();
  const shown = Math.min(innerHeight, box.bottom) - Math.max(0, box.top);
  return [shown / box.height, Boolean(at && (at === field || at.closest('label, .control')?.contains(field)))];
}"""



@pytest.mark.parametrize("percent", [100, 130])
@pytest.mark.parametrize(("width", "height"), [(1280, 800), (1440, 900), (390, 844)])
def test_what_leads_fits_one_screen(
    reader: Callable[..., Reader], pages: list[str], width: int, height: int, percent: int
) -> None:
    """Wide: sentence, pictures, main button, controls and readouts. On a phone: sentence, picture, button, control."""
    one = reader(width=width, height=height)
    page, too_tall, count = one.open(), list[str](), 0
    for name in pages:
        page.goto(f"{one.origin}/{name}")
        page.evaluate("percent => { document.documentElement.style.fontSize = `${percent}%`; }", percent)
        page.evaluate("document.fonts.ready")
        parts = ("stage", "button", "controls", "readouts") if width > 640 else ("panel", "button", "first")
        for figure in page.evaluate(BOTTOMS) if not name.startswith("docs-") else []:
            count += 1
            too_tall += [f"{name} {figure['id']}: {part} ends at {figure[part]:.0f} of {height}"
                         for part in parts if figure[part] > height]  # fmt: skip
    assert count > min(30, len(pages) - 1)
    assert not too_tall


def test_a_phone_keeps_the_picture_in_sight(reader: Callable[..., Reader], pages: list[str]) -> None:
    """Whatever of a figure has the focus, More's among it: six tenths of its panel are seen, and so is what has it."""
    one = reader(width=390, height=844, has_touch=True, reduced_motion="reduce")
    page, count = one.open(), 0
    for name in (name for name in pages if not name.startswith("docs-")):
        page.goto(f"{one.origin}/{name}")
        page.evaluate("document.querySelectorAll('details.figure-rest').forEach(e => { e.open = true; })")
        for figure in figures(page):
            fields = figure.root.locator(".figure-body :is(input, select, .buttons button)").count()
            for index in range(fields):
                shown, free = page.evaluate(SEEN, [figure.name, index])
                assert shown >= 0.6, (name, figure.name, index, shown)
                assert free, f"{name} {figure.name}: field {index} has the focus and is covered"
                count += 1
    assert count > min(200, 5 * (len(pages) - 1))


def test_more_opens_in_place_and_goes_with_the_link(reader: Callable[..., Reader]) -> None:
    one = reader()
    icp = Figure(one.open("icp.html"), "fig-nearest").live()
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

    again = Figure(one.open(link(icp).removeprefix(f"{one.origin}/")), "fig-nearest").live()
    expect(again.root.locator("details.figure-rest")).to_have_attribute("open", "")
    expect(again.root.locator('[name="gate"]')).to_have_value("0.8", timeout=LIVE)


def link(figure: Figure) -> str:
    return figure.page.evaluate("name => Ladder.figures.get(name).link()", figure.name)  # type: ignore[no-any-return]


def test_a_click_on_a_chart_behind_more(reader: Callable[..., Reader]) -> None:
    """Its crosshair is there once the chart is, and the chart answers."""
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
    """Whichever panel is large: a handle is a slider there, and an arrow key moves the cloud."""
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


def test_wide_a_panel_is_enlarged_and_let_go(reader: Callable[..., Reader]) -> None:
    race = Figure(reader().open("race.html"), "fig-race").seen()
    panel = race.root.locator('.figure-panel[data-panel="gicp"]')
    small = width(panel)
    panel.locator(".enlarge").click()
    assert width(panel) > 1.8 * small
    panel.locator(".enlarge").click()
    assert width(panel) == small


def width(node: Any) -> float:
    box = node.bounding_box()
    assert box is not None
    return float(box["width"])
