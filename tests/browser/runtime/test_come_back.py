"""Two tabs at once, and a page that comes back from the browser's history."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Playwright, expect

from sitegen.check.browsers import FLAGS
from sitegen.check.offline import ask
from tests.browser.conftest import Reader, whole_chromium
from tests.browser.figure import Figure, await_attribute
from tests.browser.server import SiteServer


def test_two_tabs_share_pins_and_theme(reader: Callable[..., Reader]) -> None:
    """A run pinned or removed in one tab is so in the other; none is lost; the theme is shared."""
    visitor = reader(alone=True, reduced_motion="reduce", color_scheme="light")
    tabs = [visitor.open("kabsch.html"), visitor.open("kabsch.html")]
    figures = [Figure(tab, "fig-solve").seen() for tab in tabs]
    rows = [figure.root.locator(".runs tbody tr") for figure in figures]
    for i, figure in enumerate(figures):
        figure.reached("[data-pin]").click()
        for pins in rows:
            expect(pins).to_have_count(i + 1)
    rows[0].nth(0).get_by_role("button", name="Remove").click()
    expect(rows[1]).to_have_count(1)
    tabs[1].locator("button.theme").click()
    theme = tabs[1].locator("html").get_attribute("data-theme")
    expect(tabs[0].locator("html")).to_have_attribute("data-theme", theme or "")
    expect(tabs[0].locator("button.theme")).to_have_attribute("aria-label", f"Theme: {theme}")


def test_a_page_from_the_history_is_alive(playwright: Playwright, server: SiteServer) -> None:
    """Nothing on the page keeps it out of the back/forward cache; it comes back as it was left, and answers. Changes
    made in another tab in the meantime are shown."""
    running = playwright.chromium.launch(
        executable_path=whole_chromium(), args=FLAGS, ignore_default_args=["--disable-back-forward-cache"]
    )
    try:
        context = running.new_context(reduced_motion="reduce")
        page = context.new_page()
        page.goto(f"{server.origin}/kabsch.html")
        page.wait_for_selector(".site-kept:not(:empty)", state="attached", timeout=120_000)
        solve = Figure(page, "fig-solve").live().settled()
        before = solve.readout("rms")
        solve.drag("source", 50, 40)
        moved = solve.changes("rms", before)
        page.evaluate("addEventListener('pageshow', ({ persisted }) => { window.persisted = persisted; })")
        page.locator("main a[data-card]").first.focus()
        expect(page.locator(".card:not([hidden])")).to_have_count(1)
        page.goto(f"{server.origin}/references.html")
        second = context.new_page()
        second.goto(f"{server.origin}/kabsch.html")
        Figure(second, "fig-solve").seen().reached("[data-pin]").click()
        second.close()
        page.go_back(wait_until="commit")  # a page from the history does not load
        assert page.evaluate("window.persisted") is True, page.evaluate(
            "JSON.stringify(performance.getEntriesByType('navigation')[0].notRestoredReasons)"
        )
        assert solve.readout("rms") == moved
        expect(page.locator(".card:not([hidden])")).to_have_count(0)
        expect(solve.root.locator(".runs tbody tr")).to_have_count(1)
        await_attribute(page, "html", "data-runtime", "live")
        ask(page, "fig-solve")
        solve.shows("rms", before)
    finally:
        running.close()


def test_a_drag_left_for_another_page_is_over(playwright: Playwright, server: SiteServer) -> None:
    """When the button is released on the other page, the handle of the page from the history stays where it was."""
    running = playwright.chromium.launch(
        executable_path=whole_chromium(), args=FLAGS, ignore_default_args=["--disable-back-forward-cache"]
    )
    try:
        page = running.new_page(reduced_motion="reduce", service_workers="block")
        page.goto(f"{server.origin}/kabsch.html")
        solve = Figure(page, "fig-solve").live().settled()
        page.evaluate("addEventListener('pageshow', ({ persisted }) => { window.persisted = persisted; })")
        handle, before = solve.handle("source"), solve.readout("rms")
        handle.scroll_into_view_if_needed()
        box = handle.bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x + 30, y + 20, steps=4)
        solve.changes("rms", before)
        record = solve.record()
        page.goto(f"{server.origin}/references.html")
        page.mouse.up()
        page.go_back(wait_until="commit")
        assert page.evaluate("window.persisted") is True
        page.mouse.move(x + 120, y + 90, steps=4)
        expect(solve.root).not_to_contain_class("dragging")
        assert solve.record() == record
    finally:
        running.close()


SAID = """
const { postMessage } = Worker.prototype;
window.known = [];
Worker.prototype.postMessage = function (message, ...more) {
  if (message.type === "start") window.known.push(message.known);
  return postMessage.call(this, message, ...more);
};
"""


def test_an_engine_that_came_up_is_known_on_every_page(reader: Callable[..., Reader]) -> None:
    """The browser may then reuse its compiled code. If nothing can be stored, no engine is known."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script(SAID)
    page = visitor.open("kabsch.html")
    for name, known in (("kabsch.html", False), ("icp.html", True)):
        page.goto(f"{visitor.origin}/{name}")
        page.evaluate("Ladder.runtime.start()")
        page.wait_for_selector('html[data-runtime="live"]')
        assert page.evaluate("window.known") == [known], name
    page.evaluate("Storage.prototype.setItem = () => { throw new Error('full') }, localStorage.clear()")
    page.evaluate("Ladder.runtime.restart()")
    page.wait_for_selector('html[data-runtime="live"]')
    assert page.evaluate("localStorage.length") == 0
