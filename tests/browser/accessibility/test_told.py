"""What a screen reader hears of runs, crosshairs and things that are over."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.accessibility.test_live_access import LISTEN, announcements, until_announced
from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from tests.browser.figures.test_hover import pixel

# Long enough for whatever there is to say to have been said.
STILL = "new Promise(done => setTimeout(done, Ladder.limits.gap + 2 * Ladder.limits.pause))"


def test_a_run_is_told_when_it_is_paused_and_when_it_ends(reader: Callable[..., Reader]) -> None:
    """With the numbers on which it stops; nothing is said while it goes on."""
    page = reader(reduced_motion="reduce").open("icp.html")
    wall = Figure(page, "fig-wall").live().settled()
    page.evaluate(LISTEN)
    running = "Ladder.figures.get('fig-wall').running"
    wall.button("run").click()
    until(page, "Ladder.figures.get('fig-wall').shown.log.length > 2")
    assert announcements(page) == []
    wall.button("run").click()
    wall.settled()
    until_announced(page, f": {wall.readout('rms')}")
    announcements(page)
    wall.button("run").click()
    until(page, f"!{running}")
    until_announced(page, f": {wall.settled().readout('rms')}")


def test_what_a_key_points_at_is_told_and_what_the_mouse_points_at_is_not(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("ndt-map.html")
    cells = Figure(page, "fig-cells").live().settled()
    page.evaluate(LISTEN)
    before = cells.readout("mean")
    cross = cells.root.locator('[data-pick="main"]')
    cross.focus()
    for _ in range(4):
        cross.press("Shift+ArrowDown")
    cells.changes("mean", before)
    until(page, "heard.length > 0")
    page.evaluate(STILL)
    announcements(page)
    before = cells.readout("mean")
    page.mouse.move(*pixel(cells, 0.5, 1.4))
    cells.changes("mean", before)
    page.evaluate(STILL)
    assert announcements(page) == []


def test_the_same_words_are_heard_a_second_time(reader: Callable[..., Reader]) -> None:
    """A screen reader speaks of a text only if it differs from the last."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live().settled()
    page.evaluate(LISTEN)
    page.evaluate("Object.defineProperty(navigator, 'clipboard', { value: { writeText: async () => {} } })")
    texts = []
    for _ in range(2):
        solve.reached("[data-link]").click()
        until_announced(page, "Link copied.")
        announcements(page)
        texts.append(solve.root.locator(".figure-voice").evaluate("e => e.textContent"))
    assert [text.strip() for text in texts] == ["Link copied."] * 2
    assert texts[0] != texts[1]


def test_a_line_that_did_not_load_interrupts(reader: Callable[..., Reader]) -> None:
    """The line about the page's own script is an alert, and is written once however long one waits."""
    visitor = reader(alone=True)
    visitor.expect("Failed to load", "ERR_")
    visitor.context.clock.install()
    visitor.context.route("**/assets/site.*.js", lambda route: route.abort())
    page = visitor.page()
    page.goto(f"{visitor.origin}/kabsch.html")
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("This page’s script did not load")
    visitor.context.clock.run_for(60_000)
    expect(alert).to_have_count(1)
