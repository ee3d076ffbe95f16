"""Dropping something that is not a file on the figure of own clouds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure


def drop(figure: Figure, *paths: Path) -> None:
    """Drop files from disk on the figure's picture, as a file manager does."""
    box = figure.seen().root.locator(".figure-stage").bounding_box()
    assert box is not None
    session = figure.page.context.new_cdp_session(figure.page)
    data = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        point = {"x": box["x"] + 40, "y": box["y"] + 40}
        session.send("Input.dispatchDragEvent", {"type": kind, "data": data, **point})


def test_a_folder_is_called_one_and_the_next_drop_is_read(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """Alone or beside a file it is refused; then two files are read, one with Windows line endings, one in UTF-16."""
    page = reader(reduced_motion="reduce").open("clouds.html")
    own = Figure(page, "fig-own").live()
    folder, first, second = tmp_path / "scans", tmp_path / "one.csv", tmp_path / "other.csv"
    folder.mkdir()
    first.write_bytes(b"\xef\xbb\xbfx,y\r\n1,2\r\n3,4\r\n5,7\r\n")
    second.write_bytes("x,y\n1,2\n3,5\n5,7\n8,8\n".encode("utf-16"))
    words, report = own.root.locator(".status-words"), own.root.locator("[data-told]")
    for paths in ((folder,), (first, folder)):
        drop(own, *paths)
        expect(words).to_have_text("scans is a folder: drop files, the source first.")
        expect(report).to_have_text(["Nothing yet.", "Nothing yet."])
        own.button("reset").click()
        expect(words).not_to_contain_text("folder")
    drop(own, first, second)
    expect(report.nth(0)).to_contain_text("one.csv: 3 points in 2-D", timeout=60_000)
    expect(report.nth(1)).to_contain_text("other.csv: 4 points in 2-D", timeout=60_000)


def test_from_disk_a_dropped_file_is_refused(reader: Callable[..., Reader], site: Path, tmp_path: Path) -> None:
    """There is no Python to read it, so nothing waits for it either."""
    visitor = reader(reduced_motion="reduce")
    visitor.expect("Access to font", "ERR_FAILED", "A preload for")  # as on every page opened from disk
    page = visitor.page()
    page.goto((site / "clouds.html").as_uri())
    own = Figure(page, "fig-own")
    path = tmp_path / "one.csv"
    path.write_text("1,2\n3,4\n")
    drop(own, path)
    expect(own.root.locator(".status-words")).to_contain_text("Files cannot be read here. Opened from disk:")
    own.settled()
