"""Before Python is up, a figure answers from its tape; actions that are not on it wait and are then applied."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import Route, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, await_attribute
from tests.browser.server import SiteServer


def test_solve_answers_from_the_tape(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With the runtime held back, Solve and Reset show the recorded frames."""
    server.hold("/runtime/")
    page = reader().open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    start = solve.readout("rms")
    solve.button("solve").click()
    solve.becomes("tape")
    answer = solve.changes("rms", start)
    assert float(answer) < float(start)
    solve.button("reset").click()
    solve.shows("rms", start)


def test_a_tape_goes_before_the_runtime(reader: Callable[..., Reader], server: SiteServer) -> None:
    """The tape of a figure that comes into view while the runtime loads is requested with a high priority."""
    server.hold("/runtime/.*wasm")
    page = reader().open("kabsch.html")
    await_attribute(page, "html", "data-runtime", "loading")
    figures = page.locator("figure.figure[data-tape]")
    tapes = {str(figure.get_attribute("data-tape")) for figure in figures.all()}
    priorities: dict[str, str] = {}
    network = page.context.new_cdp_session(page)
    network.on(
        "Network.requestWillBeSent",
        lambda event: priorities.update({event["request"]["url"]: event["request"]["initialPriority"]}),
    )
    network.send("Network.enable")
    with page.expect_response(lambda response: "/tapes/" in response.url):
        figures.last.scroll_into_view_if_needed()
    seen = {priority for url, priority in priorities.items() if url.removeprefix(f"{server.origin}/") in tapes}
    assert seen == {"High"}


def test_a_tape_is_there_before_its_figure_is_in_view(reader: Callable[..., Reader]) -> None:
    page = reader().open("kabsch.html")
    figure = page.locator("figure.figure[data-tape]").last
    with page.expect_response(f"**/{figure.get_attribute('data-tape')}"):
        figure.evaluate("""e => scrollTo({ behavior: "instant",
          top: scrollY + e.getBoundingClientRect().top - innerHeight - 400 })""")
    expect(figure).not_to_be_in_viewport()


def test_a_scene_changes_from_the_tape(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Recorded scenes appear at once, before a byte of the runtime has arrived."""
    server.hold("/runtime/")
    page = reader().open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    solve.set("scene", "reflect")
    solve.shows("determinant", "−1")


def test_what_is_not_on_the_tape_is_kept_and_done(reader: Callable[..., Reader], server: SiteServer) -> None:
    """A drag made before Python is up is shown as waiting, and applied once Python is there."""
    server.hold("/runtime/.*wasm")
    page = reader().open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    await_attribute(page, "html", "data-runtime", "loading")
    start = solve.readout("rms")
    solve.drag("source", 60, 40)
    solve.becomes("waiting")
    expect(solve.root.locator(".figure-status")).to_contain_text("MB")
    assert solve.readout("rms") == start
    server.release()
    solve.changes("rms", start)
    solve.becomes("live")
    assert solve.record()["log"][0][:2] == ["drag", "source"]


def test_the_page_opened_from_disk_steps(site: Path, reader: Callable[..., Reader]) -> None:
    """file:// allows no worker: the tape still answers, and one line says how to serve the site."""
    visitor = reader()
    # From disk, Chromium refuses preloaded fonts; the style sheet's requests, which follow, succeed.
    visitor.expect("Access to font", "ERR_FAILED", "A preload for")
    page = visitor.page()
    page.goto((site / "kabsch.html").as_uri())
    await_attribute(page, "html", "data-runtime", "file")
    solve = Figure(page, "fig-solve").seen()
    start = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", start)
    solve.drag("source", 60, 40)
    expect(solve.root.locator(".figure-status")).to_contain_text("python3 -m http.server")
    assert page.evaluate("document.fonts.check('16px \\'Ladder Serif\\'')")


def test_the_hand_over_changes_nothing(reader: Callable[..., Reader], server: SiteServer) -> None:
    """The live frame of a record equals the tape's frame of that record, byte for byte."""
    server.hold("/runtime/")
    page = reader().open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    start = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", start)
    frame = solve.frame()
    server.release()
    solve.live()
    solve.button("reset").click()
    solve.shows("rms", start)
    solve.button("solve").click()
    solve.changes("rms", start)
    solve.settled().becomes("live")
    assert solve.frame() == frame


def test_from_disk_what_is_pressed_before_its_tape_is_there_waits_for_it(
    site: Path, reader: Callable[..., Reader]
) -> None:
    """The answer comes with the tape; if the tape never arrives, the figure says so and stays as it was."""
    visitor = reader(alone=True)
    visitor.expect("Access to font", "ERR_FAILED", "A preload for", "ERR_FILE_NOT_FOUND")
    routes: list[Route] = []
    visitor.context.route("**/tapes/kabsch-solve*", lambda route: routes.append(route))
    for is_there in (True, False):
        page = visitor.page()
        with page.expect_request("**/tapes/kabsch-solve*"):
            page.goto((site / "kabsch.html").as_uri(), wait_until="domcontentloaded")
            solve = Figure(page, "fig-solve").seen()
        start = solve.readout("rms")
        solve.button("solve").click()
        solve.becomes("waiting")
        assert solve.readout("rms") == start
        (route,) = routes
        routes.clear()
        if is_there:
            route.continue_()
            solve.changes("rms", start)
        else:
            route.abort()
            solve.becomes("failed")
            expect(solve.root.locator(".figure-status")).to_contain_text("not on the figure’s tape")
            assert solve.readout("rms") == start
