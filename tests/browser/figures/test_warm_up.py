"""Moves that Python draws off screen while it is idle, so that a reader's first move is not the slowest."""

from __future__ import annotations

import json
from collections.abc import Callable
from math import cos, pi, sin
from typing import Any

import pytest
from playwright.sync_api import expect

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure

# The worker's requests for frames, in order.
LISTEN = """(() => {
  window.posted = [];
  window.Worker = class extends Worker {
    postMessage(message, ...rest) {
      if (message.type === 'frame') posted.push(JSON.parse(message.request));
      super.postMessage(message, ...rest);
    }
  };
})()"""
# Everything that a reader sees and hears of a figure, and its state.
SEEN = """name => {
  const { root, record, shown } = Ladder.figures.get(name);
  const parts = ['.figure-panel', '.handle', '.readouts', '.figure-status', '.figure-voice'];
  const seen = parts.map(part => [...root.querySelectorAll(part)].map(each => each.outerHTML));
  const { frame, state } = root.dataset;
  return [seen.map(({ length }) => length), JSON.stringify([record, shown, frame, state, seen])];
}"""


def posts(figure: Figure) -> list[dict[str, Any]]:
    """The frames requested for the figure so far."""
    result: list[dict[str, Any]] = figure.page.evaluate("name => posted.filter(p => p.figure === name)", figure.name)
    return result


@pytest.fixture
def listening(reader: Callable[..., Reader]) -> Callable[..., Figure]:
    """A figure on a page with Python up, with all of the page's requests recorded."""

    def open_at(path: str, name: str) -> Figure:
        visitor = reader(alone=True, reduced_motion="reduce")
        visitor.context.add_init_script(LISTEN)
        return Figure(visitor.open(path), name).live()

    return open_at


def test_it_makes_the_moves_that_a_reader_may_and_shows_none(listening: Callable[..., Figure]) -> None:
    """Each handle is dragged about its place and the run's steps are pressed; the last frame drawn is the one shown."""
    nearest = listening("icp.html", "fig-nearest")
    before = nearest.page.evaluate(SEEN, nearest.name)
    nearest.warm()
    assert all(before[0]), "panels, handles, numbers, the status, the voice"
    assert nearest.page.evaluate(SEEN, nearest.name) == before
    logs = [p["record"]["log"] for p in posts(nearest)]
    drags = [action for log in logs for action in log if action[0] == "drag"]
    for handle in nearest.frame()["handles"]:
        x, y = handle["world"]
        mine = [action for action in drags if action[1] == handle["name"]]
        assert mine
        assert len({(a[2], a[3]) for a in mine}) == len(mine), "a place that was drawn before may be known"
        assert all(abs(a[2] - x) + abs(a[3] - y) < 1.0 for a in mine)
    steps = [log for log in logs if log and log[-1] == ["press", "step"]]
    assert [len(log) for log in steps] == list(range(1, len(steps) + 1))
    assert steps
    assert logs[-1] == nearest.record()["log"] == []


@pytest.mark.parametrize(
    ("path", "name", "kind"), [("ndt-map.html", "fig-cells", "hover"), ("race.html", "fig-race", "drag")]
)
def test_what_python_drew_unseen_changes_no_picture(
    listening: Callable[..., Figure], path: str, name: str, kind: str
) -> None:
    """A step after it, and back: the pictures are those of a figure that was never warmed up."""
    figure = listening(path, name).warm()
    assert any(p["record"]["log"][-1][0] == kind for p in posts(figure) if p["record"]["log"])
    button = figure.root.locator("[data-button=step], [data-button=next]").first.get_attribute("data-button")
    log = [["press", button]]
    frames = """async ([name, log]) => {
      const { record, spec } = Ladder.figures.get(name);
      const detail = spec.details > 1 ? 0 : undefined;
      const told = [];
      for (const figure of [name, 'cold']) {
        const frames = [];
        for (const each of [log, []]) {
          const frame = await Ladder.runtime.frame({ figure, record: { ...record, log: each }, detail });
          frames.push(JSON.stringify(frame).replaceAll(`${figure}-`, ''));
        }
        told.push(frames);
      }
      return told;
    }"""
    mine, cold = figure.page.evaluate(frames, [name, log])
    assert mine[0] != mine[1]
    assert mine == cold


def test_a_figure_that_is_not_on_screen_stays_cold(listening: Callable[..., Figure]) -> None:
    first = listening("icp.html", "fig-nearest")
    last = Figure(first.page, "fig-wall")
    first.warm()
    assert posts(last) == []
    last.warm()
    assert posts(last)


def test_a_hand_has_python_for_itself(listening: Callable[..., Figure]) -> None:
    """From a drag's first answer to its release, only the pointer's places are drawn; then warm-up goes on."""
    nearest = listening("icp.html", "fig-nearest")
    page = nearest.page
    page.evaluate("() => { Ladder.limits.pause = 1; }")
    before = nearest.readout("rms")
    box = nearest.handle("source").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.evaluate(
        """name => { const figure = Ladder.figures.get(name); window.wanted = [];
          figure.on('asked', () => wanted.push(JSON.stringify(figure.record.log))); }""",
        nearest.name,
    )
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 5, y)
    nearest.changes("rms", before)
    count = len(posts(nearest))
    for i in range(40):
        page.mouse.move(x + 60 * sin(pi * i / 20), y + 60 - 60 * cos(pi * i / 20))
    until(page, "!Ladder.figures.get('fig-nearest').pending")
    requests = [json.dumps(p["record"]["log"]) for p in posts(nearest)[count:]]
    expected = [json.dumps(json.loads(text)) for text in page.evaluate("wanted")]
    assert len(requests) > 5
    assert set(requests) <= set(expected)
    page.mouse.up()
    nearest.warm()


def test_a_move_that_cannot_be_drawn_is_passed_over(reader: Callable[..., Reader]) -> None:
    """If Python refuses every drag, the steps are still drawn, the warm-up ends, and no message is shown."""
    visitor = reader(reduced_motion="reduce")
    page = visitor.open("icp.html")
    nearest = Figure(page, "fig-nearest")
    page.evaluate(
        """() => { const { runtime } = Ladder, ask = runtime.frame; window.drawn = [];
          runtime.frame = wanted => {
            const last = wanted.record.log.at(-1)?.[0];
            window.drawn.push(last);
            return last === 'drag' ? Promise.reject(new Error('refused')) : ask(wanted);
          }; }"""
    )
    nearest.warm()
    kinds = page.evaluate("drawn")
    assert kinds.count("drag") == 1
    assert kinds.count("press") > 0
    assert (nearest.root.locator(".figure-status").text_content() or "").strip() == ""
    assert nearest.frames() == 0


def test_another_worker_is_warmed_up_anew(reader: Callable[..., Reader]) -> None:
    solve = Figure(reader(reduced_motion="reduce").open("kabsch.html"), "fig-solve").warm()
    solve.page.evaluate("Ladder.runtime.kill()")
    solve.drag("source", 30, 30)
    solve.becomes("failed")
    expect(solve.root).not_to_have_attribute("data-warm", "")
    solve.root.get_by_role("button", name="Retry").click()
    solve.live().settled()
    solve.warm()
