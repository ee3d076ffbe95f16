"""When something breaks: the figure says so in its own frame, keeps its picture, and there is a way on."""

from __future__ import annotations

import re
from collections.abc import Callable

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figures import Figure
from tests.browser.server import SiteServer


def test_a_killed_worker_is_restarted_by_reset(reader: Callable[..., Reader]) -> None:
    """The worker dies: the figure says so, keeps its picture, and Reset brings it back to life."""
    one = reader(reduced_motion="reduce")
    page = one.open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    page.evaluate("Ladder.runtime.kill()")
    before = solve.readout("rms")
    solve.drag("source", 50, 50)
    solve.becomes("failed")
    expect(solve.root.locator("svg.plot").first).to_be_visible()
    solve.root.get_by_role("button", name=re.compile("reset", re.I)).first.click()
    solve.live().settled()
    solve.drag("source", 50, 50)
    solve.changes("rms", before)


def test_a_missing_runtime_file_is_named_and_retry_works(reader: Callable[..., Reader], server: SiteServer) -> None:
    """A file of the runtime is not there: the figure names it; once it is there, Retry succeeds."""
    one = reader(reduced_motion="reduce")
    one.expect("404")
    server.forbid(r"/runtime/.*numpy")
    page = one.open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    expect(page.locator("html")).to_have_attribute("data-runtime", "failed", timeout=60_000)
    solve.drag("source", 50, 50)
    expect(solve.root.locator(".figure-status")).to_contain_text("numpy")
    server.forbid(None)
    before = solve.readout("rms")
    solve.root.get_by_role("button", name=re.compile("retry", re.I)).click()
    solve.changes("rms", before)
    solve.becomes("live")


def test_a_slow_start_says_so_and_offers_retry(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Bytes stop coming: after the patience is over the figure says so and offers Retry, and Retry works."""
    one = reader(reduced_motion="reduce")
    one.context.add_init_script("window.LADDER_PATIENCE = 300;")
    server.hold("/runtime/.*wasm")
    page = one.open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    before = solve.readout("rms")
    solve.drag("source", 50, 50)
    retry = solve.root.get_by_role("button", name=re.compile("retry", re.I))
    expect(retry).to_be_visible(timeout=30_000)
    page.evaluate("window.LADDER_PATIENCE = 60000")
    server.release()
    retry.click()
    solve.changes("rms", before)
    solve.becomes("live")


def test_an_error_in_one_figure_leaves_the_others_alone(reader: Callable[..., Reader]) -> None:
    """A frame that cannot be drawn fails in its own figure; the next figure of the page goes on."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    page.evaluate("name => Ladder.figures.get(name).ask({...Ladder.figures.get(name).record, seed: -1})", solve.name)
    solve.becomes("failed")
    before = solve.readout("rms")
    solve.root.get_by_role("button", name=re.compile("reset", re.I)).first.click()
    solve.becomes("live")
    solve.button("solve").click()
    solve.changes("rms", before)
