"""The tools below a job's table, and what is offered instead where the clipboard refuses."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.figures.test_jobs import job, rows

CLIPBOARD = """Object.defineProperty(navigator, "clipboard", { value: {
  writeText: async (text) => { if (%s) throw new Error("refused"); window.copied = text; } } });"""


@pytest.fixture
def opened(reader: Callable[..., Reader]) -> Callable[..., Page]:
    """Open a page whose clipboard notes what it gets, or refuses."""

    def open_page(path: str, refuses: bool = False) -> Page:
        visitor = reader(alone=True, reduced_motion="reduce")
        visitor.expect("Access to font", "ERR_FAILED", "A preload for")  # as on every page opened from disk
        visitor.context.add_init_script(CLIPBOARD % str(refuses).lower())
        return visitor.open(path)

    return open_page


def cells(text: str) -> list[list[str]]:
    return list(csv.reader(text.splitlines()))


def test_a_table_is_copied_and_saved_as_it_is_and_its_python_is_copied(opened: Callable[..., Page]) -> None:
    """A kept run is in the file too, each under its caption."""
    page = opened("race.html")
    race = Figure(page, "fig-race").seen()
    box = job(race)
    words, names = box.locator(".job-words"), [row[0] for row in rows(race)]
    box.locator('[data-do="csv"]').click()
    expect(words).to_have_text("Table copied.")
    copied = page.evaluate("copied")
    assert [row[0] for row in cells(copied)[1:]] == names
    box.locator('[data-do="python"]').click()
    expect(words).to_have_text("Python copied.")
    compile(page.evaluate("copied"), "copied", "exec")
    caption = box.locator(".job-caption").first.inner_text()
    box.locator('[data-do="keep"]').click()
    expect(box.locator('[data-do="drop"]')).to_be_focused()
    with page.expect_download() as coming:
        box.locator('[data-do="save"]').click()
    assert coming.value.suggested_filename == "race-fig-race-benchmark.csv"
    assert Path(coming.value.path()).read_text("utf-8") == f"{caption}\n{copied}\n{caption}\n{copied}"


def test_a_table_keeps_its_place_and_focus_and_is_named(opened: Callable[..., Page]) -> None:
    """When it is sorted on a narrow screen: the scrolled region is named after the run, and its headings are reached
    whole."""
    page = opened("race.html")
    page.set_viewport_size({"width": 420, "height": 900})
    race = Figure(page, "fig-race").seen()
    box = job(race)
    region = box.get_by_role("group", name=box.locator(".job-caption").first.inner_text(), exact=True)
    expect(region).to_have_attribute("tabindex", "0")
    heading = box.locator('[data-sort="3"]')
    heading.focus()
    place = region.evaluate("e => { e.scrollLeft = 90; return e.scrollLeft; }")
    assert place > 0
    heading.evaluate("e => e.click()")
    expect(heading).to_be_focused()
    assert region.evaluate("e => e.scrollLeft") == place
    box.locator('[data-sort="1"]').evaluate("e => e.click()")
    expect(box.locator("thead th").nth(2)).to_have_attribute("aria-sort", "ascending")


def test_a_job_says_what_it_does(opened: Callable[..., Page], site: Path) -> None:
    """From disk, that there is no Python; live, that it runs and of which run the table is after Stop."""
    race = Figure(opened("race.html"), "fig-race").live().settled()
    words = job(race).locator(".job-words")
    said = race.page.evaluate("""() => {
      const box = document.querySelector('section.job'), said = [];
      for (const action of ['begin', 'stop']) {
        box.querySelector(`[data-do=${action}]`).click();
        said.push(box.querySelector('.job-words').textContent);
      }
      return said;
    }""")
    assert said == ["Running.", "Stopped. The table is from the previous run."]
    race.page.goto((site / "race.html").as_uri())
    race.reached('[data-do="begin"]').click()
    expect(words).to_have_text("A page opened from disk has no Python to run this.")


@pytest.mark.parametrize(
    ("page", "name", "button", "label"),
    [
        ("kabsch.html", "fig-solve", "[data-link]", "Link to this state:"),
        ("kabsch.html", "fig-solve", ".runs [data-do=Copy]", "Pinned runs:"),
        ("race.html", "fig-race", '.job-tools [data-do="csv"]', "Table:"),
    ],
)
def test_what_the_clipboard_refuses_is_offered_selected(
    opened: Callable[..., Page], page: str, name: str, button: str, label: str
) -> None:
    """In a field that goes with the figure's next question."""
    figure = Figure(opened(page, refuses=True), name).live().settled()
    figure.reached("[data-pin]").click()
    figure.reached(button).click()
    field = figure.root.get_by_label(label, exact=True)
    expect(field).to_be_focused()
    assert field.evaluate("e => e.selectionEnd - e.selectionStart") == len(field.input_value()) > 20
    figure.button("new").click()
    expect(field).to_have_count(0)


def test_code_that_the_clipboard_refuses_is_selected(opened: Callable[..., Page]) -> None:
    page = opened("kabsch.html", refuses=True)
    solve = Figure(page, "fig-solve").seen()
    solve.root.get_by_text("In words, and in Python").click()
    solve.root.get_by_role("button", name="Copy the Python").click()
    code = solve.root.locator(".figure-python code").text_content()
    page.wait_for_function("code => getSelection().toString().trim() === code.trim()", arg=code)
