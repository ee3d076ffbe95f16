"""Parts of Python that load later: one does not arrive, because of the network or because the site was updated."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.server import SiteServer, published_anew

PACK = "figure-three_residuals"
REASON = f"{PACK}.pack could not be loaded"


def lacking(reader: Callable[..., Reader], server: SiteServer) -> Figure:
    """A figure whose part of Python is missing, although Python is up."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.expect("404", "Failed to load", "Failed to fetch")
    page = visitor.open("surfaces.html")
    Figure(page, "fig-look").live().settled()
    server.forbid(PACK)
    return Figure(page, "fig-three").seen()


def test_what_was_asked_is_kept_until_the_file_comes(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Recorded frames come from the tape meanwhile; any other request waits through a failed Retry, and is drawn."""
    three = lacking(reader, server)
    before = three.frames()
    three.button("step").click()
    three.becomes("tape")
    assert three.frames() == before + 1
    three.drag("point-source", 40, 30)
    three.becomes("failed")
    words, retry = three.root.locator(".status-words"), three.root.get_by_role("button", name="Retry")
    expect(words).to_contain_text(REASON)
    expect(words).to_contain_text("Your work is kept.")
    record = three.record()
    assert record["log"][-1][0] == "drag"
    with three.page.expect_response(lambda answer: PACK in answer.url and answer.status == 404):
        retry.click()
    expect(retry).to_be_visible()
    server.forbid(None)
    retry.click()
    three.becomes("live").settled()
    assert three.record() == record
    expect(retry).to_have_count(0)
    assert three.frames() == before + 2


def test_what_cannot_be_drawn_is_taken_back_by_cancel(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Another figure of the page can still answer."""
    three = lacking(reader, server)
    record = three.record()
    three.drag("point-source", 40, 30)
    three.becomes("failed")
    three.root.get_by_role("button", name="Cancel").click()
    three.becomes("static")
    assert three.record() == record
    look = Figure(three.page, "fig-look").seen()
    before = look.frames()
    look.button("step").click()
    look.becomes("live")
    assert look.frames() > before


def test_a_page_older_than_the_site_offers_a_reload_when_python_lacks_a_part(
    reader: Callable[..., Reader], server: SiteServer, site: Path, tmp_path: Path
) -> None:
    """The part's file name is gone with the old build: Reload brings the new page with the same state."""
    three = lacking(reader, server)
    server.root = published_anew(site, tmp_path)
    three.drag("point-source", 40, 30)
    words = three.root.locator(".status-words")
    expect(words).to_have_text("This site has been updated. Only this figure’s state is kept.")
    record = three.record()
    server.forbid(None)
    three.root.get_by_role("button", name="Reload").click()
    three.becomes("live").settled()
    assert three.record() == record
