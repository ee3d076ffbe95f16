"""Memory does not grow with use: the worker's over a thousand drags, the page's own over hundreds of presses."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import CDPSession

from sitegen.bench.pages import IDLE, until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure

pytestmark = pytest.mark.browser

# Entries at places round a circle, each requested once the previous one is answered, drawn coarsely.
ENTRIES = """async ([name, kind, what, count]) => {
  for (let i = 0; i < count; i++) {
    const record = structuredClone(Ladder.figures.get(name).record);
    record.log = [[kind, what, Math.cos(i) * 2, Math.sin(i) * 2]];
    await Ladder.runtime.frame({figure: name, record, detail: 0});
  }
  return await Ladder.runtime.heap();
}"""
WARM, PRESSES = 60, 150


@pytest.mark.parametrize(
    ("page", "name", "kind", "target"),
    [("icp.html", "fig-nearest", "drag", "source"), ("ndt-score.html", "fig-score", "click", "map")],
)
def test_a_thousand_actions_leave_the_worker_s_heap_alone(
    reader: Callable[..., Reader], page: str, name: str, kind: str, target: str
) -> None:
    """A cloud with its nearest neighbours, and a map with a climb on it."""
    figure = Figure(reader(reduced_motion="reduce").open(page), name).live()
    warm = figure.page.evaluate(ENTRIES, [name, kind, target, WARM])
    assert warm > 10_000_000
    assert figure.page.evaluate(ENTRIES, [name, kind, target, 1000]) == warm


def test_hundreds_of_presses_leave_the_page_as_it_is(reader: Callable[..., Reader]) -> None:
    """Step and Reset, with pictures swapped each time: about as many nodes and listeners as before, and a heap of
    nearly constant size. What leaks does so in both rounds; what is loaded once, at any time, grows it in one."""
    page = reader(reduced_motion="reduce").open("icp.html")
    figure = Figure(page, "fig-nearest").live()
    meter = page.context.new_cdp_session(page)
    meter.send("Performance.enable")
    press(figure, WARM)
    before = metrics(meter)
    grown = []
    for _ in range(2):
        start = metrics(meter)["JSHeapUsedSize"]
        press(figure, PRESSES)
        grown.append(metrics(meter)["JSHeapUsedSize"] - start)
    after = metrics(meter)
    assert before["Nodes"] > 100
    assert after["Nodes"] <= before["Nodes"] + 20, (before, after)
    assert after["JSEventListeners"] <= before["JSEventListeners"] + 5, (before, after)
    assert min(grown) < 250_000, (grown, before, after)


def press(figure: Figure, count: int) -> None:
    """Press this many times, every third time Reset."""
    for i in range(count):
        figure.button("reset" if i % 3 == 2 else "step").evaluate("button => button.click()")
        until(figure.page, IDLE)


def metrics(meter: CDPSession) -> dict[str, float]:
    """The page's metrics by name, after garbage collection."""
    meter.send("HeapProfiler.collectGarbage")
    return {metric["name"]: metric["value"] for metric in meter.send("Performance.getMetrics")["metrics"]}
