"""A reader's browser on the built site. Unexpected console errors and requests to other origins fail the test."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    Error,
    Page,
    Playwright,
    Request,
    ViewportSize,
    expect,
    sync_playwright,
)

from sitegen.check.browsers import FLAGS
from tests.browser.figure import await_attribute
from tests.browser.server import SiteServer
from tests.browser.visits import Check, Found, findings

ROOT = Path(__file__).resolve().parents[2]
BLOCKED = "Service Worker registration blocked"  # by the tests themselves, unless they test offline use
EARLY = "was preloaded using link preload but not used within a few seconds"  # on a busy machine; UNUSED_FONTS tests it

SIZE = 1280, 1000
VIEW: ViewportSize = {"width": SIZE[0], "height": SIZE[1]}
TIMEOUT = 60_000  # ms
expect.set_options(timeout=TIMEOUT)  # five seconds otherwise, whatever a context's own patience is
MEDIA = {"color_scheme", "contrast", "forced_colors", "reduced_motion"}  # what can be emulated per page
KEPT = "kabsch.html"
ONE_PROCESS = "--renderer-process-limit=1"  # a context's pages share one process, and with it the compiled code


def whole_chromium() -> str | None:
    """A Chromium with everything that its headless shell lacks: the back/forward cache, and installable apps."""
    return os.environ.get("LADDER_CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    path = os.environ.get("LADDER_SHELL") or whole_chromium()
    running = playwright.chromium.launch(executable_path=path, args=[*FLAGS, ONE_PROCESS])
    yield running
    running.close()


@pytest.fixture(scope="session")
def pages(site: Path, pytestconfig: pytest.Config) -> list[str]:
    """All pages but the decks, which test_slides.py covers: their figures are those of the chapters. With --pages, only
    the given pages."""
    option = pytestconfig.getoption("--pages")
    names = sorted(p.name for p in site.glob("*.html") if not p.name.startswith("slides-"))
    return [name for name in names if not option or name in option.split(",")]


@pytest.fixture(scope="session")
def alike(pages: list[str]) -> list[str]:
    """Pages that differ from another only in their words: the same template, without a figure."""
    return [path for path in pages if path.startswith("checks-")][1:]


@pytest.fixture
def server(site: Path) -> Iterator[SiteServer]:
    running = SiteServer(site)
    yield running
    running.stop()


class Reader:
    """One reader of the site, and the faults in the pages that it opened.

    Its pages are in their own browser context or, if `media` is given, in a shared one: then only settings of a page
    may be changed. Each test's server has its own origin, so nothing that is stored is shared.
    """

    def __init__(
        self, context: BrowserContext, origin: str, size: tuple[int, int], media: dict[str, Any] | None = None
    ) -> None:
        self._context, self.origin, self._size, self._media = context, origin, size, media
        self.wrong: list[str] = []
        self.foreign: list[str] = []
        self.expected: tuple[str, ...] = (BLOCKED, EARLY)
        self.beside: Collection[Page] = [*context.pages]  # pages that are not the reader's
        self._listeners: list[tuple[str, Callable[[Any], None]]] = [
            ("request", self._request),
            ("console", self._console),
            ("weberror", self._error),
        ]
        for event, listener in self._listeners:
            context.on(event, listener)  # type: ignore[call-overload]

    @property
    def context(self) -> BrowserContext:
        """The browser context, if it is the reader's own. Raises ValueError otherwise."""
        if self._media is not None:
            raise ValueError("this context is shared; ask for reader(alone=True)")
        return self._context

    def _console(self, message: Any) -> None:
        if message.type in ("error", "warning") and message.page not in self.beside:
            self.wrong.append(f"console: {message.text}")

    def _error(self, error: Any) -> None:
        if error.page not in self.beside:
            self.wrong.append(f"error: {error.error}")

    def _request(self, request: Any) -> None:
        ours = request.url.startswith((self.origin, "data:", "blob:", "file:"))
        if not ours and _page_of(request) not in self.beside:
            self.foreign.append(request.url)

    def page(self) -> Page:
        """A new page that has not been navigated."""
        page = self._context.new_page()
        if self._media is not None:
            if self._size != SIZE:
                page.set_viewport_size({"width": self._size[0], "height": self._size[1]})
            if self._media:
                page.emulate_media(**self._media)
        return page

    def open(self, path: str = "index.html") -> Page:
        """Open a page of the site; if scripts run, its figures are set up (it is painted first)."""
        page = self.page()
        page.goto(f"{self.origin}/{path}")
        page.evaluate("globalThis.Ladder?.alive")
        return page

    def expect(self, *parts: str) -> None:
        """Messages that contain one of these parts are expected by the test."""
        self.expected = (BLOCKED, EARLY, *parts)

    def unexpected(self) -> list[str]:
        return [m for m in self.wrong if not any(part in m for part in self.expected)]

    def leave(self) -> None:
        """Close the reader's pages, or its whole context."""
        for event, listener in self._listeners:
            self._context.remove_listener(event, listener)
        if self._media is None:
            self._context.close()
        for page in self._context.pages if self._media is not None else ():
            if page not in self.beside:
                page.close()


def _page_of(request: Request) -> Page | None:
    """The page that makes the request; None for a service worker, or a page that is still being created."""
    try:
        return request.frame.page
    except Error:
        return None


@contextmanager
def readers(browser: Browser, origin: str, shared: BrowserContext | None = None) -> Iterator[Callable[..., Reader]]:
    """Make readers; once they are done, raise the unexpected faults. The first reader uses the shared context, unless
    it needs to change a whole context."""
    visitors: list[Reader] = []

    def make(width: int = SIZE[0], height: int = SIZE[1], *, alone: bool = False, **options: Any) -> Reader:
        if shared and not alone and not visitors and options.keys() <= MEDIA:
            visitors.append(Reader(shared, origin, (width, height), options))
            return visitors[-1]
        options.setdefault("service_workers", "block")
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        context.set_default_timeout(TIMEOUT)
        visitors.append(Reader(context, origin, (width, height)))
        return visitors[-1]

    yield make
    foreign = [url for visitor in visitors for url in visitor.foreign]
    wrong = [message for visitor in visitors for message in visitor.unexpected()]
    for visitor in visitors:
        visitor.leave()
    assert not foreign, f"requests to another origin: {foreign}"
    assert not wrong, f"the browser complained: {wrong}"


def keep_python_up(context: BrowserContext, origin: str) -> None:
    """Keep a page with Python open: later pages in its process find Python's code compiled."""
    page = context.new_page()
    page.goto(f"{origin}/{KEPT}")
    page.locator("figure.figure").first.scroll_into_view_if_needed()
    await_attribute(page, "html", "data-runtime", "live")


@pytest.fixture(scope="session")
def shared(browser: Browser, site: Path) -> Iterator[BrowserContext]:
    """A context for all tests that do not change it, with Python running in a page beside theirs."""
    context, server = browser.new_context(viewport=VIEW, service_workers="block"), SiteServer(site)
    context.set_default_timeout(TIMEOUT)
    keep_python_up(context, server.origin)
    yield context
    context.close()
    server.stop()


@pytest.fixture
def reader(browser: Browser, server: SiteServer, shared: BrowserContext) -> Iterator[Callable[..., Reader]]:
    with readers(browser, server.origin, shared) as make:
        yield make


@pytest.fixture(scope="session")
def visit(browser: Browser, site: Path, pages: Sequence[str]) -> Callable[..., Found]:
    """Visit every page once, except those left out, see visits.py; the options are a reader's."""

    def run_checks(checks: Mapping[str, Check], *, left_out: Collection[str] = (), **options: Any) -> Found:
        server = SiteServer(site)
        try:
            with readers(browser, server.origin) as make:
                visitor = make(**options)
                if options.get("java_script_enabled", True):
                    keep_python_up(visitor.context, server.origin)
                    visitor.beside = visitor.context.pages
                return findings(visitor, [path for path in pages if path not in left_out], checks)
        finally:
            server.stop()

    return run_checks
