"""Paper does not scroll: content wider than the text is printed whole, and nothing stays behind on a sheet."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure

WIDTH, HEIGHT = 642, 979  # px: A4 within the margins of print.css
# Elements that would have to be scrolled, or extend beyond the paper's edge.
CUT = """() => [...document.querySelectorAll('main :is(.table, .formula, pre, table, .runs-scroll)')]
  .filter(e => e.checkVisibility()).flatMap(e => {
    const scrolls = getComputedStyle(e).overflowX !== 'visible' && e.scrollWidth > e.clientWidth;
    const beyond = e.getBoundingClientRect().left + e.scrollWidth > document.documentElement.clientWidth;
    return scrolls || beyond ? [`${e.className || e.localName}: ${e.textContent.trim().slice(0, 40)}`] : [];
  })"""


def test_wide_tables_are_printed_whole(reader: Callable[..., Reader]) -> None:
    page = reader(width=WIDTH, height=900).open("reference.html")
    page.emulate_media(media="print")
    assert page.locator(".table table").count() > 20
    assert page.evaluate(CUT) == []


# The sheets side by side, broken by the same rules as on paper.
SHEETS = f"""() => {{
  const sheets = new CSSStyleSheet();
  sheets.replaceSync(`html, body {{ margin: 0 !important; overflow: visible !important }}
    body {{ width: {WIDTH}px; height: {HEIGHT}px; columns: {WIDTH}px !important; column-gap: 20px !important;
      column-fill: auto !important }}`);
  document.adoptedStyleSheets = [sheets];
}}"""
# Heads that end a sheet whose next one begins with what they head, and captions without their figure.
STRANDED = f"""() => {{
  const sheet = ({{ left }}) => Math.floor(left / {WIDTH + 20});
  const drawn = (e) => e && e.checkVisibility() && e.getClientRects().length > 0;
  const apart = (e, next) => drawn(e) && drawn(next) && sheet([...e.getClientRects()].at(-1))
    !== sheet(next.getClientRects()[0]);
  const heads = [...document.querySelectorAll('main :is(h2, h3, .fold > summary, .figure-after > p, .in-short-title)')];
  const captions = [...document.querySelectorAll('main figure.figure')].map((f) => {{
    const inside = [...f.querySelectorAll('svg, .readouts, .legend, .runs')].filter(drawn);
    return [inside.at(-1), f.querySelector('.caption')];
  }});
  return [...heads.map((e) => [e, e.nextElementSibling]), ...captions]
    .filter((pair) => apart(...pair)).map((pair) => pair[1].textContent.trim().slice(0, 50));
}}"""


def print_page(page: Page) -> Page:
    """The page as it is printed now, after what its reader did at a desk."""
    page.set_viewport_size({"width": WIDTH, "height": HEIGHT})
    page.emulate_media(media="print")
    return page


@pytest.mark.parametrize("path", ["reading.html", "search.html", "space.html", "race.html"])
def test_no_head_and_no_caption_is_left_alone(reader: Callable[..., Reader], path: str) -> None:
    page = print_page(reader().open(path))
    page.evaluate(SHEETS)
    assert page.evaluate("document.body.scrollWidth") > 5 * WIDTH
    assert page.evaluate(STRANDED) == []


# Parts that the end of a sheet divides.
DIVIDED = """(whole) => [...document.querySelectorAll(whole)].filter((e) => e.checkVisibility())
  .filter((e) => e.getClientRects().length > 1).map((e) => e.textContent.trim().slice(0, 50))"""


@pytest.mark.parametrize(
    ("path", "whole"),
    [
        ("race.html", ".job, .figure-panel, .fold > summary"),
        ("icp.html", "#fig-nearest, #fig-gate, .figure-panel, .fold > summary"),
    ],
)
def test_no_sheet_divides_a_picture_from_its_words(reader: Callable[..., Reader], path: str, whole: str) -> None:
    """Nor a benchmark's table from its head; a figure with a chart shares its sheet with what it comes to."""
    page = print_page(reader().open(path))
    page.evaluate(SHEETS)
    assert page.locator(whole).count() > 3
    assert page.evaluate(DIVIDED, whole) == []


def test_numbers_begin_where_their_picture_does(reader: Callable[..., Reader]) -> None:
    """For its styles, paper is as wide as the whole sheet, which is a tablet's width."""
    page = reader(width=794, height=1123).open("icp.html")
    page.emulate_media(media="print")
    figure = Figure(page, "fig-nearest")
    [stage], [numbers], [chart] = (figure.boxes(f".figure-{part}") for part in ("stage", "desk > .readouts", "charts"))
    assert numbers["x"] == stage["x"]
    assert numbers["x"] + numbers["width"] < chart["x"]


def test_legends_keep_their_swatches(reader: Callable[..., Reader]) -> None:
    """Browsers print no backgrounds unless told to, and dots and squares are backgrounds."""
    page = print_page(reader().open("surfaces.html"))
    marks = page.locator(":is(.figure, .claim) :is(.key, .readout dt, .claim-mark)")
    assert marks.count() > 10
    adjusts = "all => all.map(e => getComputedStyle(e, '::before').printColorAdjust)"
    assert {*marks.evaluate_all(adjusts)} == {"exact"}


def test_pinned_runs_are_printed_whole(reader: Callable[..., Reader]) -> None:
    """Their 18 numbers stand beside their names, as wide as those are."""
    page = reader().open("four.html")
    figure = Figure(page, "fig-four").live()
    for _ in range(2):
        figure.reached("[data-pin]").click()
    assert print_page(page).evaluate(CUT) == []
    names = figure.boxes(".runs thead th")
    for run in range(2):
        values = figure.boxes(f".runs tbody tr >> nth={run} >> :is(th, td:not(.runs-do))")
        assert [box["y"] for box in values] == pytest.approx([box["y"] for box in names], abs=0.5)


def test_a_used_figure_is_not_printed_with_the_end_of_another_run(reader: Callable[..., Reader]) -> None:
    """What a figure comes to is drawn for its first settings: it is for a figure that is printed with those."""
    page = reader().open("drive.html")
    used = Figure(page, "fig-wrong-loop").live()
    used.set("kernel", "cauchy")
    used.settled().button("add").click()
    used.settled()
    print_page(page)
    expect(used.root.locator(".figure-after")).to_be_hidden()
    expect(page.locator("#fig-drive .figure-after")).to_be_visible()


def test_a_figure_in_motion_is_printed_at_its_end(reader: Callable[..., Reader]) -> None:
    """Its picture agrees with its numbers, which are those of the end from the first on."""
    page = reader(reduced_motion="no-preference").open("icp.html")
    figure = Figure(page, "fig-nearest").live().settled()
    page.evaluate("Ladder.limits.motion = 1e9")
    figure.button("step").click()
    expect(figure.root.locator("svg.moving")).to_have_count(1)
    page.pdf()
    expect(figure.root.locator("svg.moving")).to_have_count(0)
    assert figure.root.locator(".figure-stage svg g[transform]").count() == 0
    assert figure.settled().record()["log"] == [["press", "step"]]


def test_the_charts_of_a_benchmark_have_room_for_their_words(reader: Callable[..., Reader]) -> None:
    page = print_page(reader().open("race.html"))
    outside = page.locator("#fig-race .job-panels svg").evaluate_all(
        """all => all.flatMap((svg) => {
          const { left, right } = svg.getBoundingClientRect();
          return [...svg.querySelectorAll('text')].filter((text) => {
            const box = text.getBoundingClientRect();
            return box.width && (box.left < left || box.right > right);
          }).map((text) => text.textContent);
        })"""
    )
    assert outside == []


# How far the paper that is used reaches beyond the last line of text, px.
BLANK = """() => {
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const range = document.createRange();
  let bottom = 0;
  while (texts.nextNode()) {
    range.selectNodeContents(texts.currentNode);
    if (texts.currentNode.parentElement.checkVisibility()) {
      bottom = Math.max(bottom, range.getBoundingClientRect().bottom);
    }
  }
  return document.documentElement.getBoundingClientRect().bottom - bottom;
}"""


@pytest.mark.parametrize("path", ["clouds.html", "four.html", "docs-commands.html", "references.html"])
def test_no_blank_sheet_comes_last(reader: Callable[..., Reader], path: str) -> None:
    """What follows the last line is no more than a margin, which needs no sheet of its own."""
    page = print_page(reader().open(path))
    assert page.evaluate(BLANK) < 40
