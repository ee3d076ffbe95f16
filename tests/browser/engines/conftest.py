"""The requested engines, each with one browser for all tests and one window per test."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Playwright

from tests.browser.engines.chromium import Chromium
from tests.browser.engines.firefox import Firefox
from tests.browser.engines.listening import Listening
from tests.browser.engines.page import Reading
from tests.browser.engines.webkit import Webkit
from tests.browser.engines.window import Browser
from tests.browser.server import Doorkeeper, SiteServer

# What drives an engine, and its program's usual name if `build.py test` has not found the program already.
DRIVERS: dict[str, tuple[Callable[[Path, Playwright], Browser], str]] = {
    "chromium": (Chromium, "chromium"),
    "firefox": (lambda program, playwright: Firefox(program), "firefox-esr"),
    "webkit": (lambda program, playwright: Webkit(program), "WebKitWebDriver"),
}


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "running" in metafunc.fixturenames:
        engines = os.environ.get("LADDER_ENGINES", "chromium").split(",")
        metafunc.parametrize("running", engines, indirect=True, scope="session")


@pytest.fixture(scope="session")
def running(request: pytest.FixtureRequest, playwright: Playwright) -> Iterator[Browser]:
    """The engine's browser. There is one Playwright per process, shared by all tests in Chromium."""
    drive, usual = DRIVERS[request.param]
    program = os.environ.get(f"LADDER_{request.param.upper()}") or shutil.which(usual)
    assert program, f"no {usual} on the PATH: `python3 build.py test --engines {request.param}` finds or installs one"
    browser = drive(Path(program), playwright)
    yield browser
    browser.close()


@pytest.fixture
def server(site: Path, running: Browser) -> Iterator[SiteServer]:
    serving = SiteServer(site, Listening if isinstance(running, Webkit) else Doorkeeper)
    yield serving
    serving.stop()


@pytest.fixture
def reading(running: Browser, server: SiteServer) -> Iterator[Reading]:
    """A reader with a fresh window; complaints of the browser that no test expects fail the test."""
    window = running.window()
    reading = Reading(window, server.origin)
    yield reading
    try:
        wrong = [text for text in window.complaints() if not any(part in text for part in reading.expected)]
    finally:
        window.close()
    assert not wrong, f"the browser complained: {wrong}"
