"""The site on a reader's own machine: installed from the browser, or unpacked from the zip and opened from disk."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

from playwright.sync_api import Browser, Playwright, expect

from sitegen.check.browsers import FLAGS
from sitegen.check.offline import ask
from tests.browser.conftest import Reader, whole_chromium
from tests.browser.figure import Figure
from tests.browser.server import SiteServer


def test_the_site_can_be_installed(playwright: Playwright, server: SiteServer, tmp_path: Path) -> None:
    """Chromium finds no obstacle to installation and no fault in the manifest."""
    context = playwright.chromium.launch_persistent_context(tmp_path, executable_path=whole_chromium(), args=FLAGS)
    try:
        page = context.new_page()
        errors: list[str] = []
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        page.goto(f"{server.origin}/kabsch.html")
        session = context.new_cdp_session(page)
        manifest = session.send("Page.getAppManifest")
        assert manifest["url"].startswith(f"{server.origin}/assets/")
        assert manifest["errors"] == []
        assert manifest["manifest"]["startUrl"] == f"{server.origin}/index.html"
        assert manifest["manifest"]["scope"] == f"{server.origin}/"
        assert session.send("Page.getInstallabilityErrors")["installabilityErrors"] == []
        assert errors == []
    finally:
        context.close()


def test_the_zip_reads_and_steps_from_disk(reader: Callable[..., Reader], site: Path, tmp_path: Path) -> None:
    """Unpacked, its pages, links and tapes work, the browser does not complain, and one line says what is missing."""
    (path,) = site.glob("*.zip")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    folder = tmp_path / path.stem
    page = reader(reduced_motion="reduce").page()
    page.goto((folder / "index.html").as_uri())
    page.locator(".ladder a", has_text="Correspondences known").click()
    assert page.url == (folder / "kabsch.html").as_uri()
    solve = Figure(page, "fig-solve").seen()
    start = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", start)
    solve.becomes("tape")
    expect(solve.root.locator(".figure-status")).to_contain_text("python3 -m http.server")
    assert page.locator('a[href$=".zip"]').count() == 0
    assert page.evaluate("document.fonts.check('16px \\'Ladder Serif\\'')")


def test_the_unpacked_zip_comes_alive_as_the_page_says(browser: Browser, site: Path, tmp_path: Path) -> None:
    """With `python3 -m http.server` in the folder, without any of our headers, Python starts and answers."""
    (path,) = site.glob("*.zip")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
    handler = partial(Quiet, directory=tmp_path / path.stem)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as running, browser.new_context() as context:
        Thread(target=running.serve_forever, daemon=True).start()
        page = context.new_page()
        page.goto(f"http://127.0.0.1:{running.server_port}/kabsch.html")
        Figure(page, "fig-solve").live()
        ask(page, "fig-solve")
        running.shutdown()


class Quiet(SimpleHTTPRequestHandler):
    """The standard library's server, without its log."""

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""
