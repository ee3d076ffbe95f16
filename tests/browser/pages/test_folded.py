"""Things to try are folded below their figure, and counts below their sentence: an address inside opens them, and they
are open on paper."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import expect

from tests.browser.conftest import Reader


def test_an_address_inside_opens_it(reader: Callable[..., Reader]) -> None:
    """When the page is opened, and on a page that is already open."""
    visitor = reader(reduced_motion="reduce")
    page = visitor.open("surfaces.html")
    names = page.locator(".try-this [id]").evaluate_all("all => all.map(({ id }) => id)")
    assert names
    expect(page.locator(f"#{names[0]}")).to_be_hidden()
    page.evaluate("name => { location.hash = name; }", names[0])
    expect(page.locator(f"#{names[0]}")).to_be_in_viewport()
    second = visitor.open(f"surfaces.html#{names[-1]}")
    expect(second.locator(f"#{names[-1]}")).to_be_in_viewport()


def test_a_long_word_in_large_text_fits_a_phone(reader: Callable[..., Reader]) -> None:
    page = reader(390, 844).open("space.html")
    page.evaluate("""() => {
      document.documentElement.style.fontSize = '200%';
      for (const fold of document.querySelectorAll('.try-this')) fold.open = true;
    }""")
    buttons = page.get_by_role("button", name="circumference").all()
    boxes = [box for button in buttons if (box := button.bounding_box())]
    assert boxes
    assert max(box["x"] + box["width"] for box in boxes) <= 390


def test_paper_has_it_open(reader: Callable[..., Reader]) -> None:
    page = reader().open("surfaces.html")
    inside = page.locator(".try-this > p").first
    expect(inside).to_be_hidden()
    page.emulate_media(media="print")
    expect(inside).to_be_visible()
    assert not page.locator(".try-this[open]").count()


def test_without_scripts_it_opens_at_a_press(reader: Callable[..., Reader]) -> None:
    page = reader(java_script_enabled=False).open("surfaces.html")
    fold = page.locator(".try-this").first
    fold.locator("summary").click()
    expect(fold.locator("> p").first).to_be_visible()


def test_counts_are_folded_where_scripts_run(reader: Callable[..., Reader]) -> None:
    """A press unfolds them; on paper they are open."""
    page = reader().open("docs-style.html")
    table = page.locator(".evidence table")
    expect(table).to_be_hidden()
    page.locator(".evidence summary").click()
    expect(table).to_be_visible()
    page.locator(".evidence summary").click()
    expect(table).to_be_hidden()
    page.emulate_media(media="print")
    expect(table).to_be_visible()


def test_counts_are_open_without_scripts(reader: Callable[..., Reader]) -> None:
    """Answers are not: a reader opens them when ready."""
    page = reader(java_script_enabled=False).open("docs-style.html")
    expect(page.locator(".evidence table")).to_be_visible()
    expect(page.locator(".answer p")).to_be_hidden()
