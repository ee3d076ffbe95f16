"""The page about the site, and the site in a host's folder as `publish` puts it there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from playwright.sync_api import Browser, expect

from sitegen.cli.publish import to_folder
from tests.browser.conftest import Reader
from tests.browser.figure import LIVE, Figure
from tests.browser.server import SiteServer

NEIGHBOUR = "ladder-offline:/some/other/:site:1"  # another copy of the site on the same host


def test_what_is_kept_can_be_forgotten(reader: Callable[..., Reader]) -> None:
    """The build in numbers, and a button that clears everything that the site's pages have stored."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    page.locator("button.theme").click()
    question = Figure(page, "fig-wrong").live().root.locator(".predict")
    for name in ("Place a ghost", "Run"):
        question.get_by_role("button", name=name).click()
    expect(question).to_have_attribute("data-told", "wrong")
    Figure(page, "fig-solve").reached("[data-pin]").click()
    page.locator(".site-footer").get_by_role("link", name="About", exact=True).click()
    expect(page.get_by_role("row", name="NumPy")).to_contain_text(np.__version__)
    page.evaluate("sessionStorage.setItem('other', '1')")
    script = "() => [localStorage, sessionStorage].map(storage => Object.keys(storage).sort())"
    local, session = page.evaluate(script)
    assert {"ladder-engine", "ladder-theme"} < set(local)
    assert session == ["ladder:predictions", "other"]
    page.get_by_role("button", name="Forget all of it").click()
    expect(page.locator(".stored")).to_contain_text("Forgotten")
    assert page.evaluate(script) == [[], ["other"]]


def test_the_site_lives_under_a_path(browser: Browser, site: Path, tmp_path: Path) -> None:
    """Published into a host's folder, figures come alive, and links and the worker stay under its path."""
    to_folder(site, tmp_path / "host" / "some" / "path")
    server = SiteServer(tmp_path / "host")
    base = f"{server.origin}/some/path"
    urls: list[str] = []
    try:
        with browser.new_context() as context:
            context.on("request", lambda request: urls.append(request.url))
            page = context.new_page()
            page.goto(f"{base}/kabsch.html")
            solve = Figure(page, "fig-solve").live()
            before = solve.readout("rms")
            solve.button("solve").click()
            solve.changes("rms", before)
            scope = "navigator.serviceWorker.ready.then(({ scope }) => scope)"
            assert page.evaluate(scope) == f"{base}/"
            page.get_by_role("link", name="Next").click()
            page.wait_for_url(f"{base}/ransac.html")
            page.goto(f"{base}/about.html")
            expect(page.locator(".site-kept")).to_contain_text("Works offline", timeout=LIVE)
            second = context.new_page()
            second.goto(f"{base}/references.html")
            expect(second.locator(".site-kept")).to_contain_text("Works offline", timeout=LIVE)
            assert page.evaluate("caches.keys()")
            page.evaluate("name => caches.open(name).then(() => {})", NEIGHBOUR)
            page.get_by_role("button", name="Forget all of it").click()
            expect(page.locator(".stored")).to_contain_text("Forgotten")
            assert page.evaluate("caches.keys()") == [NEIGHBOUR]
            expect(page.locator(".site-kept")).to_be_empty()
            expect(second.locator(".site-kept")).to_be_empty()
            assert second.evaluate("Ladder.offline.ready") is False
    finally:
        server.stop()
    assert urls
    assert not [url for url in urls if not url.startswith((f"{base}/", "data:", "blob:"))]
