"""A reader's browser on the built site. What goes wrong unasked (console errors, foreign requests) fails the test."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Playwright, sync_playwright

from sitegen.check.browsers import FLAGS
from tests.browser.server import SiteServer
from tests.browser.visits import Check, Found, found_on

ROOT = Path(__file__).resolve().parents[2]
BLOCKED = "Service Worker registration blocked"  # by the tests themselves, where they are not about being offline
EARLY = "was preloaded using link preload but not used within a few seconds"  # on a busy machine; UNUSED_FONTS asks


def whole_chromium() -> str | None:
    """A Chromium with all that its headless shell lacks: the back/forward cache, and apps to install."""
    return os.environ.get("LADDER_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    path = os.environ.get("LADDER_SHELL") or whole_chromium()
    running = playwright.chromium.launch(executable_path=path, args=FLAGS)
    yield running
    running.close()


@pytest.fixture(scope="session")
def pages(site: Path, pytestconfig: pytest.Config) -> list[str]:
    """All but the decks, which test_slides.py goes over: their figures are those of the chapters. With --pages those
    that are named."""
    named = pytestconfig.getoption("--pages")
    every = sorted(p.name for p in site.glob("*.html") if not p.name.startswith("slides-"))
    return [name for name in every if not named or name in named.split(",")]


@pytest.fixture(scope="session")
def alike(pages: list[str]) -> list[str]:
    """The pages that are as another one, with other words: of one template, without a figure."""
    return [path for path in pages if path.startswith("checks-")][1:]


@pytest.fixture
def server(site: Path) -> Iterator[SiteServer]:
    running = SiteServer(site)
    yield running
    running.stop()


class Reader:
    """One browser context on the site, and what went wrong in it."""

    def __init__(self, context: BrowserContext, origin: str) -> None:
        self.context, self.origin = context, origin
        self.wrong: list[str] = []
        self.foreign: list[str] = []
        self.expected: tuple[str, ...] = (BLOCKED, EARLY)
        context.on("request", self._request)
        context.on(
            "console", lambda m: self.wrong.append(f"console: {m.text}") if m.type in ("error", "warning") else None
        )
        context.on("weberror", lambda e: self.wrong.append(f"error: {e.error}"))

    def _request(self, request: Any) -> None:
        if not request.url.startswith((self.origin, "data:", "blob:", "file:")):
            self.foreign.append(request.url)

    def open(self, path: str = "index.html") -> Page:
        page = self.context.new_page()
        page.goto(f"{self.origin}/{path}")
        return page

    def expect(self, *parts: str) -> None:
        """Messages holding one of these parts are part of the test."""
        self.expected = (BLOCKED, EARLY, *parts)

    def unexpected(self) -> list[str]:
        return [m for m in self.wrong if not any(part in m for part in self.expected)]


@contextmanager
def readers(browser: Browser, origin: str) -> Iterator[Callable[..., Reader]]:
    """Makes readers; once they are done, what went wrong unasked is raised."""
    made: list[Reader] = []

    def make(width: int = 1280, height: int = 1000, **options: Any) -> Reader:
        options.setdefault("service_workers", "block")
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        context.set_default_timeout(60_000)
        made.append(Reader(context, origin))
        return made[-1]

    yield make
    foreign = [url for one in made for url in one.foreign]
    wrong = [message for one in made for message in one.unexpected()]
    for one in made:
        one.context.close()
    assert not foreign, f"requests to another origin: {foreign}"
    assert not wrong, f"the browser complained: {wrong}"


@pytest.fixture
def reader(browser: Browser, server: SiteServer) -> Iterator[Callable[..., Reader]]:
    with readers(browser, server.origin) as make:
        yield make


@pytest.fixture(scope="session")
def visit(browser: Browser, site: Path, pages: Sequence[str]) -> Callable[..., Found]:
    """Visits every page once, but for those left out, see visits.py; the options are a reader's."""

    def visited(checks: Mapping[str, Check], *, left_out: Collection[str] = (), **options: Any) -> Found:
        server = SiteServer(site)
        try:
            with readers(browser, server.origin) as make:
                return found_on(make(**options), [path for path in pages if path not in left_out], checks)
        finally:
            server.stop()

    return visited
