"""Speed for readers: first paint, the first answer from a figure's tape, heat maps, the race."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path
from statistics import median, quantiles
from threading import Event
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

from sitegen.bench.model import Bench, Row
from sitegen.check.browsers import FLAGS
from sitegen.serve.static_files import StaticHandler, serving

LOADS = 5
CLICKS = 15  # cold loads for a first click: of five, the worst page's median was 8 to 17 ms from run to run
MOVES = 300
TURNS = 20
RACES, STEPS, STOPS = 3, 40, 5
PATIENCE_MS = 60_000
CENTRED = "element => element.scrollIntoView({block: 'center', behavior: 'instant'})"
CHAPTERS = ("index.html", "kabsch.html", "race.html", "four.html")

WATCH = """() => {
  window.seen = {paint: 0, shift: 0, frames: []};
  new PerformanceObserver(list => { for (const e of list.getEntries()) seen.paint = e.startTime; })
    .observe({type: 'largest-contentful-paint', buffered: true});
  new PerformanceObserver(list => { for (const e of list.getEntries()) if (!e.hadRecentInput) seen.shift += e.value; })
    .observe({type: 'layout-shift', buffered: true});
}"""
# An input's mark has the time of its event, which is when the browser received it.
MARKS = """() => performance.getEntriesByType('mark').filter(m => m.name.startsWith('ladder:'))
  .map(m => [m.name, m.startTime]).sort((a, b) => a[1] - b[1])"""
IDLE = "[...Ladder.figures.values()].every(figure => !figure.busy)"
COUNT_FRAMES = """() => { const tick = t => { seen.frames.push(t); seen.next = requestAnimationFrame(tick); };
  seen.frames = []; seen.next = requestAnimationFrame(tick); }"""


@contextmanager
def browser_of(bench: Bench) -> Iterator[Browser]:
    """The bench's Chromium."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=bench.chromium, args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def visit(browser: Browser, url: str, foreign: list[str] | None = None, hook: str = "") -> Iterator[Page]:
    """A page in its own browser context with empty caches. Foreign requests are added to `foreign`; `hook` is a script
    function that runs before the page's scripts."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    context.add_init_script(f"({WATCH})()")
    if hook:
        context.add_init_script(f"({hook})()")
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    origin = "/".join(url.split("/")[:3])
    if foreign is not None:
        context.on("request", lambda r: None if r.url.startswith((origin, "data:", "blob:")) else foreign.append(r.url))
    page.goto(url, wait_until="load")
    try:
        yield page
    finally:
        context.close()


def until(page: Page, condition: str) -> None:
    """Wait for a condition, checked once per frame (Playwright's own wait evaluates text, which the policy forbids).
    Raises TimeoutError if it does not come true within a minute."""
    is_late = f"performance.now() > began + {PATIENCE_MS}"
    next_look = f"{is_late} ? done(false) : requestAnimationFrame(look)"
    look = f"const look = () => {condition} ? done(true) : {next_look}; look();"
    if not page.evaluate(f"new Promise(done => {{ const began = performance.now(); {look} }})"):
        raise TimeoutError(f"{page.url}: {condition} never became true")


def live(page: Page) -> None:
    """Scroll the first figure into view and wait until Python is up."""
    page.locator("figure.figure").first.scroll_into_view_if_needed()
    page.wait_for_selector("html[data-runtime=live]")


def paint(bench: Bench) -> list[Row]:
    """Largest contentful paint and layout shift of some pages, and the number of requests to other origins."""
    rows, foreign, shifts = [], list[str](), list[float]()
    with serving(bench.site) as server, browser_of(bench) as browser:
        for name in CHAPTERS:
            paints = []
            for _ in range(LOADS):
                with visit(browser, f"{server.origin}/{name}", foreign) as page:
                    until(page, "seen.paint > 0")
                    paints.append(page.evaluate("seen.paint"))
                    live(page)
                    shifts.append(page.evaluate("seen.shift"))
            note = f"median of {LOADS} cold loads"
            rows.append(Row(f"largest contentful paint, {name}", median(paints), "ms", 300, note))
    rows.append(Row("layout shift, until Python is up", max(shifts), "", 0, "worst of all loads"))
    rows.append(Row("requests to another origin", len(foreign), "", 0))
    return rows


class Holding(StaticHandler):
    """Holds the engine until the bench lets go, like a very slow connection. Not the rest of the runtime: a browser
    opens six connections to a host, and a page's later tapes must find one."""

    let_go: Event

    def do_GET(self) -> None:
        if self.path.endswith(".wasm"):
            self.let_go.wait()
        super().do_GET()


def tape(bench: Bench) -> list[Row]:
    """The time from a click on a figure's main button to the swapped picture, with Python not up and the figure in
    view: the first click on every page, in several cold loads."""
    Holding.let_go = Event()
    delays: dict[str, list[float]] = {}
    waiting: list[str] = []
    with serving(bench.site, Holding) as server, browser_of(bench) as browser:
        try:
            for name in pages_with(bench.site, 'class="primary"'):
                loads = [first_answer(browser, f"{server.origin}/{name}") for _ in range(CLICKS)]
                if answers := [delay for load in loads for delay in load or ()]:
                    delays[name] = answers
                elif loads[0] is not None:
                    waiting.append(name)
        finally:
            Holding.let_go.set()
    middle = {name: median(answers) for name, answers in delays.items()}
    worst = max(middle, key=middle.__getitem__)
    note = f"first click of a page, runtime held back: {worst}, median of {CLICKS} cold loads, worst of {len(delays)}"
    note += f" pages; median of pages {number_ms(median(middle.values()))}"
    note += f", longest of all loads {number_ms(max(map(max, delays.values())))}"
    note += f"; kept until Python is up: {', '.join(waiting)}" if waiting else ""
    return [Row("first answer from the tape", middle[worst], "ms", 16, note)]


def first_answer(browser: Browser, address: str) -> list[float] | None:
    """How long the page's first main button takes to answer, ms; empty if it waits for Python, None without one.

    The mouse is moved there and pressed directly: a locator's click would first check its target in the page, which
    would take the page's time.
    """
    with visit(browser, address) as page:
        main = page.locator(_MAIN)
        if not main.count():  # nothing can be pressed before a choice is made
            return None
        main.first.scroll_into_view_if_needed()
        until(page, _TAPED)
        box = main.first.bounding_box()
        assert box is not None, "the button has been scrolled into sight"
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.up()
        until(page, _HEARD)
        return answered(page.evaluate(MARKS))


_MAIN = 'figure.figure button.primary[data-button]:not([aria-disabled="true"])'
# The figure is in view and its tape has loaded.
_TAPED = f"""(url => !url || performance.getEntriesByName(new URL(url, document.baseURI).href).length)(
  document.querySelector({_MAIN!r}).closest('figure').dataset.tape)"""
# Answered from the tape, or waiting because the record is not on it.
_HEARD = """(performance.getEntriesByName('ladder:swap').length
  || document.querySelector('figure.figure[data-state=waiting]'))"""


def pages_with(site: Path, mark: str) -> list[str]:
    """The names of the pages whose HTML contains a mark; without the decks, which repeat the chapters' figures."""
    pages = [page for page in site.glob("*.html") if not page.name.startswith("slides-")]
    return sorted(page.name for page in pages if mark in page.read_text("utf-8"))


def number_ms(value: float) -> str:
    """Milliseconds for a note."""
    return f"{value:.1f} ms"


def answered(marks: Sequence[Sequence[Any]]) -> list[float]:
    """How long each input waited for a picture that shows it or something newer, in ms.

    `marks` are [name, time] in order of time. One question is under way at a time; inputs during it are merged into the
    next.
    """
    pending: list[float] = []
    waiting: list[float] = []
    delays = []
    for name, at in marks:
        if name == "ladder:input":
            (waiting if pending else pending).append(at)
        elif name == "ladder:swap":
            delays += [at - since for since in pending]
            pending, waiting = waiting, []
    return delays


def warmed(page: Page, figure: str) -> float:
    """Scroll a figure to the middle and wait for its warm-up, in which Python draws it and its likely next moves
    unseen; the ms that it took."""
    began: float = page.evaluate("performance.now()")
    page.locator(figure).evaluate(CENTRED)
    until(page, f"document.querySelector({figure!r}).matches('[data-warm]') && {IDLE}")
    return float(page.evaluate("performance.now()")) - began


def open_more(page: Page, figure: str) -> None:
    """Open a figure's More, as a reader would."""
    page.locator(f"{figure} details.figure-rest > summary").click()


def heat(bench: Bench) -> list[Row]:
    """Move a control of the score map repeatedly; the times to the coarse map and to the full one."""
    coarse: list[float] = []
    full: list[float] = []
    with ExitStack() as stack:
        server, browser = stack.enter_context(serving(bench.site)), stack.enter_context(browser_of(bench))
        page = stack.enter_context(visit(browser, f"{server.origin}/ndt-score.html"))
        live(page)
        warmed(page, "#fig-score")
        open_more(page, "#fig-score")
        for grids in ("one", "four"):
            page.locator(f'#fig-score [name="grids"][value="{grids}"]').check(force=True)
            for turn in range(TURNS + 1):
                until(page, IDLE)
                page.evaluate("performance.clearMarks()")
                page.locator('#fig-score [name="rotation"]').fill(str(turn))
                until(page, IDLE)
                marks = page.evaluate(MARKS)
                if turn:  # the first answer includes Python's one-off work
                    coarse += answered(marks)
                    full.append(marks[-1][1] - marks[0][1])
    note = f"{len(coarse)} turns of the NDT score map, from the input to the swapped picture; median "
    return [
        Row("heat map, coarse, 95th percentile", centile(coarse, 95), "ms", 33, note + number_ms(median(coarse))),
        Row("heat map, full, 63 × 63, 95th percentile", centile(full, 95), "ms", 300, note + number_ms(median(full))),
    ]


def nine(bench: Bench) -> list[Row]:
    """The race: repeated steps of all nine, a drag of their start, and the 25-seed benchmark, by its button."""
    with ExitStack() as stack:
        server, browser = stack.enter_context(serving(bench.site)), stack.enter_context(browser_of(bench))
        page = stack.enter_context(visit(browser, f"{server.origin}/race.html"))
        live(page)
        warmed(page, "#fig-race")
        open_more(page, "#fig-race")
        steps: list[float] = []
        for seed in range(RACES):
            page.locator('#fig-race [data-button="new"]').click()
            until(page, IDLE)
            page.evaluate("performance.clearMarks()")
            for _ in range(STEPS):
                page.locator('#fig-race [data-button="step"]').click()
                until(page, IDLE)
            steps += answered(page.evaluate(MARKS))[int(seed == 0) :]
        handle = page.locator('#fig-race .handle[data-handle="source"]').first
        handle.evaluate(CENTRED)
        missed, frames = drag_once(page, handle.bounding_box())
        drags = answered(page.evaluate(MARKS))
        slices, total, solving = page.evaluate(_JOB)
        stops = [page.evaluate(_STOP) for _ in range(STOPS)]
    note = f"{len(steps)} steps on {RACES} seeds, median {number_ms(median(steps))}"
    return [
        Row("nine panels, a step of all nine, 95th percentile", centile(steps, 95), "ms", 25, note),
        Row(
            "nine panels, a drag of the start, 95th percentile", centile(drags, 95), "ms", 25,
            f"{len(drags)} inputs, median {number_ms(median(drags))}; {missed} of {frames} frames missed",
        ),
        Row(
            "25-seed benchmark by the page's button", total, "ms", 2500,
            f"{len(slices)} answers of the page's worker, longest {number_ms(max(slices))}; the methods' times, in two"
            f" workers, sum to {number_ms(solving)}",
        ),
        Row("Stop of the benchmark, until Python is free", max(stops), "ms", 50, f"worst of {STOPS}, in mid run"),
    ]  # fmt: skip


def playing_map(bench: Bench) -> list[Row]:
    """The drive's map, played from its first scan to its last, press by press, with each kind of poses."""
    steps: list[float] = []
    with ExitStack() as stack:
        server, browser = stack.enter_context(serving(bench.site)), stack.enter_context(browser_of(bench))
        page = stack.enter_context(visit(browser, f"{server.origin}/drive.html"))
        live(page)
        warmed(page, "#fig-drive")
        open_more(page, "#fig-drive")
        for poses in ("odometry", "matched", "closed"):
            page.locator(f'#fig-drive [name="poses"][value="{poses}"]').check(force=True)
            until(page, IDLE)
            page.evaluate("performance.clearMarks()")
            step = page.locator('#fig-drive [data-button="step"]')
            while step.get_attribute("aria-disabled") != "true":
                step.click()
                until(page, IDLE)
            steps += answered(page.evaluate(MARKS))[int(poses == "odometry") :]
            page.locator('#fig-drive [data-button="reset"]').click()
    note = f"{len(steps)} presses, median {number_ms(median(steps))}, longest {number_ms(max(steps))}"
    return [Row("the drive's map, a press to the swapped SVG, 95th percentile", centile(steps, 95), "ms", 25, note)]


# Runs the page's own job by its button, after once to warm up: how long each answer of the page's worker took, how long
# the run, and the sum of the methods' times. The second worker, launched by the first run, stays for the second.
_JOB = """async () => {
  const box = document.querySelector('#fig-race section.job[data-job=benchmark]');
  const job = Ladder.runtime.job;
  let slices, began, result;
  Ladder.runtime.job = async wanted => {
    const at = performance.now();
    const answer = await job(wanted);
    slices.push(performance.now() - at);
    if (wanted.does === 'result') result = answer;
    return answer;
  };
  for (const round of [0, 1]) {
    slices = [], began = performance.now();
    const done = new Promise(resolve => {
      const seen = new MutationObserver(() => box.dataset.state === '' && resolve(seen.disconnect()));
      seen.observe(box, { attributes: true, attributeFilter: ['data-state'] });
    });
    box.querySelector('[data-do=begin]').click();
    await done;
  }
  Ladder.runtime.job = job;
  const inside = result.rows.reduce((sum, row) => sum + row.values.at(-1), 0);
  return [slices, performance.now() - began, inside];
}"""


# Starts the benchmark by its button and, once some of it is done, stops it by the other: the time from that click until
# the page shows it at rest and Python, after finishing its slice, answers something else.
_STOP = """() => new Promise(done => {
  const box = document.querySelector('#fig-race section.job[data-job=benchmark]');
  const part = box.querySelector('progress');
  const seen = new MutationObserver(async () => {
    if (part.value < 0.1) return;
    seen.disconnect();
    const clicked = performance.now();
    box.querySelector('[data-do=stop]').click();
    await Ladder.runtime.heap();
    if (box.dataset.state === '') done(performance.now() - clicked);
  });
  box.querySelector('[data-do=begin]').click();
  seen.observe(part, { attributes: true });
})"""


def centile(values: Sequence[float], percent: int) -> float:
    """The value that `percent` % of the values do not exceed."""
    return quantiles(values, n=100)[percent - 1]


def drag_once(page: Page, box: Any, moves: int = MOVES) -> tuple[int, int]:
    """Drag the element in the box once around a circle; the missed frames and all frames."""
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    until(page, IDLE)
    page.evaluate("performance.clearMarks()")
    page.mouse.move(x, y)
    page.mouse.down()
    page.evaluate(COUNT_FRAMES)
    for i in range(1, moves + 1):
        angle = 2 * pi * i / moves
        page.mouse.move(x - 60 * (1 - cos(angle)), y + 60 * sin(angle))
    frames = page.evaluate("(cancelAnimationFrame(seen.next), seen.frames)")
    page.mouse.up()
    until(page, IDLE)
    steps = [current - previous for previous, current in pairwise(frames)]
    usual = median(steps)
    missed = sum(max(0, round(step / usual) - 1) for step in steps)
    return missed, len(steps) + missed
