"""Every page is complete before any script runs; and as it becomes alive on a phone, nothing moves and everything has
room.

Every page is visited twice, with one test per rule; tests/browser/accessibility/test_axe.py covers wide pages.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page

from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure, figures
from tests.browser.layout import (
    BEYOND,
    CUT,
    CUT_RUNGS,
    DETAILS,
    FRAMES,
    LATE_FONTS,
    MEETING,
    SIDEWAYS,
    SMALL,
    SMALL_TEXT,
    SPACED,
    TORN,
    UNREACHED,
    UNUSED_FONTS,
    count_figures,
    low,
    remaining,
)
from tests.browser.visits import QUIET, Found

SHIFT = """() => new Promise(done => {
  let moved = 0;
  new PerformanceObserver(list => { for (const e of list.getEntries()) if (!e.hadRecentInput) moved += e.value; })
    .observe({type: 'layout-shift', buffered: true});
  requestAnimationFrame(() => requestAnimationFrame(() => done(moved)));
})"""
TWICE = "(ids => ids.filter((x, i) => ids.indexOf(x) !== i))([...document.querySelectorAll('[id]')].map(e => e.id))"
# Without scripts: the parts that a figure lacks, and buttons and controls that would do nothing.
LACKS = """() => [...document.querySelectorAll('figure.figure')].map(figure => {
  const drawings = [...figure.querySelectorAll('svg.panel')];
  const vain = [...figure.querySelectorAll('.buttons, form.controls')].filter(e => e.checkVisibility());
  return [figure.id, [
    drawings.length ? '' : 'nothing drawn',
    drawings.some(e => e.querySelectorAll('path').length < 2) ? 'an empty drawing' : '',
    figure.querySelector('figcaption').innerText.startsWith('Figure') ? '' : 'without its number',
    ...vain.map(e => `${e.className} do nothing`),
  ].filter(words => words)];
})"""
# For each field of a figure, once it has the focus: the fraction of the first panel that is in the window, and whether
# nothing covers the field.
FIELDS = """() => [...document.querySelectorAll('figure.figure')].flatMap(figure => {
  const fields = [...figure.querySelectorAll('.figure-body :is(input, select, .buttons button)')];
  const panel = figure.querySelector('.figure-stage > .large > svg, .figure-stage > .figure-panel > svg');
  return fields.map((field, index) => {
    field.focus();
    const r = field.getBoundingClientRect();
    const at = document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2);
    const box = panel.getBoundingClientRect();
    const shown = Math.min(innerHeight, box.bottom) - Math.max(0, box.top);
    const free = Boolean(at && (at === field || at.closest('label, .control')?.contains(field)));
    return [`${figure.id}, field ${index}`, shown / box.height, free];
  });
})"""
# Roots without their sign, whose contents begin where the root does, and roots with a gap after them.
ROOTS = """() => {
  const box = element => element.getBoundingClientRect(), style = getComputedStyle;
  return [...document.querySelectorAll('msqrt')].filter(root => root.checkVisibility()).flatMap(root => {
    const [em, whole, last] = [parseFloat(style(root).fontSize), box(root), box(root.lastElementChild)];
    const before = (box(root.firstElementChild).left - whole.left) / em;
    const after = (whole.right + parseFloat(style(root).marginRight) - last.right) / em;
    return [...(before < 0.3 ? ['no sign'] : []), ...(after < -0.05 || after > 0.1 ? [`${after} em after it`] : [])]
      .map(wrong => `the root of ${root.textContent} has ${wrong}`);
  });
}"""
# Punctuation after a formula that begins a line.
STRAYS = """() => [...document.querySelectorAll('math')].flatMap(formula => {
  const next = formula.nextSibling, range = document.createRange();
  if (!formula.checkVisibility() || next?.nodeType !== 3 || !/^[,.;:!?)\\]’”]/.test(next.data)) return [];
  range.setStart(next, 0);
  range.setEnd(next, 1);
  const below = range.getBoundingClientRect().top > formula.getBoundingClientRect().bottom - 3;
  return below ? [`after ${formula.textContent} a line begins with ${next.data.slice(0, 9)}`] : [];
})"""
WIDTHS = (1280, 390)
NARROWEST = 320
CUT_NUMBERS = CUT.replace("svg.panel text, .plot-svg text", "svg.padded text")
CUT_FIXED = CUT.replace("svg.panel text, .plot-svg text", "svg.panel text[textLength]")
MEETING_IN_PANELS = MEETING.replace("svg.panel, .plot-svg", "svg.panel")
PERCENTS = (100, 130)
SMALLEST = (320, 640)  # px, the screen of a small old phone


@pytest.fixture(scope="module")
def bare(visit: Callable[..., Found], site: Path, alike: list[str]) -> Found:
    """The faults of pages where no script runs, by width; one page represents those that are alike."""

    def complete(page: Page, path: str, width: int) -> Iterator[str]:
        page.set_viewport_size({"width": width, "height": 1000})
        if page.locator("h1").count() != 1 or not page.title().strip():
            yield "no heading, or several, or no title"
        lacks = page.evaluate(LACKS)
        if len(lacks) != count_figures(site, path):
            yield f"{len(lacks)} of {count_figures(site, path)} figures"
        yield from (f"{name}: {fault}" for name, wrong in lacks for fault in wrong)
        for script in (SIDEWAYS, TORN, CUT_RUNGS, ROOTS):
            yield from page.evaluate(script)
        if width != min(WIDTHS):
            return
        page.set_viewport_size({"width": NARROWEST, "height": 1000})
        page.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
        yield from (f"at {NARROWEST} px, all unfolded: {fault}" for fault in page.evaluate(SIDEWAYS))

    checks = {str(width): lambda page, path, width=width: complete(page, path, width) for width in WIDTHS}
    return visit(checks, left_out=alike, java_script_enabled=False)


@pytest.fixture(scope="module")
def phone(visit: Callable[..., Found], site: Path) -> Found:
    """The faults of pages on a phone, by rule."""

    def moves(page: Page, path: str) -> Iterator[str]:
        fonts = {*page.evaluate(LATE_FONTS, True)}
        for figure in figures(page):
            figure.live()
        moved = page.evaluate(SHIFT)
        if moved >= 0.001:  # a busy machine may paint before a font is read: a page that shifts by itself does so again
            page.reload()
            for figure in figures(page):
                figure.live()
            moved = min(moved, page.evaluate(SHIFT))
        if moved >= 0.001:
            yield f"shifts by {moved}"
        fonts = {*fonts, *page.evaluate(LATE_FONTS, False)}
        yield from (f"asks for {font} after its styles are read: it may shift" for font in fonts)
        yield from (f"asks for {font} ahead of need and does not use it" for font in page.evaluate(UNUSED_FONTS))
        yield from (f"has the id {name} twice" for name in page.evaluate(TWICE))

    def overflows(page: Page, _path: str) -> Iterator[str]:
        yield from remaining(page, SIDEWAYS, SMALL_TEXT, CUT)
        yield from page.evaluate(STRAYS)

    def leads(page: Page, path: str, percent: int, size: tuple[int, int] = (390, 844)) -> Iterator[str]:
        count, wrong = low(page, ("panel", "button", "first"), *size, percent)
        yield from wrong if not path.startswith("docs-") else []
        if count != count_figures(site, path):
            yield f"{count} of {count_figures(site, path)} figures"

    def in_sight(page: Page, path: str) -> Iterator[str]:
        page.emulate_media(reduced_motion="reduce")
        if path.startswith("docs-"):
            return
        page.evaluate("document.querySelectorAll('details.figure-rest').forEach(e => { e.open = true; })")
        page.evaluate(FRAMES)
        fields = page.evaluate(FIELDS)
        for name, share, _ in fields:
            if share < 0.6:
                yield f"{name} has the focus, of the panel {share:.2f} is seen"
        yield from (f"{name} has the focus and is covered" for name, _, free in fields if not free)
        if len(fields) < 2 * page.locator("figure.figure").count():
            yield f"only {len(fields)} fields were found"

    def room(page: Page, _path: str) -> Iterator[str]:
        page.evaluate(DETAILS)
        yield from remaining(page, SMALL)
        page.set_viewport_size({"width": SMALLEST[0], "height": SMALLEST[1]})
        yield from (f"at 320 px: {fault}" for fault in remaining(page, BEYOND, MEETING))
        page.set_viewport_size({"width": 640, "height": 900})
        page.evaluate("() => { document.documentElement.style.fontSize = '200%'; }")
        yield from (f"with large text: {fault}" for fault in remaining(page, BEYOND))

    def spaced(page: Page, _path: str) -> Iterator[str]:
        page.set_viewport_size({"width": SMALLEST[0], "height": SMALLEST[1]})
        page.evaluate("document.querySelectorAll('details').forEach(each => { each.open = true; })")
        page.evaluate(SPACED)
        yield from remaining(page, BEYOND, UNREACHED, CUT_NUMBERS, CUT_FIXED, MEETING_IN_PANELS)

    checks = {
        "moves": moves,
        "overflows": overflows,
        **{f"{percent} %": lambda page, path, percent=percent: leads(page, path, percent) for percent in PERCENTS},
        "in sight": in_sight,
        "room": room,
        "small": lambda page, path: leads(page, path, 100, SMALLEST),
        "spaced": spaced,
    }
    return visit(checks, width=390, height=844, has_touch=True)


@pytest.mark.parametrize("width", WIDTHS)
def test_every_page_is_complete_without_scripts(bare: Found, width: int) -> None:
    """Text, mathematics and every figure are there with scripts disabled, and nothing overflows."""
    assert bare[str(width)] == []


def test_pages_that_are_alike_are_complete_as_they_are_sent(site: Path, alike: list[str]) -> None:
    """They have one heading and a title, and no figure, which would have to be examined."""
    for path in alike:
        text = (site / path).read_text("utf-8")
        assert len(re.findall(r"<h1\b", text)) == 1, path
        assert re.search(r"<title>[^<]*\w[^<]*</title>", text), path
        assert count_figures(site, path) == 0, path


def test_nothing_overflows_or_moves(phone: Found) -> None:
    """No page shifts while it becomes alive or uses an id twice; none scrolls sideways, has tiny text, cuts off a label
    or begins a line with the comma after a formula."""
    assert phone["moves"] + phone["overflows"] == []


@pytest.mark.parametrize("percent", PERCENTS)
def test_what_leads_fits_a_phone(phone: Found, percent: int) -> None:
    """The sentence, picture, button and first control of every figure fit on one screen."""
    assert phone[f"{percent} %"] == []


def test_what_leads_fits_the_smallest_phone(phone: Found) -> None:
    """So do they on a screen of 320 × 640."""
    assert phone["small"] == []


def test_a_phone_keeps_the_picture_in_sight(phone: Found) -> None:
    """Whichever field of a figure has the focus, including those behind More, six tenths of its panel are visible, and
    the field is not covered."""
    assert phone["in sight"] == []


def test_room_and_touch_on_every_page(phone: Found) -> None:
    """At 390 px every target is at least 44 px; at 320 px, which is 400 % of 1280, and with text at twice its size,
    nothing extends beyond the screen, with the details open. At 320 px no two labels of a drawing meet."""
    assert phone["room"] == []


def test_room_for_spaced_text(phone: Found) -> None:
    """At 320 px, with more space between letters, words and lines, a formula that is too wide scrolls in its own box,
    by keyboard too, no number at an axis is cut off, and no two labels of a panel meet."""
    assert phone["spaced"] == []


def test_the_browser_complains_of_no_page(bare: Found, phone: Found) -> None:
    """No error, no warning, no request to another origin."""
    assert bare[QUIET] + phone[QUIET] == []


def test_mathematics_is_rendered_at_build_time(reader: Callable[..., Reader]) -> None:
    """The chapter on known pairs has MathML, and no dollar signs left over."""
    page = reader(java_script_enabled=False).open("kabsch.html")
    assert page.locator("math").count() > 10
    assert page.locator("main").inner_text().count("$") == 0


@pytest.mark.parametrize(("selector", "path", "width"), [(".formula", "uncertainty.html", 320),
                                                         ("pre", "docs-authoring.html", 1280)])  # fmt: skip
def test_what_scrolls_fades_where_more_of_it_follows(
    reader: Callable[..., Reader], selector: str, path: str, width: int
) -> None:
    """A formula, or code: at the right until it is scrolled to its end, then at the left; what fits does not fade."""
    page = reader(width=width, height=640).open(path)
    each = f"[...document.querySelectorAll('{selector}')]"
    wide, fitting = (f"{each}.filter(e => e.scrollWidth {sign} e.clientWidth)" for sign in (">", "<="))
    fades = "(e => ['--before', '--beyond'].map(name => parseFloat(getComputedStyle(e).getPropertyValue(name)) > 0))"
    until(page, f"{fades}({wide}[0]).join() === 'false,true'")  # a scroll timeline is updated at each frame
    page.evaluate(f"{wide}[0].scrollLeft = 1e4")
    until(page, f"{fades}({wide}[0]).join() === 'true,false'")
    assert page.evaluate(f"{fitting}.map({fades}).flat().some(Boolean)") is False


def test_code_does_not_lie_under_the_contents(reader: Callable[..., Reader]) -> None:
    """In the margin of a page that has wide code beside its contents."""
    page = reader(width=1280, height=900).open("docs-authoring.html")
    code, contents = page.locator(".text > pre").first.bounding_box(), page.locator(".contents").bounding_box()
    assert code is not None
    assert contents is not None
    assert code["y"] < contents["y"] + contents["height"]
    assert code["x"] + code["width"] <= contents["x"]


def test_figure_numbers_and_anchors_agree(reader: Callable[..., Reader]) -> None:
    """A link to a figure leads to the figure with that number."""
    page = reader().open("kabsch.html")
    links = page.locator('main a.ref[href^="#fig-"]').all()
    assert links
    for link in links:
        target = (link.get_attribute("href") or "#")[1:]
        assert Figure(page, target).root.locator(".figure-number").text_content() == link.text_content()


def test_a_low_window_shows_the_whole_ladder(reader: Callable[..., Reader]) -> None:
    """At the top of the page, where the header moves it down, a window 800 px high shows it from the lowest rung to the
    highest; a lower window shows at least the page's own rung."""
    script = """nodes => nodes.map(node => node.getBoundingClientRect())
      .every(box => box.top >= 0 && box.bottom <= innerHeight && box.height >= 24)"""
    page = reader(width=1280, height=800).open("index.html")
    assert page.locator(".ladder a").evaluate_all(script)
    page.set_viewport_size({"width": 1280, "height": 600})
    page.reload()
    page.evaluate("Ladder.alive")
    assert not page.locator(".ladder a").evaluate_all(script)
    assert page.locator(".ladder [aria-current]").evaluate_all(script)
