"""How every published figure follows a pointer: its handles dragged around, or its first slider drawn across."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median

from playwright.sync_api import Locator, Page

from sitegen.bench import split
from sitegen.bench.model import Bench, Row
from sitegen.bench.pages import (
    CENTRED,
    IDLE,
    MARKS,
    answered,
    browser_of,
    centile,
    drag_once,
    live,
    number_ms,
    pages_with,
    until,
    visit,
    warmed,
)
from sitegen.serve.static_files import serving

MOVES = 75  # a handle
HANDLES = 2  # of a figure: the cloud and its turn; the others of a figure are theirs again, in other panels
NEAR = ("0", "1", "2", "3", "3½")  # the rungs whose figures answer within a frame
NEAR_MS = 16.0
OURS_MS = 4.0  # of it what Python and the page's scripts may take
CONTROLLED = 1.5  # times the control figure's
NINE = "race"
NINE_MS = 25.0
FRAME_MS = 16.0

# The values of a slider from end to end, at most so many, one an event as a drawn thumb gives them.
_DRAWN = """async (slider, moves) => {
  const low = +slider.min, step = +slider.step, count = Math.round((+slider.max - low) / step);
  for (let i = 0; i <= moves; i++) {
    slider.value = low + step * Math.round(count * i / moves);
    await new Promise(requestAnimationFrame);
    slider.dispatchEvent(new Event('input', {bubbles: true}));
  }
}"""


@dataclass(frozen=True)
class Followed:
    """One figure: the widget, where it stands, what was moved, the delay of each input in ms, frames missed of all; of
    each answer what Python and the page's scripts took, the delays of the control figure where one can be laid, and how
    long its warm-up took, in ms."""

    widget: str
    where: str
    rung: str
    moved: str
    delays: list[float]
    missed: int
    frames: int
    ours: list[tuple[float, float]] = field(default_factory=list)
    control: list[float] = field(default_factory=list)
    warm_up: float = 0.0


def drag(bench: Bench) -> list[Row]:
    """Every figure of the built site moved: the delay of each input, and the frames that were missed."""
    results: list[Followed] = []
    with ExitStack() as stack:
        server, browser = stack.enter_context(serving(bench.site)), stack.enter_context(browser_of(bench))
        for name in with_figures(bench.site):
            with visit(browser, f"{server.origin}/{name}", hook=split.HOOK) as page:
                live(page)
                until(page, IDLE)
                rung = page.locator(".chapter-rung").inner_text().removeprefix("Rung").strip()
                figures = page.locator("figure.figure[data-widget]")
                each = (followed(page, figure, name, rung, server.origin) for figure in figures.all())
                results += [one for one in each if one]
    return rows(results)


def with_figures(site: Path) -> list[str]:
    """The rungs that have a figure to move, by name: other pages' figures are theirs, or wait for a reader's files."""
    rungs = pages_with(site, 'class="chapter-rung"')
    return [name for name in pages_with(site, 'class="figure" id="') if name in rungs]


def followed(page: Page, figure: Locator, page_name: str, rung: str, origin: str) -> Followed | None:
    """The figure's handles dragged, or without any its first slider drawn; None where there is neither.

    A hand comes once the figure has been in sight for as long as its warm-up takes. A drag of a near rung is made once
    more on the control figure, right after it.
    """
    widget, name = figure.get_attribute("data-widget") or "", figure.get_attribute("id")
    where, took = f"{page_name}#{name}", warmed(page, f"#{name}")
    names = dict.fromkeys(handle.get_attribute("data-handle") or "" for handle in figure.locator(".handle").all())
    handles = list(names)[:HANDLES]
    slider = figure.locator("input[type=range]").first
    delays, missed, frames, moved = list[float](), 0, 0, handles
    ours, control = list[tuple[float, float]](), list[float]()
    for handle in (figure.locator(f'.handle[data-handle="{name}"]').first for name in handles):
        handle.evaluate(CENTRED)
        split.begin(page)
        late, some = drag_once(page, handle.bounding_box(), MOVES)
        missed, frames = missed + late, frames + some
        delays += answered(page.evaluate(MARKS))
        ours += split.shares(page)
        if rung in NEAR:
            with split.laid_control(page, figure, handle, origin) as other:
                drag_once(other, other.locator("button").bounding_box(), MOVES)
                control += answered(other.evaluate(MARKS))
    if not handles:
        if not slider.count():
            return None
        page.evaluate("performance.clearMarks()")
        split.begin(page)
        slider.evaluate(_DRAWN, MOVES)
        until(page, IDLE)
        delays = answered(page.evaluate(MARKS))
        ours = split.shares(page)
        moved = [f"slider {slider.get_attribute('name')}"]
    return Followed(widget, where, rung, " and ".join(moved), delays, missed, frames, ours, control, took)


def rows(results: list[Followed]) -> list[Row]:
    """A line a figure; the aims for handles on the near rungs, and for the others a frame to read their times by."""
    out = []
    for one in results:
        near = one.rung in NEAR and one.frames > 0  # a slider draws another map: no drag
        aim = NEAR_MS if near else NINE_MS if one.widget == NINE else None
        note = f"{one.moved}: {len(one.delays)} inputs, median {number_ms(median(one.delays))}"
        reading = "" if aim is not None else f"; a frame is {FRAME_MS:.0f} ms"
        which = "nine panels, " if one.widget == NINE else "near rungs, " if near else ""
        what = f"{which}input to swapped SVG, 95th percentile, {one.where}"
        out.append(Row(what, centile(one.delays, 95), "ms", aim, note + reading))
        out += _split(one, which)
    missed, frames = sum(one.missed for one in results), sum(one.frames for one in results)
    worst = max(results, key=lambda one: one.missed / max(one.frames, 1))
    note = f"{missed} of {frames} in all figures with handles; most in {worst.where}, {worst.missed} of {worst.frames}"
    out.append(Row("frames missed in a drag", 100 * missed / max(frames, 1), "%", 1, note))
    slow = max(results, key=lambda one: one.warm_up)
    note = f"in sight with Python up; {slow.where}, median {number_ms(median(one.warm_up for one in results))}"
    return [*out, Row("warm-up of a figure, the longest", slow.warm_up, "ms", None, note)]


def _split(one: Followed, which: str) -> list[Row]:
    """The figure's own share of its answers, and its delays beside the control figure's."""
    out = []
    if one.ours:
        near = which.startswith("near")
        python, script = (number_ms(median(part)) for part in zip(*one.ours, strict=True))
        note = f"medians: Python {python}, page script {script}"
        what = f"{which}our share of it, 95th percentile, {one.where}"
        out.append(Row(what, centile([*map(sum, one.ours)], 95), "ms", OURS_MS if near else None, note))
    if one.control:
        here, there = centile(one.delays, 95), centile(one.control, 95)
        note = f"the control takes {number_ms(there)}, median {number_ms(median(one.control))}"
        what = f"{which}of the control figure's, 95th percentile, {one.where}"
        out.append(Row(what, here / there, "times", CONTROLLED, note))
    return out
