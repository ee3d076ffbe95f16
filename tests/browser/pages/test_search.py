"""Searching as a reader does: by keyboard, on wide and narrow screens, from disk, and with a typing mistake."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer, published_anew

ONE = "a local minimum need not be near the truth"  # words that a single section has


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
    field.fill(ONE)
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


def opened(page: Page) -> tuple[Locator, Locator, Locator]:
    """The search, opened by its key: its field, its results and what is said of them."""
    page.keyboard.press("/")
    dialog = page.locator(".search")
    return dialog.get_by_role("combobox"), dialog.get_by_role("option"), dialog.get_by_role("status")


def test_arrows_go_round_the_results_and_keep_the_chosen_one_in_sight(reader: Callable[..., Reader]) -> None:
    """Up from the first leads to the last, and down from there to the first."""
    page = reader(height=500).open("kabsch.html")
    field, options, _ = opened(page)
    field.fill("the")
    expect(options).to_have_count(20)
    for key, chosen in (("ArrowUp", options.last), ("ArrowUp", options.nth(18)), ("ArrowDown", options.last),
                        ("ArrowDown", options.first)):  # fmt: skip
        field.press(key)
        expect(chosen).to_have_attribute("aria-selected", "true")
        expect(chosen).to_be_in_viewport()
        expect(page.locator('[role="option"][aria-selected="true"]')).to_have_count(1)
        assert field.get_attribute("aria-activedescendant") == chosen.get_attribute("id")


def test_what_is_said_of_the_results_is_how_many_there_are(reader: Callable[..., Reader]) -> None:
    """None, one, more than are shown; without a word nothing is said. A screen reader hears of a list only if there is
    one."""
    page = reader().open("kabsch.html")
    field, options, told = opened(page)
    many = re.compile("^[0-9]+ places; showing the first 20$")
    for words, said, count in (("the", many, 20), ("qqqq", "Nothing found", 0), (ONE, "1 place", 1), ("", "", 0)):
        field.fill(words)
        expect(told).to_have_text(said)
        expect(options).to_have_count(count)
        expect(field).to_have_attribute("aria-expanded", str(count > 0).lower())
        expect(page.locator("#search-found")).to_be_visible(visible=count > 0)
        assert (field.get_attribute("aria-activedescendant") is None) is (count == 0)


def test_a_result_shows_the_words_where_they_stand(reader: Callable[..., Reader]) -> None:
    """A line or two around the first of them, marked; dots stand for what was cut off. No heading stands twice."""
    page = reader().open("kabsch.html")
    field, options, told = opened(page)
    field.fill("breadth")
    expect(told).to_contain_text("place")
    texts = options.locator(".found-text")
    assert texts.count()
    for text in texts.all():
        words = text.inner_text()
        assert len(words) < 220
        assert "breadth" in [mark.lower() for mark in text.locator("mark").all_inner_texts()], words
    assert any(words.startswith("… ") and words.endswith(" …") for words in texts.all_inner_texts())
    for option in options.all():
        assert option.locator(".found-page").inner_text() != option.locator(".found-title").inner_text()


def test_a_section_of_the_same_page_is_gone_to_and_the_search_is_over(reader: Callable[..., Reader]) -> None:
    page = reader().open("index.html")
    field, options, _ = opened(page)
    field.fill("forty minutes")
    expect(options.first).to_have_attribute("href", "index.html#forty-minutes")
    field.press("Enter")
    expect(field).to_be_hidden()
    expect(page.locator("#forty-minutes")).to_be_in_viewport()


def test_the_search_is_closed_by_its_button_and_opens_with_the_last_words_selected(
    reader: Callable[..., Reader],
) -> None:
    """New words replace them. A Mac's key opens it too, and it may be pressed again."""
    page = reader().open("kabsch.html")
    field, options, _ = opened(page)
    field.fill("levenberg")
    expect(options.first).to_be_visible()
    page.get_by_role("button", name="Close search").click()
    expect(field).to_be_hidden()
    for _ in range(2):
        page.keyboard.press("Meta+k")
        expect(field).to_be_focused()
    page.keyboard.type("gate")
    expect(field).to_have_value("gate")


def test_a_slash_that_is_written_opens_nothing(reader: Callable[..., Reader]) -> None:
    """In a text field it is a letter; on a slider, which takes no letters, it opens the search."""
    page = reader().open("kabsch.html")
    Figure(page, "fig-solve").control("noise").focus()
    field, _, _ = opened(page)
    expect(field).to_be_focused()
    page.keyboard.type("point/plane")
    expect(field).to_have_value("point/plane")


@pytest.mark.parametrize("file", ["minisearch", "search"])
def test_a_search_that_did_not_load_says_so_and_loads_with_the_next_letter(
    reader: Callable[..., Reader], server: SiteServer, file: str
) -> None:
    visitor = reader()
    visitor.expect("Failed to load", "MIME type")
    page = visitor.open("kabsch.html")
    server.forbid(rf"/assets/{file}\.")
    field, options, told = opened(page)
    field.fill("levenber")
    expect(told).to_have_text("The search could not be loaded.")
    server.forbid(None)
    field.fill("levenberg")
    expect(options.first).to_contain_text("Levenberg–Marquardt")
    expect(told).to_contain_text("place")


@pytest.mark.parametrize("file", ["minisearch", "search"])
def test_a_page_of_the_network_is_not_taken_for_the_search(reader: Callable[..., Reader], file: str) -> None:
    """A sign-in page comes with 200 for every address, and as a script it loads."""
    visitor = reader(alone=True)
    visitor.expect("Unexpected token", "Unexpected end of")
    page = visitor.open("kabsch.html")
    page.route(f"**/assets/{file}.*.js", lambda route: route.fulfill(content_type="text/html", body="<p>Sign in."))
    field, options, told = opened(page)
    field.fill("levenber")
    expect(told).to_have_text("The search could not be loaded.")
    page.unroute_all()
    field.fill("levenberg")
    expect(options.first).to_contain_text("Levenberg–Marquardt")


def test_a_search_that_is_loading_says_so(reader: Callable[..., Reader], server: SiteServer) -> None:
    page = reader().open("kabsch.html")
    server.hold(r"/assets/search\.")
    field, options, told = opened(page)
    field.fill("levenberg")
    expect(told).to_have_text("Loading.")
    server.release()
    expect(told).to_contain_text("place")
    expect(options.first).to_contain_text("Levenberg–Marquardt")


def test_an_enter_that_is_held_opens_the_search_and_no_result(reader: Callable[..., Reader]) -> None:
    """The last words' results are still there."""
    page = reader().open("kabsch.html")
    field, options, told = opened(page)
    field.fill("levenberg")
    expect(told).to_contain_text("place")
    page.keyboard.press("Escape")
    page.locator(".search-open").focus()
    for _ in range(3):
        page.keyboard.down("Enter")
    page.keyboard.up("Enter")
    expect(field).to_be_focused()
    expect(options.first).to_be_visible()
    page.keyboard.press("Enter")
    expect(page).not_to_have_url(re.compile("kabsch"))
