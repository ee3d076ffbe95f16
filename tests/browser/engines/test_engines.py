"""Static, tape, live, drag, offline and from disk, on every requested engine."""

from __future__ import annotations

from pathlib import Path

import pytest

from sitegen.check.offline import NOT_KEPT
from tests.browser.engines.page import Figure, Reading
from tests.browser.layout import MISFITS
from tests.browser.server import SiteServer
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

pytestmark = pytest.mark.browser

# A page as rendered. empty: figures without a drawing; flat: formulas without height; whole: formulas with all their
# parts; stacked: numerators above denominators; aligned: parts in a table's cell follow one another; hanging:
# parentheses hang outside their place; plain: terms without an underline; source: LaTeX is left over.
SEEN = """() => {
  const seen = (e) => { const { width, height } = e.getBoundingClientRect(); return width > 0 && height > 0; };
  // What is folded away has no size and needs no typeface; a figure's outcome is for readers without scripts.
  const away = document.documentElement.matches(".js") ? ".figure-after, details:not([open])" : "details:not([open])";
  const unfolded = (e) => !e.closest(away);
  const empty = (svg) => (unfolded(svg) && !seen(svg)) || svg.querySelectorAll("path").length < 2;
  const figures = [...document.querySelectorAll("figure.figure")];
  const loaded = [...document.fonts].filter(({ status }) => status === "loaded").map(({ family }) => family);
  const flat = (e) => e.getBoundingClientRect().height < 4;
  const bare = (f) => { const svgs = [...f.querySelectorAll("svg.panel")]; return !svgs.length || svgs.some(empty); };
  const parts = { msub: 2, msup: 2, msubsup: 3, mfrac: 2, munder: 2, mover: 2, munderover: 3 };
  const boxes = (row) => [...row.children].map((e) => e.getBoundingClientRect());
  const follow = (row) => boxes(row).every(({ left }, i, all) => i === 0 || left >= all[i - 1].right - 4);
  const hangs = (e) => (getComputedStyle(e).hangingPunctuation || "none") !== "none";
  const root = document.documentElement;
  return {
    heading: document.querySelector("h1").textContent.trim().length,
    figures: figures.length,
    empty: figures.filter(bare).length,
    live: [...document.querySelectorAll(".figure .buttons, .figure form.controls")].filter(seen).length,
    mathematics: document.querySelectorAll("math").length,
    formulas: [...document.querySelectorAll("math")].filter(unfolded).length,
    flat: [...document.querySelectorAll("math")].filter(flat).map((e) => e.textContent.slice(0, 40)),
    whole: Object.entries(parts).every(([tag, count]) =>
      [...document.querySelectorAll(tag)].every((e) => e.children.length === count)),
    stacked: [...document.querySelectorAll("mfrac")].every(({ children: [top, bottom] }) =>
      top.getBoundingClientRect().bottom <= bottom.getBoundingClientRect().top + 1),
    aligned: [...document.querySelectorAll("mtd > mrow")].every(follow),
    hanging: [...document.querySelectorAll("math")].some(hangs),
    plain: [...document.querySelectorAll(".term")].some((e) => getComputedStyle(e).textDecorationLine !== "underline"),
    wide: root.scrollWidth - root.clientWidth,
    fonts: [...new Set(loaded)].map((family) => family.replaceAll('"', "")),
    source: [...document.querySelectorAll("main :is(p, li, td, h1, h2, h3, figcaption)")].some((node) =>
      [...node.childNodes].some(({ nodeType, data }) => nodeType === 3 && data.includes("$"))),
  };
}"""


@pytest.mark.parametrize("width", [1280, 390])
def test_every_page_is_complete_without_scripts(
    reading: Reading, server: SiteServer, pages: list[str], width: int
) -> None:
    """Without scripts, text, mathematics, typefaces and every figure are there, and nothing is too wide."""
    server.forbid(r"\.m?js$")
    reading.expect(".js")
    reading.window.size(width, 1000)
    formulas = 0
    for name in (page for page in pages if page not in NOT_KEPT):
        reading.open(name)
        facts = reading.run(SEEN)
        assert facts["heading"], name
        assert facts["empty"] == 0, f"{name}: a figure without a drawing"
        assert facts["live"] == 0, f"{name}: controls that would do nothing"
        assert facts["flat"] == [], f"{name}: formulas without height"
        assert facts["whole"], f"{name}: a formula lacks parts"
        assert facts["stacked"], f"{name}: a fraction that does not stand over its denominator"
        assert facts["aligned"], f"{name}: parts of a formula stand over one another"
        assert not facts["hanging"], f"{name}: a parenthesis that is drawn over what stands before it"
        assert not facts["plain"], f"{name}: a term that is not underlined"
        assert facts["wide"] <= 0, f"{name} at {width} px"
        assert not facts["source"], f"{name}: a dollar sign is left over"
        assert {"Ladder Serif", "Ladder Sans"} <= set(facts["fonts"]), name
        has_math = "Ladder Math" in facts["fonts"]  # WebKit also loads it for folded formulas
        assert (facts["formulas"] > 0) <= has_math <= (facts["mathematics"] > 0), name
        formulas += facts["formulas"]
    assert formulas > 300


def test_the_tape_answers_before_python_is_up(reading: Reading, server: SiteServer) -> None:
    """With the runtime held back, Solve and Reset show recorded frames; a drag waits for Python."""
    server.hold("/runtime/")
    reading.open("kabsch.html")
    solve = reading.figure("fig-solve")
    start = solve.readout("rms")
    solve.click('[data-button="solve"]')
    answer = solve.changes("rms", start)
    solve.becomes("tape")
    assert float(answer) < float(start)
    solve.click('[data-button="reset"]')
    assert solve.changes("rms", answer) == start
    reading.figure("fig-solve").drag('[data-handle="source"]', 60, 40)
    solve.becomes("waiting")
    server.release()
    solve.live()
    solve.changes("rms", start)
    solve.becomes("live")


# The finest frame of a record, by way of the coarser ones, as the page asks: on a slow machine the finest of the atlas,
# asked for at once, would take longer than an answer may.
FINEST = """async ([record, details]) => {
  let frame;
  for (let detail = 0; detail < details; detail++) {
    frame = await Ladder.runtime.frame({ figure: "fig-x", record, detail });
  }
  return frame;
}"""


def test_python_answers_with_the_build_s_bytes(reading: Reading) -> None:
    """The runtime starts; a press and a control answer live; every preset's frame equals the build's, byte for byte."""
    reading.open("kabsch.html")
    solve = reading.figure("fig-solve").live()
    start = solve.readout("rms")
    solve.click('[data-button="solve"]')
    answer = solve.changes("rms", start)
    solve.becomes("live")
    solve.focus('[name="noise"]')
    reading.window.press("ArrowRight")
    solve.changes("rms", answer)
    host = Host()
    for widget in WIDGETS.values():
        for name in widget.presets:
            record = preset(widget, name).plain()
            live = reading.run(FINEST, [record, widget.details])
            assert live == host.render("fig-x", record), f"{widget}: {name}"


def test_pointer_and_keys_drag_a_handle(reading: Reading) -> None:
    """A drag moves the handle by as much as the pointer; arrow keys move it further, and it keeps the focus."""
    reading.open("kabsch.html")
    solve = reading.figure("fig-solve").live().settled()
    part = '[data-handle="source"]'
    start, before = solve.readout("rms"), solve.box(part)
    solve.drag(part, 80, -30)
    moved = solve.changes("rms", start)
    after = solve.box(part)
    assert abs(after[0] - before[0] - 80) < 1.5
    assert abs(after[1] - before[1] + 30) < 1.5
    solve.focus(part)
    reading.window.press("ArrowRight")
    rms = solve.changes("rms", moved)
    step = solve.box(part)[0] - after[0]
    assert step > 0
    reading.window.press("Shift+ArrowRight")
    solve.changes("rms", rms)
    assert solve.box(part)[0] - after[0] > 3 * step
    assert solve.of("({ root }, part) => document.activeElement === root.querySelector(part)", part)


NOTHING_YET = '[aria-disabled="true"], [data-button="back"], [data-button="reset"]'


# A map with levels of detail; many panels and a job.
@pytest.mark.parametrize("page", ["landscape.html", "race.html"])
def test_every_figure_of_a_page_answers(reading: Reading, page: str) -> None:
    """Each figure's first usable button changes the picture; nothing is too wide once all figures are live."""
    reading.open(page)
    for name in reading.names():
        figure = reading.figure(name).live().settled()
        before = figure.frame()["panels"]
        figure.click(f".figure-desk > .buttons [data-button]:not({NOTHING_YET})")
        figure.becomes("live").settled()
        assert figure.frame()["panels"] != before, name
    for width in (1280, 390):
        reading.window.size(width, 1000)
        assert reading.run("() => document.documentElement.scrollWidth - document.documentElement.clientWidth") <= 0


AT = "() => [...document.querySelectorAll('.slide')].findIndex((e) => Math.abs(e.getBoundingClientRect().top) < 2) + 1"


# Chapters with formulas, a map beside its charts, and many panels.
@pytest.mark.parametrize("deck", ["slides-kabsch.html", "slides-landscape.html", "slides-race.html"])
def test_a_deck_turns_and_its_figure_answers(reading: Reading, deck: str) -> None:
    """Every slide fits the screen; keys lead from one to the next; a slide's figure answers a press."""
    reading.window.size(1280, 720)
    reading.open(deck)
    assert reading.run(MISFITS) == []
    name = reading.names()[0]
    at = reading.run("(name) => Number(document.getElementById(name).closest('.slide').id)", name)
    for number in range(2, at + 1):
        reading.window.press("ArrowRight")
        reading.until(f"() => ({AT})() === {number}")
    assert reading.run("() => location.hash") == f"#{at}"
    figure = Figure(reading, name).live().settled()
    before = figure.frame()["panels"]
    # The slide is tested in place: scrolling the button to the middle would turn the page half-way.
    reading.window.pointer([figure.middle(f".figure-desk > .buttons [data-button]:not({NOTHING_YET})")])
    figure.becomes("live").settled()
    assert figure.frame()["panels"] != before
    reading.window.press("ArrowRight")
    reading.until(f"() => ({AT})() === {at + 1}")


def test_everything_works_with_the_server_gone(
    reading: Reading, server: SiteServer, site: Path, pages: list[str]
) -> None:
    """After one visit the server goes away: every page opens completely, and a figure works with Python."""
    # Firefox logs this for requests that are pending when a page is left; the end of the test checks that all are
    # there.
    reading.expect("A ServiceWorker intercepted the request")
    reading.open("kabsch.html")
    reading.figure("fig-solve").live()
    reading.until("() => Ladder.offline.ready")
    server.stop()
    for name in (page for page in pages if page not in NOT_KEPT):
        reading.open(name)
        facts = reading.run(SEEN)
        assert facts["heading"], name
        assert facts["empty"] == 0, name
        assert {"Ladder Serif", "Ladder Sans"} <= set(facts["fonts"]), f"{name}: without its typefaces"
    reading.open("icp.html")
    figure = reading.figure(reading.names()[0]).live().settled()
    before = figure.frame()["panels"]
    figure.click(".buttons .primary")
    figure.becomes("live").settled()
    assert figure.frame()["panels"] != before
    files = [*site.glob("assets/*"), *site.glob("tapes/*")]
    names = [file.relative_to(site).as_posix() for file in files if file.suffix in (".js", ".mjs", ".css", ".svg")]
    answers = "(names) => Promise.all(names.map(async (name) => (await fetch(name)).ok))"
    assert names
    assert all(reading.run(answers, names))


def test_a_page_opened_from_disk_steps(reading: Reading, site: Path) -> None:
    """file:// has no worker: the tape answers, and one line says how to serve the site."""
    # From disk, Chromium refuses preloaded fonts; the style sheet's requests, which follow, succeed.
    reading.expect("Access to font", "ERR_FAILED", "A preload for")
    reading.open("kabsch.html", site.as_uri())
    reading.until("() => document.documentElement.dataset.runtime === 'file'")
    solve = reading.figure("fig-solve")
    start = solve.readout("rms")
    solve.click('[data-button="solve"]')
    solve.changes("rms", start)
    reading.figure("fig-solve").drag('[data-handle="source"]', 60, 40)
    reading.until("() => document.querySelector('#fig-solve .figure-status').textContent.includes('http.server')")
