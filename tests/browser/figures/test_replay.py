"""Actions are replayed, however long it takes: after a restart, from a link, with files that are read again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from playwright.sync_api import Route, expect

from sitegen.bench.pages import until
from sitegen.check.offline import ask
from tests.browser.conftest import ROOT, Reader
from tests.browser.figure import LIVE, Figure, first_record, link_of
from tests.browser.widgets.test_own_clouds import choose, clouds, expect_message, lines
from widgets.engine.host import Host

# Every action of this widget's figures takes half a second, and reading a file takes four.
SLOW = """
self.addEventListener("message", ({ data }) => {
  if (data.type === "give") for (const end = Date.now() + 4000; Date.now() < end; );
  if (data.type !== "frame" || self.slowed) return;
  self.slowed = true;
  turn = turn.then(slow); // before the answer
});
async function slow() {
  for (;;) {
    try {
      return void python.runPython(SLOWER);
    } catch {
      await rooms.bring(rooms.wanted()); // the figure's own pack
    }
  }
}
const SLOWER = `
import time
from widgets.engine.registry import WIDGETS
kabsch = WIDGETS["kabsch"]
def act(state, action, quick=kabsch.act):
    time.sleep(0.5)
    return quick(state, action)
object.__setattr__(kabsch, "act", act)
`;
"""
FRAME = 5000  # ms: the time limit of an answer here; replays take longer
DONE = [["drag", "source", 0.1 * i, -0.2 * i] if i % 2 else ["press", "solve"] for i in range(14)]


def slow_down(visitor: Reader) -> None:
    """Give pages that open after this a slow worker."""

    def answer(route: Route) -> None:
        source = (ROOT / "templates/assets/worker.mjs").read_text("utf-8")  # unbundled: the bundle renames its own
        route.fulfill(response=route.fetch(), body=SLOW + source)

    visitor.context.route("**/worker*.mjs", answer)


def open_link(reader: Callable[..., Reader]) -> Figure:
    visitor = reader(alone=True, reduced_motion="reduce")
    slow_down(visitor)
    page = visitor.open("kabsch.html")
    page.evaluate("limit => { Ladder.limits.frame = limit; }", FRAME)
    return Figure(page, "fig-solve").live().settled()


def follow_link(figure: Figure, log: list[Any]) -> dict[str, Any]:
    """Navigate to the address of the figure's first record with this log; return that record."""
    record = {**first_record(figure), "log": log}
    figure.page.evaluate("hash => { location.hash = hash; }", f"{figure.name}?s={link_of(record)}")
    return record


def until_done(figure: Figure, count: int) -> None:
    """Wait until this many actions are shown and no request is pending."""
    until(figure.page, f"Ladder.figures.get({figure.name!r}).shown.log.length === {count}")
    figure.settled()


def test_a_long_replay_tells_how_far_it_is_and_comes_to_its_end(reader: Callable[..., Reader]) -> None:
    """Each action of a link is answered in time, but together they take longer than an answer may; actions made
    meanwhile are added; after the worker restarts, the next press replays everything."""
    solve = open_link(reader)
    status = solve.root.locator(".figure-status")
    record = follow_link(solve, DONE)
    expect(status).to_contain_text(f"of {len(DONE)} actions", timeout=LIVE)
    expect(solve.root.locator(".figure-voice")).to_have_text("Restoring your actions.")  # without how far it is
    solve.drag("source", 40, 30)
    until_done(solve, len(DONE))  # the link's last action is a drag of the same handle, which this one replaces
    after = solve.record()
    assert after["log"][:-1] == record["log"][:-1]
    assert after["log"][-1] != record["log"][-1]
    assert solve.frame() == Host().render(solve.name, after)
    solve.page.evaluate("Ladder.runtime.restart()")
    solve.live().button("solve").click()
    expect(status).to_contain_text(f"of {len(DONE) + 1} actions", timeout=LIVE)
    until_done(solve, len(DONE) + 1)
    assert solve.frame() == Host().render(solve.name, {**after, "log": [*after["log"], ["press", "solve"]]})
    expect(status).not_to_contain_text("actions")


def test_a_long_replay_can_be_cancelled(reader: Callable[..., Reader]) -> None:
    """While it goes on, another figure answers; Cancel leaves the figure as it was, and it answers at once."""
    solve = open_link(reader)
    second = Figure(solve.page, "fig-mirror").seen()
    follow_link(solve, DONE * 20)
    cancel = solve.root.get_by_role("button", name="Cancel")
    expect(cancel).to_be_visible(timeout=LIVE)
    frames = second.frames()
    ask(solve.page, second.name)
    assert second.frames() > frames
    assert len(solve.record()["log"]) == 20 * len(DONE)
    cancel.click()
    expect(solve.root.locator(".figure-status")).to_contain_text("Cancelled. The figure is as it was.")
    assert solve.record()["log"] == []
    before = solve.readout("rms")
    solve.button("solve").click()
    solve.changes("rms", before)
    assert solve.record()["log"] == [["press", "solve"]]
    follow_link(solve, DONE * 10)
    expect(cancel).to_be_visible(timeout=LIVE)
    solve.button("reset").click()
    solve.shows("rms", before).settled()
    expect(cancel).to_have_count(0)


def test_a_slow_device_is_waited_for_longer_each_time(reader: Callable[..., Reader]) -> None:
    """An answer that takes longer than an answer may comes after Retry: the limit grows until the device keeps it."""
    solve = open_link(reader)
    status = solve.root.locator(".figure-status")
    solve.page.evaluate("() => { Ladder.limits.pause = 1e9; Ladder.limits.frame = 250; }")  # ms; an action takes 500
    solve.button("solve").click()
    solve.becomes("failed")
    expect(status).to_contain_text("Python has not answered")
    for _ in range(3):
        if solve.root.get_attribute("data-state") == "failed":
            solve.root.get_by_role("button", name="Retry").click()
            solve.page.wait_for_selector(f"#{solve.name}:is([data-state=live], [data-state=failed])", state="attached")
    solve.becomes("live").settled()
    assert solve.record()["log"] == [["press", "solve"]]


ASKED = """
const { postMessage } = Worker.prototype;
window.asked = 0;
Worker.prototype.postMessage = function (message, ...more) {
  if (message.type === "frame" && message.request.includes('"fig-solve"')) window.asked += 1;
  return postMessage.call(this, message, ...more);
};
"""


def test_what_was_replayed_once_is_known(reader: Callable[..., Reader]) -> None:
    """For a link that the page was opened with, the next action costs one answer, and so does Back."""
    visitor = reader(alone=True, reduced_motion="reduce")
    slow_down(visitor)
    visitor.context.add_init_script(ASKED)
    page = visitor.open(f"kabsch.html#fig-solve?s={link_of({'widget': 'kabsch', 'log': DONE})}")
    page.evaluate("() => { Ladder.limits.pause = 1e9; }")  # no warm-up, which also makes requests
    solve = Figure(page, "fig-solve").live()
    until_done(solve, len(DONE))
    before = page.evaluate("window.asked")
    assert before > len(DONE) / 2
    solve.button("solve").click()
    until_done(solve, len(DONE) + 1)
    solve.button("back").click()
    until_done(solve, len(DONE))
    assert page.evaluate("window.asked") == before + 2


def test_clouds_are_read_again_under_the_limit_of_reading(reader: Callable[..., Reader]) -> None:
    """Two files that take longer to read than an answer may are read again after the worker restarts."""
    visitor = reader(alone=True, reduced_motion="reduce")
    slow_down(visitor)
    own = Figure(visitor.open("clouds.html"), "fig-own").live()
    own.page.evaluate("limit => { Ladder.limits.frame = limit; }", FRAME)
    for side, points in zip(("source", "target"), clouds(), strict=True):
        choose(own, side, f"{side}.csv", lines(points))
        expect_message(own, side, f"{side}.csv: ")
    own.settled()
    before = own.readout("rms")
    own.page.evaluate("Ladder.runtime.restart()")
    own.live().button("step").click()
    expect(own.root.locator(".figure-status")).to_contain_text("Python is reading target.csv again.", timeout=LIVE)
    own.changes("rms", before)
    own.becomes("live")
