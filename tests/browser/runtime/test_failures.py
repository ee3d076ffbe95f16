"""When something breaks, the figure says so within its frame and keeps its picture, and the reader can go on."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Route, expect

from sitegen.check.offline import forget
from tests.browser.conftest import Reader
from tests.browser.figure import LIVE, Figure, await_attribute
from tests.browser.figures.test_hands import HIDE
from tests.browser.server import SiteServer, published_anew

FRUGAL = "Object.defineProperty(navigator, 'connection', { value: { saveData: true } });"


def test_a_killed_worker_is_restarted_by_reset(reader: Callable[..., Reader]) -> None:
    """When the worker dies, the figure says so and keeps its picture, and Reset revives it."""
    visitor = reader(reduced_motion="reduce")
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    page.evaluate("Ladder.runtime.kill()")
    before = solve.readout("rms")
    solve.drag("source", 50, 50)
    solve.becomes("failed")
    expect(solve.root.locator("svg.panel").first).to_be_visible()
    solve.root.get_by_role("button", name=re.compile("reset", re.I)).first.click()
    solve.live().settled()
    solve.drag("source", 50, 50)
    solve.changes("rms", before)


def test_the_size_of_a_memory_that_has_gone_is_refused(reader: Callable[..., Reader]) -> None:
    """A request for it does not wait for ever, neither before a start nor if the worker dies meanwhile."""
    handler = "({ stopped }) => stopped"
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script(FRUGAL)
    page = visitor.open("kabsch.html")
    assert page.evaluate(f"Ladder.runtime.heap().catch({handler})") is True
    page.evaluate("Ladder.runtime.start()")
    Figure(page, "fig-solve").live()
    script = f"""() => {{
      Ladder.runtime.kill();
      const size = Ladder.runtime.heap().catch({handler});
      Ladder.runtime.restart();
      return size;
    }}"""
    assert page.evaluate(script) is True


def test_a_missing_runtime_file_is_named_and_retry_works(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With a file of the runtime missing, the figure names it; once it is there, Retry succeeds. A page marked by a
    browser extension is not taken for one of an updated site."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.expect("404")
    visitor.context.add_init_script(
        "document.addEventListener('DOMContentLoaded', () => { document.body.dataset.grExtInstalled = ''; });"
    )
    server.forbid(r"/runtime/.*numpy")
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    await_attribute(page, "html", "data-runtime", "failed")
    solve.drag("source", 50, 50)
    expect(solve.root.locator(".figure-status")).to_contain_text("numpy")
    server.forbid(None)
    before = solve.readout("rms")
    solve.root.get_by_role("button", name=re.compile("retry", re.I)).click()
    solve.changes("rms", before)
    solve.becomes("live")


def stall(reader: Callable[..., Reader], server: SiteServer) -> tuple[Figure, Locator, str]:
    """A figure that waits for a start that was given up because bytes stopped coming; its Retry, and the RMS before the
    drag. The patience is long from now on."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script("window.LADDER_PATIENCE = 300;")
    server.hold("/runtime/.*wasm")
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    before = solve.readout("rms")
    solve.drag("source", 50, 50)
    retry = solve.root.get_by_role("button", name=re.compile("retry", re.I))
    expect(retry).to_be_visible(timeout=30_000)
    page.evaluate("window.LADDER_PATIENCE = 60000")
    return solve, retry, before


def test_a_slow_start_says_so_and_offers_retry(reader: Callable[..., Reader], server: SiteServer) -> None:
    """When bytes stop coming, the figure says so after the time limit and offers Retry, and Retry works."""
    solve, retry, before = stall(reader, server)
    retry.click()
    server.release()
    solve.changes("rms", before)
    solve.becomes("live")


def test_a_start_given_up_on_goes_on_when_bytes_come(reader: Callable[..., Reader], server: SiteServer) -> None:
    """Retry would discard what has arrived, so it is no longer offered, and no second worker is started."""
    solve, retry, before = stall(reader, server)
    workers = len(solve.page.workers)
    server.release()
    expect(retry).to_be_hidden(timeout=30_000)
    solve.changes("rms", before)
    solve.becomes("live")
    assert len(solve.page.workers) == workers == 1


def test_why_python_failed_is_not_hidden_by_what_was_said_in_passing(reader: Callable[..., Reader]) -> None:
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live().settled()
    solve.reached("[data-pin]").click()
    words = solve.root.locator(".status-words")
    expect(words).to_have_text("Run 1 pinned.")
    page.evaluate("""() => { const { limits, runtime } = Ladder; limits.frame = 1500; runtime.kill();
      runtime.frame({ figure: "fig-wrong", record: {} }).catch(() => {}); }""")
    await_attribute(page, "html", "data-runtime", "failed")
    expect(words).to_contain_text("Python has not answered")


WRONG = {
    ("pyodide.mjs", "typed"): "pyodide.mjs could not be loaded: the server calls it text/plain, not JavaScript",
    ("pyodide.asm.mjs", "cut"): "pyodide.asm.mjs could not be loaded",
    ("pyodide.asm.wasm", "flipped"): "pyodide.asm.wasm is not the file that was built",
    ("numpy.pack", "short"): "numpy.pack is not the file that was built",
}


@pytest.mark.parametrize(("file", "fault"), WRONG)
def test_a_wrong_file_is_named_and_does_not_stay(
    reader: Callable[..., Reader], server: SiteServer, file: str, fault: str
) -> None:
    """The figure names it and keeps its picture and its tape; Retry works once the file is right, although the wrong
    one could be cached for a year."""
    visitor = reader(reduced_motion="reduce")
    visitor.expect("Failed to load", "MIME type", "ERR_CONTENT_LENGTH_MISMATCH", "SyntaxError", "asm.wasm", "wasm inst")
    server.spoilt = {file: fault}
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    await_attribute(page, "html", "data-runtime", "failed")
    expect(solve.root.locator(".figure-status")).to_contain_text(WRONG[file, fault])
    start = solve.readout("rms")
    solve.button("solve").click()
    answer = solve.changes("rms", start)
    solve.becomes("tape")
    solve.drag("source", 50, 50)
    solve.becomes("failed")
    assert solve.readout("rms") == answer
    server.spoilt = {}
    solve.root.get_by_role("button", name="Retry").click()
    solve.changes("rms", answer)
    solve.becomes("live")


def test_a_worker_killed_at_its_start_or_at_work_is_replaced(
    reader: Callable[..., Reader], server: SiteServer, site: Path, tmp_path: Path
) -> None:
    """The figure says that Python has fallen silent; Retry starts another worker, which answers the request. If the
    site has been updated since, there is none, and the figure says so."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.expect("404")
    visitor.context.add_init_script("window.LADDER_PATIENCE = 1500")
    server.hold("/runtime/.*wasm")
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    await_attribute(page, "html", "data-runtime", "loading")
    page.evaluate("Ladder.runtime.kill()")
    server.release()
    before = solve.readout("rms")
    solve.drag("source", 50, 50)
    solve.becomes("failed")
    page.evaluate("window.LADDER_PATIENCE = 60000")
    retry = solve.root.get_by_role("button", name="Retry")
    retry.click()
    moved = solve.changes("rms", before)
    solve.live().settled()
    # In the middle of a request: request and kill in one step, before the answer can come.
    page.evaluate(
        """() => { const { limits, runtime, figures, record } = Ladder, figure = figures.get("fig-solve");
          limits.frame = 1500; figure.ask(record.press(figure.record, "solve")); runtime.kill(); }"""
    )
    solve.becomes("failed")
    expect(solve.root.locator(".figure-status")).to_contain_text("Python has not answered")
    page.evaluate("Ladder.limits.frame = 60000")
    retry.click()
    solved = solve.changes("rms", moved)
    solve.becomes("live")
    solve.warm()  # a question of the warm-up that is underway would keep its own, long limit
    server.root = published_anew(site, tmp_path)
    forget(visitor.context)
    page.evaluate("Ladder.limits.frame = 1500; Ladder.runtime.kill();")
    solve.drag("source", 50, 50)
    retry.click()
    expect(solve.root.locator(".status-words")).to_contain_text("This site has been updated.")
    assert solve.readout("rms") == solved


def test_time_that_a_page_sleeps_through_is_not_python_s(reader: Callable[..., Reader]) -> None:
    """A lid is closed, or another tab is in front, while an answer is awaited: nothing has failed. Then the time limit
    of an answer begins anew."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.clock.install()
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").live().settled()
    page.evaluate("Ladder.runtime.kill()")
    solve.drag("source", 50, 50)
    page.clock.fast_forward("01:00:00")
    page.evaluate(HIDE, True)
    page.clock.run_for(60_000)
    expect(page.locator("html")).to_have_attribute("data-runtime", "live")
    page.evaluate(HIDE, False)
    page.clock.run_for(60_000)
    expect(page.locator("html")).to_have_attribute("data-runtime", "failed")


def test_a_fault_beside_the_answers_is_told_at_once(reader: Callable[..., Reader]) -> None:
    """Even if no error can be reported as an answer, as after Python's own end, the figure says why at once."""
    page = reader(alone=True, reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    page.evaluate("Ladder.limits.frame = 60000")
    (worker,) = page.workers
    worker.evaluate("() => { String.prototype.lastIndexOf = () => { throw new Error('Python has gone') }; }")
    page.evaluate("name => Ladder.figures.get(name).ask({...Ladder.figures.get(name).record, seed: -1})", solve.name)
    solve.becomes("failed")
    expect(solve.root.locator(".status-words")).to_contain_text("Python has gone")


def test_a_worker_killed_in_a_job_ends_the_job(reader: Callable[..., Reader]) -> None:
    """The job says so, its table stays, and its button begins it again."""
    race = Figure(reader(reduced_motion="reduce").open("race.html"), "fig-race").live()
    job = race.reached("section.job").first
    rows = job.locator("tbody tr").count()
    race.page.evaluate("Ladder.limits.replay = 1500")
    job.locator('[data-do="begin"]').click()
    expect(job).to_have_attribute("data-state", "running")
    race.page.evaluate("Ladder.runtime.kill()")
    expect(job.locator(".job-words")).to_have_text("Python stopped before the run was finished.", timeout=30_000)
    assert job.locator("tbody tr").count() == rows
    race.page.evaluate("Ladder.limits.replay = 60000")
    job.locator('[data-do="begin"]').click()
    race.live()
    expect(job).to_have_attribute("data-state", "running")
    job.locator('[data-do="stop"]').click()


def test_a_job_says_why_python_could_not_start(reader: Callable[..., Reader], server: SiteServer) -> None:
    """As the figures do: nothing was stopped."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.expect("404")
    server.forbid(r"/runtime/.*\.wasm")
    job = Figure(visitor.open("race.html"), "fig-race").seen().reached("section.job").first
    job.locator('[data-do="begin"]').click()
    expect(job.locator(".job-words")).to_contain_text(".wasm could not be loaded", timeout=LIVE)
    expect(job).to_have_attribute("data-state", "")


def test_an_error_in_one_figure_leaves_the_others_alone(reader: Callable[..., Reader]) -> None:
    """A frame that cannot be drawn fails within its figure, and after Reset the figure goes on."""
    page = reader(reduced_motion="reduce").open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    page.evaluate("name => Ladder.figures.get(name).ask({...Ladder.figures.get(name).record, seed: -1})", solve.name)
    solve.becomes("failed")
    before = solve.readout("rms")
    solve.root.get_by_role("button", name=re.compile("reset", re.I)).first.click()
    solve.becomes("live")
    solve.button("solve").click()
    solve.changes("rms", before)


def test_a_part_that_fails_leaves_the_others(reader: Callable[..., Reader], server: SiteServer) -> None:
    """With a deck that cannot be synchronised and one damaged record, other figures answer and the theme changes."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.expect("No channels here", "Unexpected token", "JSON")
    visitor.context.add_init_script("window.BroadcastChannel = function () { throw new Error('No channels here'); };")
    page = visitor.page()

    def damage(route: Route) -> None:
        answer = route.fetch()
        text = answer.text().replace('class="figure-record">{', 'class="figure-record">{,', 1)
        route.fulfill(response=answer, body=text)

    page.route("**/slides-icp.html", damage)
    page.goto(f"{server.origin}/slides-icp.html")
    names = [figure.get_attribute("id") or "" for figure in page.locator("figure.figure").all()]
    assert page.evaluate("[...Ladder.figures.keys()]") == names[1:]
    second = Figure(page, names[1]).live().settled()
    frames = second.frames()
    second.button("reset").evaluate("node => Ladder.figures.get(node.closest('figure').id).reset()")
    second.settled()
    assert second.frames() > frames
    page.locator("button.theme").click()
    assert page.locator("html").get_attribute("data-theme") != "auto"


def test_a_page_older_than_the_site_offers_a_reload(
    reader: Callable[..., Reader], server: SiteServer, site: Path, tmp_path: Path
) -> None:
    """Published again under an open page, whose worker file is then gone: Reload brings the new page and the state."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.expect("404", "Failed to load", "Failed to fetch")
    visitor.context.add_init_script(FRUGAL)
    page = visitor.open("kabsch.html")
    server.root = published_anew(site, tmp_path)
    solve = Figure(page, "fig-solve").seen()
    before = solve.readout("rms")
    solve.drag("source", 50, 50)
    words = solve.root.locator(".status-words")
    expect(words).to_have_text("This site has been updated. Only this figure’s state is kept.")
    record = solve.record()
    solve.root.get_by_role("button", name="Reload").click()
    solve.changes("rms", before)
    assert solve.record() == record


def test_a_browser_without_webassembly_says_so_and_loads_nothing_in_vain(reader: Callable[..., Reader]) -> None:
    """As in a lockdown mode. What was recorded plays all the same."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script("delete globalThis.WebAssembly;")
    page, loaded = visitor.page(), []
    page.on("request", lambda request: loaded.append(request.url))
    page.goto(f"{visitor.origin}/kabsch.html")
    solve = Figure(page, "fig-solve").seen()
    await_attribute(page, "html", "data-runtime", "failed")
    words = solve.root.locator(".status-words")
    expect(words).to_have_text("Python could not start: WebAssembly is turned off.")
    before = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", before)
    assert not [url for url in loaded if "/runtime/" in url or "/worker." in url]
