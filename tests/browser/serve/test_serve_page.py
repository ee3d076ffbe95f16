"""A page shown by `serve` while its author works."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from sitegen.serve.live import LiveSite


@pytest.mark.browser
def test_an_open_page_follows_and_shows_what_is_wrong(
    browser: Browser, live_site: LiveSite, small_checkout: Path
) -> None:
    """Under a strict policy it reloads by itself, shows the problems above the text, which stays, and can hide them."""
    page_md = small_checkout / "content" / "page.md"
    page = browser.new_page()
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text))
    page.goto(live_site.server.origin)
    page_md.write_text("second", "utf-8")
    expect(page.locator("body")).to_contain_text("second.")

    page_md.write_text("all wrong", "utf-8")
    panel = page.locator("#build-problems")
    expect(panel).to_contain_text("The build found 1 problem")
    expect(panel).to_contain_text("content/page.md:1:5: this is wrong")
    expect(page.locator("body")).to_contain_text("second.")
    page.reload()
    expect(panel).to_contain_text("content/page.md:1:5: this is wrong")
    panel.get_by_role("button", name="Hide").click()
    expect(panel).to_have_count(0)

    page_md.write_text("wrong again", "utf-8")
    expect(panel).to_contain_text("content/page.md:1:1: this is wrong")
    page_md.write_text("right", "utf-8")
    expect(page.locator("body")).to_contain_text("right.")
    expect(panel).to_have_count(0)
    page.close()
    assert [text for text in complaints if "Security" in text] == []
