"""The preview of `serve` on the real site: an edit reaches an open page, and its author keeps their place."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from sitegen.serve.live import WATCHED, LiveSite
from tests.browser.figure import Figure

ROOT = Path(__file__).resolve().parents[3]
PATIENCE = 60_000  # ms
SHIFTS = """() => { window.moved = 0; new PerformanceObserver(list => {
  for (const each of list.getEntries()) if (!each.hadRecentInput) moved += each.value; })
  .observe({type: 'layout-shift', buffered: true}); }"""


class Desk:
    """A copy of the checkout being served, and one of its pages."""

    def __init__(self, root: Path, site: LiveSite, page: Page) -> None:
        self.root, self.site, self.page = root, site, page

    def edit(self, name: str, old: str, new: str) -> None:
        """Save a file with one piece of it changed."""
        assert self.site.idle.wait(PATIENCE / 1000)
        path = self.root / name
        text = path.read_text("utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), "utf-8")

    def top(self, selector: str) -> float:
        """The top of an element in the window, in px."""
        return float(self.page.locator(selector).evaluate("node => node.getBoundingClientRect().top"))

    @property
    def same_page(self) -> bool:
        """Whether the page that was marked is still loaded."""
        return bool(self.page.evaluate("window.marked === true"))


@pytest.fixture
def desk(browser: Browser, tmp_path: Path) -> Iterator[Desk]:
    root = tmp_path / "checkout"
    root.mkdir()
    for name in (*WATCHED, "pyproject.toml", "README.md", "LICENSE"):
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, root / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, root)
    site = LiveSite(root, root / "site")
    watcher = threading.Thread(target=site.watch)
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    try:
        assert site.rebuild().good
        watcher.start()
        page.set_default_timeout(PATIENCE)
        page.add_init_script(f"({SHIFTS})()")
        page.goto(f"{site.server.origin}/kabsch.html")
        yield Desk(root, site, page)
    finally:
        page.close()
        site.stop()
        if watcher.ident:
            watcher.join(PATIENCE / 1000)
        site.close()


def test_an_author_stays_where_they_were(desk: Desk) -> None:
    """Text is replaced in place, even where it grows above the window; a style sheet is swapped; only an edit of a
    figure itself loads a new page, with the other figure's state, the focus, the open details and the scroll position
    preserved. A page that an edit does not affect stays, and links to the one that it does. Of a deck's two sheets
    only the edited one is swapped."""
    page, chapter = desk.page, "content/01-kabsch.md"
    page.evaluate("window.marked = true")
    solve = Figure(page, "fig-solve").live().settled()
    before = solve.readout("rms")
    solve.drag("source", 60, 30)
    rms = solve.changes("rms", before)
    solve.settled()
    page.locator("#fig-mirror-more summary").click()
    page.locator("#determinant").evaluate("node => node.scrollIntoView({ block: 'start' })")
    page.evaluate("moved = 0")

    top = desk.top("#determinant")
    more = "A sentence.\n\n" * 9 + "An :term[objective]{objective} more.\n\n"
    desk.edit(chapter, "Someone hands you two clouds", f"{more}Someone hands you two clouds")
    expect(page.get_by_text("A sentence.")).to_have_count(9, timeout=PATIENCE)
    new = page.locator("p", has_text="An objective more.").locator("a[data-card]")
    expect(new).to_have_attribute("aria-describedby", new.get_attribute("data-card") or "")
    assert abs(desk.top("#determinant") - top) <= 1
    assert desk.same_page

    desk.edit("templates/assets/css/base/type.css", "font-size: 1.65rem;", "font-size: 1.75rem;")
    expect(page.locator("#determinant")).to_have_css("font-size", "28px", timeout=PATIENCE)
    expect(page.locator("link[rel=stylesheet]")).to_have_count(1)
    assert desk.same_page
    assert solve.readout("rms") == rms
    assert page.evaluate("moved") < 0.01

    desk.edit("content/03-icp.md", "summary: ", "summary: Once more. ")
    link = page.locator("#build-elsewhere").get_by_role("link")
    expect(link).to_have_attribute("href", "icp.html", timeout=PATIENCE)
    assert desk.same_page

    page.locator("#fig-mirror [data-button=solve]").focus()
    top = desk.top("#fig-mirror")
    desk.edit(chapter, "A mast, bowed", "A tall mast, bowed")
    expect(page.locator("#fig-mirror .caption")).to_contain_text("A tall mast", timeout=PATIENCE)
    page.wait_for_load_state("load")
    assert not desk.same_page
    assert abs(desk.top("#fig-mirror") - top) <= 1
    expect(page.locator("#fig-mirror-more")).to_have_attribute("open", "")
    expect(page.locator("#fig-mirror [data-button=solve]")).to_be_focused()
    second = Figure(page, "fig-solve")
    expect(second.root.locator("[data-readout=rms] .value")).to_have_text(rms, timeout=PATIENCE)
    page.evaluate("document.fonts.ready")
    assert abs(desk.top("#fig-mirror") - top) <= 1

    desk.edit(chapter, "{kabsch preset=reflect", "{kabsh preset=reflect")
    problems = page.locator("#build-problems")
    expect(problems).to_contain_text("01-kabsch.md", timeout=PATIENCE)
    expect(problems).to_contain_text("unknown widget 'kabsh'; did you mean 'kabsch'?")
    expect(problems).to_contain_text("The build found 1 problem")

    desk.edit(chapter, "{kabsh preset=reflect", "{kabsch preset=reflect")
    expect(problems).to_have_count(0, timeout=PATIENCE)
    page.goto(f"{desk.site.server.origin}/slides-kabsch.html")
    page.evaluate("window.marked = true")
    site_sheet = page.locator("link[rel=stylesheet]").first.get_attribute("href")
    desk.edit("templates/assets/css/deck/bar.css", "min-height: 3rem;", "min-height: 5rem;")
    expect(page.locator(".deck-bar")).to_have_css("min-height", "80px", timeout=PATIENCE)
    expect(page.locator("link[rel=stylesheet]")).to_have_count(2)
    assert page.locator("link[rel=stylesheet]").first.get_attribute("href") == site_sheet
    assert desk.same_page
