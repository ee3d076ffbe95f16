"""The bench's way of timing a first click works on the pages as they are; how long it takes is the bench's to say."""

from __future__ import annotations

from pathlib import Path
from threading import Event

import pytest
from playwright.sync_api import Browser

from sitegen.bench.pages import Holding, first_answer
from sitegen.serve.static_files import serving


@pytest.mark.parametrize("name", ["index.html", "kabsch.html"])
def test_a_first_click_is_timed_while_the_engine_is_held(browser: Browser, site: Path, name: str) -> None:
    """Also where the first main button belongs to a later figure, whose tape loads beside the runtime."""
    Holding.let_go = Event()
    try:
        with serving(site, Holding) as server:
            (answer,) = first_answer(browser, f"{server.origin}/{name}") or ()
    finally:
        Holding.let_go.set()
    assert answer > 0
