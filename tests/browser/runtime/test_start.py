"""When Python starts by itself, what is fetched ahead of it, and what waits for it."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure, await_attribute
from tests.browser.server import SiteServer

LINES = ("effectiveType: '3g'", "effectiveType: '4g', type: 'cellular'", "effectiveType: '4g', saveData: true")
LINE = "Object.defineProperty(navigator, 'connection', { value: { %s } });"
# Resolves when a figure has been seen and the browser has been idle after that.
IDLE = """name => new Promise(done => {
  const idle = (more) => requestIdleCallback(() => more ? idle(more - 1) : done());
  const look = () => Ladder.figures.get(name).visible ? idle(4) : requestAnimationFrame(look);
  look();
})"""
# How often the page has asked for the site to be stored.
STORING = """
  globalThis.storing = 0;
  const { register } = globalThis.ServiceWorkerContainer?.prototype ?? {}; // a blank page has none
  if (register) ServiceWorkerContainer.prototype.register = function (...given) {
    storing += 1;
    return register.apply(this, given);
  };
"""
# The browser is idle when the test says so.
BUSY = "globalThis.waiting = []; globalThis.requestIdleCallback = (go) => waiting.push(go);"
AT_LAST = "() => { while (waiting.length) waiting.shift()(); }"


def requests(page: Page, part: str) -> list[str]:
    """The addresses with this part that are requested from now on."""
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url) if part in request.url else None)
    return asked


def test_a_slow_or_metered_line_carries_python_only_to_who_asks_for_it(reader: Callable[..., Reader]) -> None:
    """A figure in view starts nothing, the site is not stored, and a job has no second Python."""
    for line in LINES:
        visitor = reader(alone=True, reduced_motion="reduce", service_workers="allow")
        visitor.context.add_init_script(LINE % line + STORING)
        page = visitor.page()
        asked = requests(page, "/runtime/")
        page.goto(f"{visitor.origin}/race.html")
        race = Figure(page, "fig-race").seen()
        expect(race.root.locator(".figure-status")).to_contain_text("MB")
        race.root.locator("figcaption").hover()
        page.evaluate(IDLE, race.name)
        expect(page.locator("html")).to_have_attribute("data-runtime", "idle")
        assert page.evaluate("storing") == 0, line
        assert asked == [], line
    begin = race.reached('section.job [data-do="begin"]')
    begin.click()
    race.live()
    race.root.locator('section.job [data-do="stop"]').click()
    begin.hover()
    assert len(page.workers) == 1


def test_a_pointer_or_the_focus_at_a_figure_fetches_the_engine_ahead(
    reader: Callable[..., Reader], server: SiteServer
) -> None:
    """Once, while the page is still busy; Python's start finds it in the browser's cache."""
    server.hold("/runtime/")
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script(BUSY)
    reaches: list[Callable[[Figure], None]] = [
        lambda figure: figure.root.locator("figcaption").hover(),
        lambda figure: figure.root.locator("button").first.focus(),
    ]
    for first, second in (reaches, reaches[::-1]):
        page = visitor.open("kabsch.html")
        asked = requests(page, ".wasm")
        solve = Figure(page, "fig-solve").seen()
        with page.expect_request("**/*.wasm"):
            first(solve)
        second(solve)
        expect(page.locator("html")).to_have_attribute("data-runtime", "idle")
        assert len(asked) == 1


def test_the_site_is_stored_only_once_python_s_load_is_over(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Well or badly. Both at once would take the line from what the reader waits for."""
    server.hold(r"/runtime/.*wasm")
    visitor = reader(alone=True, reduced_motion="reduce", service_workers="allow")
    visitor.expect("404")
    visitor.context.add_init_script(BUSY + STORING)
    page = visitor.open("kabsch.html")
    page.evaluate("Ladder.runtime.start()")
    page.evaluate(AT_LAST)
    assert page.evaluate("storing") == 0
    server.forbid(r"/runtime/.*wasm")
    server.release()
    await_attribute(page, "html", "data-runtime", "failed")
    until(page, "storing === 1")
