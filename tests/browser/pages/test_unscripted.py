"""If the page's own script does not load, the page is as it is without scripts, and a line says so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer

# Where a script is cut decides what the parser misses: the end of a call, a template, an expression, a string.
CUT = ("Unexpected", "Invalid ", "missing ", "Missing ", "Unterminated ")
COMPLAINTS = ("Failed to load", *CUT, "MIME type", "ERR_")
# The places of all visible elements, in the page's own typefaces; the message about the script overlays them.
PLACES = """() => document.fonts.ready.then(() => [...document.querySelectorAll('header *, main *, footer *')]
  .filter(node => node.checkVisibility({ visibilityProperty: true }) && !node.closest('svg, math'))
  .map(node => { const { x, y, width, height } = node.getBoundingClientRect();
    return [node.localName, node.className, ...[x, y, width, height].map(Math.round)].join(' '); }))"""


def script(site: Path) -> str:
    (result,) = site.glob("assets/site.*.js")
    return result.name


def check_untouched(page: Page) -> None:
    """Check that nothing that needs a script is shown, and no room is reserved for it."""
    expect(page.locator(".unscripted")).to_contain_text("This page’s script did not load", timeout=30_000)
    expect(page.locator("html")).not_to_have_class("js")
    nodes = page.locator(".buttons, .predict, form.controls, .figure-status, .site-tools, .deck-tools").all()
    assert nodes
    for node in nodes:
        expect(node).to_be_hidden()


@pytest.mark.parametrize("fault", ["missing", "broken", "page", "empty", "short", "cut", "reset"])
def test_a_script_that_does_not_come_leaves_the_page(
    reader: Callable[..., Reader], server: SiteServer, site: Path, fault: str
) -> None:
    """Whatever the server sends instead, the page looks as with scripts disabled; Reload makes it live."""
    plain = reader(java_script_enabled=False).open("kabsch.html").evaluate(PLACES)
    visitor = reader(reduced_motion="reduce")
    visitor.expect(*COMPLAINTS)
    if fault == "missing":
        server.forbid(script(site))
    else:
        server.spoilt = {script(site): fault}
        server.bare = True  # otherwise a browser obeys "nosniff", and caches the response for a year
    page = visitor.open("kabsch.html")
    check_untouched(page)
    assert page.evaluate(PLACES) == plain
    server.forbid(None)
    server.spoilt = {}
    page.get_by_role("button", name="Reload").click()
    Figure(page, "fig-solve").live()
    expect(page.locator(".unscripted")).to_have_count(0)


def test_a_script_that_hangs_is_given_up_and_taken_when_it_comes(
    reader: Callable[..., Reader], server: SiteServer, site: Path
) -> None:
    """The line appears before the script; once that arrives after all, the line goes and the page is live."""
    visitor = reader(reduced_motion="reduce")
    server.hold(script(site))
    page = visitor.page()
    page.goto(f"{server.origin}/kabsch.html", wait_until="commit")
    check_untouched(page)
    server.release()
    Figure(page, "fig-solve").live()
    expect(page.locator(".unscripted")).to_have_count(0)
    expect(page.locator(".site-tools")).to_be_visible()


def test_a_deck_without_its_script_says_so_beside_its_bar(
    reader: Callable[..., Reader], server: SiteServer, site: Path
) -> None:
    """The deck's own links are not covered."""
    visitor = reader(390, 800)
    visitor.expect(*COMPLAINTS)
    server.forbid(script(site))
    page = visitor.open("slides-kabsch.html")
    check_untouched(page)
    page.get_by_role("link", name="The chapter: Correspondences known").click()
    page.wait_for_url("**/kabsch.html")


def test_the_page_lives_without_the_small_script(reader: Callable[..., Reader], server: SiteServer) -> None:
    """If the theme's script does not load, everything that the other script does still appears."""
    visitor = reader(reduced_motion="reduce")
    visitor.expect(*COMPLAINTS)
    server.forbid(r"/assets/theme\.")
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    expect(page.locator(".site-tools")).to_be_visible()
    expect(solve.root.locator(".figure-status")).to_be_visible()
