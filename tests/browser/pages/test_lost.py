"""The page for a missing address, as a host serves it at any depth, for a site in any folder."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from http import HTTPStatus
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.layout import SIDEWAYS, remaining
from tests.browser.server import Doorkeeper, SiteServer

FOLDER = "/some/ladder"


class Pages(Doorkeeper):
    """A host that serves a site in a folder, and at any missing address below it the site's own page for that."""

    def missing(self) -> None:
        page = self.read(self.server.root / FOLDER.lstrip("/") / "404.html")
        assert page
        rules = {} if self.server.bare else self.headers_of("/404.html")
        self.answer(HTTPStatus.NOT_FOUND, page, "text/html; charset=utf-8", rules)


@pytest.fixture
def server(site: Path, tmp_path: Path) -> Iterator[SiteServer]:
    lying = tmp_path / FOLDER.lstrip("/")
    shutil.copytree(site, lying, ignore=shutil.ignore_patterns("runtime", "*.zip"))
    shutil.copyfile(site / "_headers", tmp_path / "_headers")
    running = SiteServer(tmp_path, Pages)
    yield running
    running.stop()


@pytest.mark.parametrize("bare", [False, True])
@pytest.mark.parametrize("address", ["typo.html", "a/b/c", "a/%/..%2f/c?x=//example.org#y", "kabsch/"])
def test_it_leads_to_the_start_from_any_depth(
    reader: Callable[..., Reader], server: SiteServer, address: str, bare: bool
) -> None:
    """It has its style, under the page's policy and the host's, and its link leads to the first page."""
    visitor = reader(390, 700)
    visitor.expect("404")
    server.bare = bare
    page = visitor.open(f"{FOLDER.lstrip('/')}/{address}")
    expect(page.locator("h1")).to_have_text("No such page")
    assert page.evaluate("getComputedStyle(document.body).maxWidth") == "640px"
    assert remaining(page, SIDEWAYS) == []
    assert not [v["id"] for v in Axe().run(page).response["violations"]]
    start = f"{server.origin}{FOLDER}/index.html"
    page.wait_for_function("start => document.querySelector('main a').href === start", arg=start)
    page.get_by_role("link", name="the first").click()
    page.wait_for_url(start)
    expect(page.locator("h1")).not_to_have_text("No such page")


def test_it_asks_nobody_else_for_the_start(reader: Callable[..., Reader]) -> None:
    """An address that looks like another host's is still one of this host."""
    visitor = reader()
    visitor.expect("404")
    page = visitor.open("/example.org/a/b")
    expect(page.locator("h1")).to_have_text("No such page")
    page.wait_for_load_state("networkidle")
    assert page.locator("main a").get_attribute("href") == "index.html"


def test_without_scripts_it_leads_to_its_own_folder(reader: Callable[..., Reader], server: SiteServer) -> None:
    """If the address is in the folder of the site's pages, that is the way to the start."""
    visitor = reader(java_script_enabled=False)
    visitor.expect("404")
    page = visitor.open(f"{FOLDER.lstrip('/')}/typo.html")
    page.get_by_role("link", name="the first").click()
    page.wait_for_url(f"{server.origin}{FOLDER}/index.html")
