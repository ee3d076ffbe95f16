"""A figure's long work: the benchmark in the tab, its table, Stop, and priority for the reader's requests."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest
from playwright.sync_api import Locator, expect

from solvers.studies.benchmark import benchmark
from solvers.studies.race import CONTESTANTS, Controls
from tests.browser.conftest import Reader
from tests.browser.figure import LIVE, Figure

LONG = 180_000  # ms for a whole benchmark on a busy machine


@pytest.fixture
def race(reader: Callable[..., Reader]) -> Figure:
    return Figure(reader(reduced_motion="reduce").open("race.html"), "fig-race").live()


def job(figure: Figure) -> Locator:
    return figure.reached('section.job[data-job="benchmark"]')


def rows(figure: Figure) -> list[list[str]]:
    """The table's cells as shown, row by row."""
    return [line.locator("th, td").all_inner_texts() for line in job(figure).locator("tbody tr").all()]


def test_stop_is_heard_at_once_and_a_reader_comes_first(race: Figure) -> None:
    """While it runs, a step of the race is answered; Stop ends it within the click, and it can begin again."""
    page, begin, stop = race.page, *(job(race).locator(f'[data-do="{action}"]') for action in ("begin", "stop"))
    begin.click()
    expect(job(race)).to_have_attribute("data-state", "running")
    before = race.frames()
    race.button("step").click()
    race.settled()
    assert race.frames() > before
    expect(job(race)).to_have_attribute("data-state", "running")
    ended = page.evaluate("""() => {
      const box = document.querySelector('section.job');
      box.querySelector('[data-do=stop]').click();
      return box.dataset.state === '';
    }""")
    assert ended, "Stop waits for no worker"
    expect(stop).to_be_disabled()
    expect(begin).to_be_enabled()
    expect(job(race).locator(".job-words")).to_contain_text("Stopped")
    begin.click()
    expect(job(race)).to_have_attribute("data-state", "running")
    stop.click()


def test_the_table_sorts_by_any_column(race: Figure) -> None:
    """A heading sorts ascending, then descending, says so, and keeps the focus."""
    names = [row[0] for row in rows(race)]
    for column in range(6):
        heading = job(race).locator(f'[data-sort="{column}"]')
        for way in ("ascending", "descending"):
            heading.click()
            expect(heading).to_be_focused()
            expect(job(race).locator("thead th").nth(column + 1)).to_have_attribute("aria-sort", way)
            texts = [row[column + 1] for row in rows(race)]
            values = [float(text) for text in texts if text != "–"]
            assert len(values) == (0 if column == 5 else len(names))  # the time is known only after a run
            assert values == sorted(values, reverse=way == "descending")
    job(race).locator('[data-sort="-1"]').click()
    assert [row[0] for row in rows(race)] == sorted(names, key=str.lower)


def test_a_kept_run_stays_beside_the_next(race: Figure) -> None:
    """The static run is kept; each row of a new run at other settings has both numbers, as far as it has come."""
    values = {row[0]: row[1] for row in rows(race)}
    job(race).locator('[data-do="keep"]').click()
    race.set("setting", "clean")
    race.settled()
    job(race).locator('[data-do="begin"]').click()
    expect(job(race).locator(".job-caption").first).to_contain_text("clean", timeout=LONG)
    job(race).locator('[data-do="stop"]').click()
    first = rows(race)[0]
    value, old = first[1].split()
    assert old == values[first[0]]
    assert value != old
    assert job(race).locator(".job-panels").count() == 2
    job(race).locator('[data-do="drop"]').click()
    assert job(race).locator(".job-panels").count() == 1


def test_the_table_is_there_without_scripts(reader: Callable[..., Reader]) -> None:
    """The native table for the figure's settings is in the page, with its drawings but without buttons."""
    page = reader(java_script_enabled=False).open("race.html")
    page.locator(".figure-rest > summary").click()
    box = page.locator("section.job")
    expect(box.locator("tbody tr")).to_have_count(9)
    expect(box.locator("svg.panel")).to_have_count(2)
    labels = ["Keep to compare", "Copy as CSV", "Save as CSV", "Copy the Python"]
    assert box.locator(".job-tools button").all_text_contents() == labels
    expect(box.locator("button")).to_have_count(6)
    for button in box.locator("button").all():
        expect(button).to_be_hidden()
    for line, row in zip(benchmark(Controls()), box.locator("tbody tr").all(), strict=True):
        assert row.locator("th").inner_text() == line.contestant.label
        assert row.locator("td").all_inner_texts()[2:4] == [str(line.turned), str(line.close)]


def test_a_begin_before_python_is_up_waits_for_it(reader: Callable[..., Reader]) -> None:
    """Pressed at once, it begins when the runtime is live."""
    race = Figure(reader(reduced_motion="reduce").open("race.html"), "fig-race").seen()
    job(race).locator('[data-do="begin"]').click()
    expect(job(race)).to_have_attribute("data-state", "running")
    race.live()
    expect(job(race).locator(".job-words")).to_contain_text("step", timeout=LIVE)


def test_a_stop_before_python_is_up_is_heard_when_it_is(reader: Callable[..., Reader]) -> None:
    """A job requested and stopped while Python starts is not begun in it."""
    visitor = reader(alone=True, reduced_motion="reduce")
    visitor.context.add_init_script("""
      globalThis.asked = [];
      const post = Worker.prototype.postMessage;
      Worker.prototype.postMessage = function (data, ...more) {
        if (data.type === "job") asked.push(JSON.parse(data.request).do);
        return post.call(this, data, ...more);
      };
    """)
    race = Figure(visitor.open("race.html"), "fig-race").seen()
    race.page.evaluate("""() => {
      const box = document.querySelector("section.job");
      box.querySelector("[data-do=begin]").click();
      box.querySelector("[data-do=stop]").click();
    }""")
    expect(job(race).locator(".job-words")).to_contain_text("Stopped")
    race.live()
    race.page.wait_for_function("() => asked.includes('stop')", timeout=LIVE)
    assert race.page.evaluate("asked") == ["parts", "stop"]


# Notes which worker is asked to begin which part. The page's second worker may be "deaf", which hears of none, or
# "mortal", which dies of the first.
WATCHED = """
  globalThis.begun = [[], []];
  globalThis.second = "sound";
  const workers = [];
  const post = Worker.prototype.postMessage;
  Worker.prototype.postMessage = function (data, ...more) {
    if (!workers.includes(this)) workers.push(this);
    const which = workers.indexOf(this);
    if (data.type === "job") {
      const { do: does, part } = JSON.parse(data.request);
      if (does === "begin") begun[which ? 1 : 0].push(part);
      if (which === 1 && second === "mortal") this.dispatchEvent(new ErrorEvent("error", { cancelable: true }));
      if (which === 1 && second !== "sound") return;
    }
    return post.call(this, data, ...more);
  };
"""


@pytest.fixture
def watched(reader: Callable[..., Reader]) -> Callable[[str], Figure]:
    """The race of a page whose workers are watched, and in which a script has run first."""

    def race(script: str = "") -> Figure:
        visitor = reader(alone=True, reduced_motion="reduce")
        visitor.context.add_init_script(WATCHED + script)
        return Figure(visitor.open("race.html"), "fig-race").live()

    return race


CORES = "Object.defineProperty(navigator, 'hardwareConcurrency', { value: %d });"
NINE = [contestant.method for contestant in CONTESTANTS]


def run(race: Figure) -> tuple[list[str], list[str]]:
    """Run the benchmark to its end; what the page's worker began, and what the second or its successor."""
    job(race).locator('[data-do="begin"]').click()
    expect(job(race).locator(".job-words")).to_contain_text("Done in", timeout=LONG)
    assert [row[0] for row in rows(race)] == [contestant.label for contestant in CONTESTANTS]
    first, second = race.page.evaluate("begun")
    return first, second


def is_the_native_one(race: Figure) -> None:
    """The tab's benchmark agrees with native Python: counts within one, and for ICP, point-to-plane, GICP and soft
    targets the medians to the digits shown."""
    for row, line in zip(rows(race), benchmark(Controls()), strict=True):
        assert abs(int(row[3]) - line.turned) <= 1, row
        assert abs(int(row[4]) - line.close) <= 1, row
        assert int(row[6].replace(",", "")) > 0
        if line.contestant.method in ("icp", "point-to-plane", "gicp", "soft-annealed"):
            assert row[1] == f"{line.median_rre:.2f}"
            assert row[2] == f"{line.median_rte:.3f}"
    assert job(race).locator(".job-panels svg.panel").count() == 2


def test_two_workers_share_the_parts(watched: Callable[[str], Figure]) -> None:
    """The page's worker takes them from the first on, the second from the last on; it stays for the next run."""
    race = watched(CORES % 2)
    for _ in range(2):
        first, second = run(race)
        assert second
        assert second == NINE[::-1][: len(second)]
        assert first[: len(NINE) - len(second)] == NINE[: len(NINE) - len(second)]
        is_the_native_one(race)
        race.page.evaluate("begun = [[], []]")


def test_one_core_has_one_worker(watched: Callable[[str], Figure]) -> None:
    race = watched(CORES % 1)
    assert run(race) == (NINE, [])
    is_the_native_one(race)


def test_a_second_worker_that_hangs_is_not_waited_for(watched: Callable[[str], Figure]) -> None:
    """The page's worker does what the second one had begun, in this run and the next."""
    race = watched(CORES % 2 + "second = 'deaf';")
    for _ in range(2):
        assert run(race) == (NINE, NINE[-1:])
        race.page.evaluate("begun = [[], []]")


def test_a_second_worker_that_dies_is_replaced_at_the_next_run(watched: Callable[[str], Figure]) -> None:
    race = watched(CORES % 2 + "second = 'mortal';")
    assert run(race) == (NINE, NINE[-1:])
    race.page.evaluate("begun = [[], []]")
    first, second = run(race)
    assert len(second) > 1
    assert first[: len(NINE) - len(second)] == NINE[: len(NINE) - len(second)]


def test_every_panel_takes_the_start(race: Figure) -> None:
    """Dragging the start in the fifth panel drags the start, and the handle in the first panel gets the focus."""
    grip = race.root.locator('.handle.copy[data-handle="source"]').nth(3)
    grip.scroll_into_view_if_needed()
    box = grip.bounding_box()
    assert box
    page, x, y = race.page, box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y + 20, steps=4)
    page.mouse.up()
    race.settled()
    assert race.record()["log"][-1][:2] == ["drag", "source"]
    expect(race.root.locator('.handle:not(.copy)[data-handle="source"]')).to_be_focused()
    places = {json.dumps(panel["caption"].split("\n")[1]) for panel in race.frame()["panels"][:9]}
    assert len(places) == 1
