"""How fast every published figure follows a pointer: its handles are dragged around, or its first slider moved
across."""

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

MOVES = 75  # per handle
HANDLES = 2  # per figure: the cloud and its turn; a figure's others repeat them in other panels
NEAR = ("0", "1", "2", "3", "3½")  # the rungs whose figures should answer within a frame
NEAR_MS = 16.0
OURS_MS = 4.0  # the share of it for Python and the page's scripts
CONTROLLED = 1.5  # times the control figure's delay
NINE = "race"
NINE_MS = 25.0
FRAME_MS = 16.0

# Sets a slider's values from end to end, in at most `moves` steps with one event each, as dragging its thumb does.
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
    """One figure's results: the widget, its page and id, its rung, what was moved, the delay of each input in ms,
    missed and total frames; for each answer the time in Python and in the page's scripts, the delays of the control
    figure if there is one, and the length of its warm-up, in ms."""

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
    """Move every figure of the built site; the delay of each input, and the frames missed."""
    results: list[Followed] = []
    with ExitStack() as stack:
        server, browser = stack.enter_context(serving(bench.site)), stack.enter_context(browser_of(bench))
        for name in with_figures(bench.site):
            with visit(browser, f"{server.origin}/{name}", hook=split.HOOK) as page:
                live(page)
                until(page, IDLE)
                rung = page.locator(".chapter-rung").inner_text().removeprefix("Rung").strip()
                figures = page.locator("figure.figure[data-widget]")
                candidates = (followed(page, figure, name, rung, server.origin) for figure in figures.all())
                results += [result for result in candidates if result]
    return rows(results)


def with_figures(site: Path) -> list[str]:
    """The names of the rungs' pages with figures: other pages repeat these, or their figures wait for a reader's
    files."""
    rungs = pages_with(site, 'class="chapter-rung"')
    return [name for name in pages_with(site, 'class="figure" id="') if name in rungs]


def followed(page: Page, figure: Locator, page_name: str, rung: str, origin: str) -> Followed | None:
    """Drag the figure's handles or, if it has none, its first slider; None if there is neither.

    The figure is first in view for as long as its warm-up takes. On near rungs each drag is repeated on the control
    figure right afterwards.
    """
    widget, name = figure.get_attribute("data-widget") or "", figure.get_attribute("id")
    anchor, took = f"{page_name}#{name}", warmed(page, f"#{name}")
    names = dict.fromkeys(handle.get_attribute("data-handle") or "" for handle in figure.locator(".handle").all())
    handles = list(names)[:HANDLES]
    slider = figure.locator("input[type=range]").first
    delays, missed, frames, controls = list[float](), 0, 0, handles
    ours, control = list[tuple[float, float]](), list[float]()
    for handle in (figure.locator(f'.handle[data-handle="{name}"]').first for name in handles):
        handle.evaluate(CENTRED)
        split.begin(page)
        late_frames, count = drag_once(page, handle.bounding_box(), MOVES)
        missed, frames = missed + late_frames, frames + count
        delays += answered(page.evaluate(MARKS))
        ours += split.shares(page)
        if rung in NEAR:
            with split.laid_control(page, figure, handle, origin) as control_page:
                drag_once(control_page, control_page.locator("button").bounding_box(), MOVES)
                control += answered(control_page.evaluate(MARKS))
    if not handles:
        if not slider.count():
            return None
        page.evaluate("performance.clearMarks()")
        split.begin(page)
        slider.evaluate(_DRAWN, MOVES)
        until(page, IDLE)
        delays = answered(page.evaluate(MARKS))
        ours = split.shares(page)
        controls = [f"slider {slider.get_attribute('name')}"]
    return Followed(widget, anchor, rung, " and ".join(controls), delays, missed, frames, ours, control, took)


def rows(results: list[Followed]) -> list[Row]:
    """One row per figure, with targets for handles on near rungs and the race; the others' notes give a frame's
    length."""
    out = []
    for result in results:
        is_near = result.rung in NEAR and result.frames > 0  # a slider redraws a whole map: not a drag
        aim = NEAR_MS if is_near else NINE_MS if result.widget == NINE else None
        note = f"{result.moved}: {len(result.delays)} inputs, median {number_ms(median(result.delays))}"
        reading = "" if aim is not None else f"; a frame is {FRAME_MS:.0f} ms"
        prefix = "nine panels, " if result.widget == NINE else "near rungs, " if is_near else ""
        label = f"{prefix}input to swapped SVG, 95th percentile, {result.where}"
        out.append(Row(label, centile(result.delays, 95), "ms", aim, note + reading))
        out += _share_rows(result, prefix)
    missed, frames = sum(r.missed for r in results), sum(r.frames for r in results)
    worst = max(results, key=lambda r: r.missed / max(r.frames, 1))
    note = f"{missed} of {frames} in all figures with handles; most in {worst.where}, {worst.missed} of {worst.frames}"
    out.append(Row("frames missed in a drag", 100 * missed / max(frames, 1), "%", 1, note))
    slow = max(results, key=lambda r: r.warm_up)
    note = f"in sight with Python up; {slow.where}, median {number_ms(median(r.warm_up for r in results))}"
    return [*out, Row("warm-up of a figure, the longest", slow.warm_up, "ms", None, note)]


def _share_rows(result: Followed, prefix: str) -> list[Row]:
    """The figure's own share of its answers, and its delays relative to the control figure's."""
    out = []
    if result.ours:
        is_near = prefix.startswith("near")
        python, script = (number_ms(median(part)) for part in zip(*result.ours, strict=True))
        note = f"medians: Python {python}, page script {script}"
        label = f"{prefix}our share of it, 95th percentile, {result.where}"
        out.append(Row(label, centile([*map(sum, result.ours)], 95), "ms", OURS_MS if is_near else None, note))
    if result.control:
        delay, control = centile(result.delays, 95), centile(result.control, 95)
        note = f"the control takes {number_ms(control)}, median {number_ms(median(result.control))}"
        label = f"{prefix}of the control figure's, 95th percentile, {result.where}"
        out.append(Row(label, delay / control, "times", CONTROLLED, note))
    return out
