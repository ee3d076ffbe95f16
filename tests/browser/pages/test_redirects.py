"""A page at a chapter's old name, as the build makes it, on a host that sends the site's headers."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import expect

from sitegen.chapters.content import read_chapters, read_site
from sitegen.pages.redirects import redirect
from sitegen.pages.views import environment
from sitegen.problems import Problems
from tests.browser.conftest import ROOT, Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer

OLD, NEW = "pairs-known.html", "kabsch.html"


@pytest.fixture
def server(site: Path, tmp_path: Path) -> Iterator[SiteServer]:
    shutil.copytree(site, tmp_path / "site", ignore=shutil.ignore_patterns("*.zip"))
    settings = read_site(ROOT, Problems())
    chapters, _ = read_chapters(ROOT, settings, Problems())
    chapter = next(each for each in chapters if each.page == NEW)
    (tmp_path / "site" / OLD).write_text(redirect(environment(ROOT, tmp_path), settings, chapter), "utf-8")
    running = SiteServer(tmp_path / "site")
    yield running
    running.stop()


def test_a_link_to_a_state_of_a_figure_still_leads_to_it(reader: Callable[..., Reader]) -> None:
    """A figure and its state come from the part of the address after #, which a refresh would drop."""
    visitor = reader(reduced_motion="reduce")
    solve = Figure(visitor.open(NEW), "fig-solve").live()
    before = solve.readout("rms")
    solve.drag("source", -70, 50)
    text = solve.changes("rms", before)
    link = solve.page.evaluate("name => Ladder.figures.get(name).link()", solve.name)
    page = visitor.page()
    page.goto(link.replace(f"/{NEW}", f"/{OLD}"), wait_until="commit")
    page.wait_for_url(f"**/{NEW}#fig-solve*")
    Figure(page, "fig-solve").live().shows("rms", text)
    assert page.evaluate("history.length") == 2  # the empty page, and the chapter in the place of the old page


def test_without_scripts_it_leads_to_the_page(reader: Callable[..., Reader]) -> None:
    visitor = reader(java_script_enabled=False)
    page = visitor.page()
    page.goto(f"{visitor.origin}/{OLD}", wait_until="commit")
    page.wait_for_url(f"**/{NEW}")
    expect(page.locator("h1")).not_to_have_text("Moved")
