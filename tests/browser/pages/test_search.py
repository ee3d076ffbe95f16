"""Searching as a reader does: by keyboard, on wide and narrow screens, from disk, and with a typing mistake."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, expect

from tests.browser.conftest import Reader
from tests.browser.server import SiteServer, published_anew


@pytest.mark.parametrize("width", [1280, 390])
def test_search_by_key_leads_to_the_section(reader: Callable[..., Reader], width: int) -> None:
    """The slash opens it, arrows choose, Enter goes there, Escape closes it; typed text never becomes markup."""
    page = reader(width, 800).open("kabsch.html")
    page.keyboard.press("/")
    field = page.get_by_role("combobox", name="Search all pages")
    expect(field).to_be_focused()
    options = page.locator(".search").get_by_role("option")
    for words in ("levenberg", "Lévenberg", "Le\u0301venberg", "levenbrg"):  # the third has a separate combining accent
        field.fill(words)
        expect(options.first).to_contain_text("Levenberg–Marquardt")
    expect(page.locator(".search-told")).to_contain_text("place")
    assert not [v["id"] for v in Axe().run(page, context=".search").response["violations"]]
    field.press("ArrowDown")
    expect(options.nth(1)).to_have_attribute("aria-selected", "true")
    assert field.get_attribute("aria-activedescendant") == options.nth(1).get_attribute("id")
    field.fill("<img src=x onerror=alert(1)>")
    expect(page.locator(".search-told")).not_to_contain_text("place")
    assert page.locator(".search img").count() == 0
    field.fill("qqqq zzzz")
    expect(page.locator(".search-told")).to_have_text("Nothing found")
    field.press("Escape")
    expect(field).to_be_hidden()
    page.keyboard.press("Control+k")
    field.fill("a local minimum need not be near the truth")
    href = options.first.get_attribute("href") or ""
    field.press("Enter")
    page.wait_for_url(f"**/{href}")
    anchor = href.partition("#")[2]
    expect(page.locator(f"#{anchor}" if anchor else "h1")).to_be_in_viewport()


@pytest.mark.parametrize(
    ("words", "address"),
    [
        ("forty minutes", "index.html#forty-minutes"),
        ("40 minutes", "index.html#forty-minutes"),
        ("which method", "index.html#which"),
    ],
)
def test_a_reader_in_a_hurry_or_in_doubt_is_led_to_the_right_section(
    reader: Callable[..., Reader], words: str, address: str
) -> None:
    page = reader().open("index.html")
    page.keyboard.press("/")
    page.get_by_role("combobox", name="Search all pages").fill(words)
    expect(page.locator(".search").get_by_role("option").first).to_have_attribute("href", address)


def test_words_that_no_section_has_together_lead_to_the_closest(reader: Callable[..., Reader]) -> None:
    """A whole question finds the sections that have most of it, and says that none has all."""
    page = reader().open("index.html")
    page.keyboard.press("/")
    page.get_by_role("combobox", name="Search all pages").fill("the condition number of a hall")
    status, options = page.locator(".search-told"), page.locator(".search").get_by_role("option")
    expect(status).to_have_text("No section has all of these words; the closest")
    expect(options.filter(has_text="What the pairs constrain")).to_have_attribute("href", "surfaces.html#hold")
    assert 1 < options.count() <= 8


def test_search_from_disk_and_none_without_scripts(browser: Browser, site: Path) -> None:
    """A page opened from disk can be searched too; without scripts the button is hidden."""
    with browser.new_context() as context:
        page = context.new_page()
        page.goto((site / "index.html").as_uri())
        page.get_by_role("button", name="Search").click()
        page.get_by_role("combobox").fill("gate")
        expect(page.locator(".search").get_by_role("option").first).to_contain_text("Gate")
    with browser.new_context(java_script_enabled=False) as context:
        page = context.new_page()
        page.goto((site / "index.html").as_uri())
        expect(page.locator(".search-open")).to_be_hidden()


@pytest.mark.parametrize("text", ["levenberg" * 6700, "a b c d e " * 6000], ids=["a word", "words"])
def test_of_a_very_long_question_the_first_characters_are_asked(reader: Callable[..., Reader], text: str) -> None:
    """Pasted whole, 60,000 characters find what the first 200 find."""
    page = reader().open("kabsch.html")
    page.keyboard.press("/")
    field, told = page.get_by_role("combobox", name="Search all pages"), page.locator(".search-told")
    answers = []
    for asked in (text[:200], text):
        field.fill("levenberg")
        expect(page.locator(".search").get_by_role("option").first).to_be_visible()
        found = told.inner_text()
        field.press("Control+a")
        page.evaluate("asked => document.execCommand('insertText', false, asked)", asked)
        expect(told).not_to_have_text(found)
        assert field.input_value() == text[:200]
        answers.append(told.inner_text())
    assert answers[0] == answers[1]


def test_enter_that_ends_a_composition_opens_nothing(reader: Callable[..., Reader]) -> None:
    """If words are composed with several keys, the first Enter accepts the word, the second opens the result."""
    page = reader(alone=True).open("icp.html")
    page.evaluate("Ladder.alive")
    page.keyboard.press("/")
    page.keyboard.type("hub")
    expect(page.locator('[role="option"]').first).to_be_visible()
    field = page.locator("dialog input")
    field.dispatch_event("keydown", {"key": "Enter", "isComposing": True})
    expect(page.locator("dialog[open]")).to_be_visible()
    field.dispatch_event("keydown", {"key": "Enter"})
    expect(page.locator("dialog[open]")).to_be_hidden()


def test_a_selection_that_ends_outside_leaves_the_search_open(reader: Callable[..., Reader]) -> None:
    """A click outside closes it."""
    page = reader().open("kabsch.html")
    page.keyboard.press("/")
    field = page.get_by_role("combobox", name="Search all pages")
    field.fill("levenberg")
    box = field.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(5, 5, steps=3)
    page.mouse.up()
    expect(field).to_be_visible()
    page.mouse.click(5, 5)
    expect(field).to_be_hidden()


def test_a_page_older_than_the_site_offers_a_reload_for_its_search(
    reader: Callable[..., Reader], server: SiteServer, site: Path, tmp_path: Path
) -> None:
    """Without a new build it says only that the search failed, and a later query tries again."""
    visitor = reader()
    visitor.expect("404", "Refused to execute")
    page = visitor.open("kabsch.html")
    server.forbid(r"/assets/search\.")
    page.keyboard.press("/")
    field = page.get_by_role("combobox", name="Search all pages")
    told, reload = page.locator(".search-told"), page.locator(".search").get_by_role("button", name="Reload")
    field.fill("levenberg")
    expect(told).to_have_text("The search could not be loaded.")
    server.root = published_anew(site, tmp_path)
    field.fill("levenberg m")
    expect(told).to_have_text("This site has been updated. Reload")
    server.forbid(None)
    with page.expect_navigation():
        reload.click()
    page.keyboard.press("/")
    field.fill("levenberg")
    expect(page.locator(".search").get_by_role("option").first).to_contain_text("Levenberg–Marquardt")
