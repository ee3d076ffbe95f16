"""With the system's forced colours, selections and hatched areas are still visible."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Locator, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.layout import count_figures

SCHEMES = ("light", "dark")
HATCHED = ("turned", "quarter", "half", "none")
# How an element that can be selected is drawn: its background and its outline.
LOOK = "e => { const s = getComputedStyle(e); return [s.backgroundColor, s.outlineStyle, s.outlineColor].join(); }"

# The entries of each legend with the same swatch.
ALIKE = """() => [...document.querySelectorAll('main figure.figure')].flatMap(figure => {
  const looks = {};
  for (const key of figure.querySelectorAll('.legend .key')) {
    const s = getComputedStyle(key, '::before');
    const look = [s.width, s.height, s.borderTop, s.borderRadius, s.transform, s.opacity, s.background, s.outline];
    (looks[look.join()] ??= []).push(key.textContent.trim());
  }
  return Object.values(looks).filter(same => same.length > 1).map(same => `${figure.id}: ${same.join(' = ')}`);
})"""
# How marks are drawn.
DRAWN = """all => all.map(e => getComputedStyle(e)).map(s => [s.stroke, s.strokeDasharray, s.fill].join())"""


def inside(key: Locator) -> set[tuple[int, ...]]:
    """The colours well inside a legend's swatch for an area, which is 17 px wide and 10 px high."""
    key.scroll_into_view_if_needed()
    box = key.bounding_box()
    assert box is not None
    left, middle = round(box["x"]), round(box["y"] + box["height"] / 2)
    clip = {"x": left + 4, "y": middle - 3, "width": 10, "height": 6}
    picture = Image.open(io.BytesIO(key.page.screenshot(clip=clip)))  # type: ignore[arg-type]
    return {colour for _, colour in picture.convert("RGB").getcolors() or []}  # type: ignore[misc]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_areas_of_a_map_keep_their_hatching_in_its_legend(reader: Callable[..., Reader], scheme: str) -> None:
    page = reader(forced_colors="active", color_scheme=scheme, reduced_motion="reduce").open("icp.html")
    legend = Figure(page, "fig-atlas").seen().root.locator(".legend")
    for kind in HATCHED:
        assert len(inside(legend.locator(f".key.end-{kind}"))) > 1, kind
    paper = page.evaluate("getComputedStyle(document.documentElement).backgroundColor")
    assert paper != "rgb({}, {}, {})".format(*next(iter(inside(legend.locator(".key.end-shifted")))))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_what_is_chosen_is_seen(reader: Callable[..., Reader], scheme: str) -> None:
    """A search result, an answer, the active pen, a deck's notes."""
    visitor = reader(forced_colors="active", color_scheme=scheme, reduced_motion="reduce")
    page = visitor.open("icp.html")
    answers = Figure(page, "fig-atlas").live().root.locator(".predict-answers button")
    answers.first.click()
    expect(answers.first).to_have_attribute("aria-pressed", "true")
    assert answers.nth(0).evaluate(LOOK) != answers.nth(1).evaluate(LOOK)

    page.locator("button.search-open").click()
    page.keyboard.type("icp")
    result = page.locator("[role=option]")
    expect(result.first).to_have_attribute("aria-selected", "true")
    page.mouse.move(0, 0)
    assert result.nth(0).evaluate(LOOK) != result.nth(1).evaluate(LOOK)

    page = visitor.open("clouds.html")
    pens = Figure(page, "fig-own").live().root.locator("[data-pen]")
    pens.first.click()
    expect(pens.first).to_have_attribute("aria-pressed", "true")
    page.mouse.move(0, 0)
    assert pens.nth(0).evaluate(LOOK) != pens.nth(1).evaluate(LOOK)

    page = visitor.open("slides-icp.html")
    notes, grid = (page.locator(f'.deck-bar [data-slides="{action}"]') for action in ("notes", "grid"))
    notes.click()
    expect(notes).to_have_attribute("aria-pressed", "true")
    page.mouse.move(0, 0)
    assert notes.evaluate(LOOK) != grid.evaluate(LOOK)


def test_legends_tell_apart_what_they_tell_apart_in_colour(
    reader: Callable[..., Reader], site: Path, pages: Sequence[str]
) -> None:
    """No two swatches become one, such as those of wrong pairs that count and of pairs that do not."""
    visitor, faults = reader(forced_colors="active", java_script_enabled=False), []
    for path in pages:
        if count_figures(site, path):
            page = visitor.open(path)
            forced = page.evaluate(ALIKE)
            page.emulate_media(forced_colors="none")
            faults += [f"{path} {pair}" for pair in sorted({*forced} - {*page.evaluate(ALIKE)})]
            page.close()
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_wrong_pairs_that_count_are_seen_among_the_others(reader: Callable[..., Reader], scheme: str) -> None:
    """Rings lie round partners of three kinds at the end of the run."""
    page = reader(forced_colors="active", color_scheme=scheme, reduced_motion="reduce").open("ransac.html")
    figure = Figure(page, "fig-repeated").live()
    figure.button("finish").click()
    figure.settled()
    looks = [figure.root.locator(f".panel .ring.{role}").evaluate_all(DRAWN) for role in ("outlier", "truth", "target")]
    assert all(looks)
    assert len(set().union(*looks)) == len(looks), looks


def test_the_dots_of_a_ghost_are_small(reader: Callable[..., Reader]) -> None:
    """Captions call them so. They are those of the source, from which grey alone would tell them."""
    page = reader(forced_colors="active", java_script_enabled=False).open("reading.html")
    drawing = page.locator(".picture .panel:has(.dot.ghost):has(.dot.source)").first
    width = "e => parseFloat(getComputedStyle(e).strokeWidth)"
    ghost, source = (drawing.locator(f".dot.{role}").first for role in ("ghost", "source"))
    assert ghost.evaluate(width) < 0.6 * source.evaluate(width)
    page.emulate_media(forced_colors="none")
    assert ghost.evaluate(width) < 0.7 * source.evaluate(width)


def test_the_three_residuals_keep_their_dots(reader: Callable[..., Reader]) -> None:
    """Those before the readouts, which are the curves' colours."""
    page = reader(forced_colors="active", reduced_motion="reduce").open("surfaces.html")
    dots = page.locator('#fig-three .figure-desk .readout[class*=" "] dt')
    colours = dots.evaluate_all("all => all.map(e => getComputedStyle(e, '::before').backgroundColor)")
    assert len(colours) == 3
    assert len({*colours}) == 3, colours
