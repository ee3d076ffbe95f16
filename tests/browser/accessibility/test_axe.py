"""Accessibility: what axe-core finds on every page, names and roles, the order of focus, and on a wide screen, which
parts lead and whether they fit. Every page is visited once, with one test per rule; tests/browser/pages/test_static.py
covers room and touch on a phone."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.base import AXE_SCRIPT
from playwright.sync_api import Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, figures
from tests.browser.layout import CUT, DETAILS, SIDEWAYS, SMALL_TEXT, STOPS, count_figures, low, remaining
from tests.browser.visits import QUIET, Found

SCREENS = ((1280, 800), (1440, 900))
PERCENTS = (100, 130)
BLOCKS = f"""root => {{
  const stops = ({STOPS})().filter(e => root.contains(e));
  const blocks = [...new Set(stops.map(e => {{ while (e.parentElement !== root) e = e.parentElement; return e; }}))];
  return blocks.map(e => [e.className || e.tagName, Math.round(e.getBoundingClientRect().top)]);
}}"""
UNFOLD = "() => document.querySelectorAll('details.figure-rest').forEach((each) => (each.open = true))"
DRAWN = "([id, frames]) => +document.getElementById(id).dataset.frame > frames"
HEADINGS = "() => [...document.querySelectorAll('h1, h2, h3, h4, h5, h6')].map(e => Number(e.tagName[1]))"
LANDMARKS = """() => ['header.site-header', 'nav', 'main', 'footer.site-footer']
  .map(s => document.querySelectorAll(s).length)"""
# Links to a figure count as one target, whatever state they open it in.
LINKS = """() => [...document.querySelectorAll('main a[href]')].map(a =>
  [(a.getAttribute('aria-label') ?? a.textContent).trim().replace(/\\s+/g, ' '),
   a.getAttribute('href').replace(/[?]s=.*/, '')])"""
# Whether each slider of a picture is a handle, its label and its value in words; how many handles the frames have.
SLIDERS = """() => [...document.querySelectorAll('.handle:not(.copy), .crosshair:not([hidden])')].map(e =>
  [e.matches('.handle'), e.getAttribute('aria-label'), e.getAttribute('aria-valuetext')])"""
HANDLES = """async () => {
  const ids = [...document.querySelectorAll('figure.figure')].map(e => e.id);
  if (ids.length) await Ladder.alive;
  return ids.flatMap(id => Ladder.figures.get(id).frame.handles).length;
}"""


def accessible(page: Page) -> list[dict[str, Any]]:
    """Chromium's accessibility tree, without the nodes that it ignores."""
    session = page.context.new_cdp_session(page)
    session.send("Accessibility.enable")
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    return [node for node in nodes if not node["ignored"]]


def role(node: dict[str, Any]) -> str:
    return str(node.get("role", {}).get("value", ""))


def name(node: dict[str, Any]) -> str:
    return str(node.get("name", {}).get("value", ""))


# Colours that have been parsed are cached: for each text, axe parses the colours of everything under it anew.
COLOURS = """(() => {
  const colour = axe.commons.color.Color.prototype, read = colour.parseString, known = new Map();
  colour.parseString = function (text) {
    if (known.has(text)) {
      [this.r, this.g, this.b, this.alpha] = known.get(text);
      return this;
    }
    read.call(this, text);
    known.set(text, [this.r, this.g, this.b, this.alpha]);
    return this;
  };
})();"""
# Passes are not collected, and style sheets, which contain no video, are not fetched again.
QUICK = {"resultTypes": ["violations"], "preload": False}
VIOLATIONS = """({ within, ...options }) => axe.run(within ? { include: window[within] } : document, options)
  .then(({ violations }) => violations.flatMap(({ id, nodes }) =>
    nodes.map(({ target }) => `${id}: ${JSON.stringify(target)}`)))"""
# Three texts of each look: its colour, size and weight, and what lies behind it, which is the looks of everything
# around it. Contrast depends on nothing else; what is placed over other parts may have anything behind it, and is all
# taken.
LOOKS = """() => {
  const known = new Map(), looks = new Map(), firsts = new Map(), placed = [];
  const look = (e) => {
    if (!e || known.has(e)) return known.get(e) ?? ["", false];
    const [around, above] = look(e.parentElement), s = getComputedStyle(e);
    const own = [s.color, s.backgroundColor, s.backgroundImage, s.opacity, s.fontSize, s.fontWeight, s.textShadow,
      s.filter, s.mixBlendMode];
    const words = JSON.stringify([around, ...own]);
    if (!looks.has(words)) looks.set(words, looks.size);
    known.set(e, [looks.get(words), above || /absolute|fixed|sticky/.test(s.position)]);
    return known.get(e);
  };
  for (const e of document.querySelectorAll("body *")) {
    if (![...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim()) || !e.checkVisibility()) continue;
    if (e.closest(":disabled, [aria-disabled=true]")) continue; // not measured
    const [which, above] = look(e);
    if (above) placed.push(e);
    else firsts.set(which, [...(firsts.get(which) ?? []), e].slice(0, 3));
  }
  window.looks = [...firsts.values(), placed].flat();
  return window.looks.length;
}"""
CONTRAST = {"runOnly": {"type": "rule", "values": ["color-contrast"]}}


def violations(page: Page, prefix: str, **options: Any) -> Iterator[str]:
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE_SCRIPT)
        page.evaluate(COLOURS)
    yield from (f"{prefix}: {fault}" for fault in page.evaluate(VIOLATIONS, {**QUICK, **options}))


def all_violations(page: Page, prefix: str) -> Iterator[str]:
    """The same for a page whose texts are many, as the reference's: contrast, which takes longest, once per look."""
    yield from violations(page, prefix, rules={"color-contrast": {"enabled": False}})
    assert page.evaluate(LOOKS) > 0
    yield from violations(page, prefix, within="looks", **CONTRAST)


def press_main_button(figure: Figure) -> None:
    """Press it if the figure has one; return once the last picture is drawn."""
    button = figure.seen().root.locator(".buttons .primary")
    if button.count():
        before = figure.frames()
        button.first.click()
        figure.page.wait_for_function(DRAWN, arg=[figure.name, before])
        figure.settled()


@pytest.fixture(scope="module")
def wide(visit: Callable[..., Found], site: Path, alike: list[str]) -> Found:
    """The faults of pages on a wide screen, by rule."""
    titles: set[str] = set()

    def leads(page: Page, path: str, width: int, height: int, percent: int) -> Iterator[str]:
        question = ("asked",) if percent == PERCENTS[0] else ()
        count, wrong = low(page, ("stage", "button", "controls", "readouts", *question), width, height, percent)
        yield from wrong if not path.startswith("docs-") else []
        if count != count_figures(site, path):
            yield f"{count} of {count_figures(site, path)} figures"

    def names(page: Page, path: str) -> Iterator[str]:
        page.set_viewport_size({"width": 1280, "height": 1000})
        assert page.title() not in titles
        titles.add(page.title())
        check_names(page, path)
        if path != "404.html":
            check_focus(page, path)
        check_tree(page, path)
        yield from ()

    def overflows(page: Page, _path: str) -> Iterator[str]:
        for figure in figures(page):
            figure.live()
        for width in (768, 1280):
            page.set_viewport_size({"width": width, "height": 1000})
            yield from (f"at {width}: {fault}" for fault in remaining(page, SIDEWAYS, SMALL_TEXT, CUT))

    def axe(page: Page, path: str) -> Iterator[str]:
        if path in alike:
            return
        for figure in figures(page):
            press_main_button(figure)
        for figure in figures(page)[:1]:
            figure.reached("[data-pin]").click()
            expect(figure.root.locator(".runs table")).to_be_visible()
        page.evaluate(DETAILS)
        yield from all_violations(page, "wide and light")
        page.set_viewport_size({"width": 390, "height": 1000})
        page.emulate_media(color_scheme="dark")
        yield from all_violations(page, "narrow and dark")

    looks = [(*screen, percent) for screen in SCREENS for percent in PERCENTS]
    checks = {
        **{f"{look}": lambda page, path, look=look: leads(page, path, *look) for look in looks},
        "named": names,
        "overflows": overflows,
        "axe": axe,
    }
    return visit(checks, color_scheme="light", reduced_motion="reduce")


def test_axe_finds_nothing_on_any_page(wide: Found) -> None:
    """At both widths, one in the light theme and one in the dark, with figures after their main button, words open and
    a run pinned."""
    assert wide["axe"] == []


def test_one_pale_text_among_many_is_found(reader: Callable[..., Reader]) -> None:
    """Though contrast is not measured on every text."""
    page = reader(color_scheme="light").open("docs-commands.html")
    assert list(all_violations(page, "as it is")) == []
    page.evaluate("document.querySelectorAll('main p')[7].style.color = '#bbb'")
    faults = list(all_violations(page, "one paler"))
    assert faults
    assert all("color-contrast" in fault for fault in faults)


def test_names_roles_and_order_on_every_page(wide: Found) -> None:
    """Landmarks, headings, titles and links; what a screen reader gets from every figure; focus in visual order."""
    assert wide["named"] == []


@pytest.mark.parametrize("percent", PERCENTS)
@pytest.mark.parametrize(("width", "height"), SCREENS)
def test_what_leads_fits_one_screen(wide: Found, width: int, height: int, percent: int) -> None:
    """The sentence, pictures, main button, controls and readouts of every figure fit on one screen."""
    assert wide[f"{(width, height, percent)}"] == []


def test_nothing_overflows_a_wide_page(wide: Found) -> None:
    """No page scrolls sideways, has tiny text or cuts off a label, on a tablet either."""
    assert wide["overflows"] == []


def test_the_browser_complains_of_no_page(wide: Found) -> None:
    """No error, no warning, no request to another origin."""
    assert wide[QUIET] == []


def check_names(page: Page, path: str) -> None:
    """Language, headings, landmarks; links say where they lead, and equal words lead to the same place."""
    assert page.evaluate("document.documentElement.lang") == "en"
    levels = page.evaluate(HEADINGS)
    assert levels.count(1) == 1, path
    assert levels[0] == 1
    assert all(b <= a + 1 for a, b in pairwise(levels)), f"{path}: {levels}"
    header, navs, main, footer = page.evaluate(LANDMARKS)
    alone = path == "404.html"  # it has no site frame: nothing to skip, and one link
    assert (header, main, footer) == ((0, 1, 0) if alone else (1, 1, 1))
    assert navs >= (not alone)
    leads: dict[str, set[str]] = {}
    for text, href in page.evaluate(LINKS):
        assert len(text) > 1 or text.isdigit(), f"{path}: a link to {href} says {text!r}"
        leads.setdefault(text, set()).add(href)
    assert {text: hrefs for text, hrefs in leads.items() if len(hrefs) > 1} == {}, path


def check_focus(page: Page, path: str) -> None:
    """The skip link comes first, shows on focus and leads past the ladder; in a figure the focus moves down."""
    page.keyboard.press("Tab")
    skip = page.locator(".skip")
    expect(skip).to_be_focused()
    assert skip.evaluate("e => e.getBoundingClientRect().top >= 0 && e.getBoundingClientRect().height >= 43.5")
    assert page.locator(skip.get_attribute("href") or "").evaluate("e => e.localName") == "main"
    for figure in figures(page):
        tops = figure.root.evaluate(BLOCKS)
        assert [top for _, top in tops] == sorted(top for _, top in tops), f"{path}#{figure.name}: {tops}"


def check_tree(page: Page, path: str) -> None:
    """Pictures say what they show; handles and crosshairs are sliders with a value in words; everything has a name."""
    page.evaluate(UNFOLD)
    page.wait_for_function("!document.querySelector('.figure-handles > .crosshair[data-away]:not([hidden])')")
    tree = accessible(page)
    for node in tree:
        if role(node) in ("button", "link", "slider", "switch", "radio", "image", "figure"):
            assert name(node).strip(), f"{path}: {node}"
    labels = page.locator("svg.panel:not([aria-hidden] *), .plot [role=img], img").evaluate_all(
        "all => all.filter(e => e.checkVisibility()).map(e => e.alt ?? e.getAttribute('aria-label'))"
    )
    pictures = [name(node) for node in tree if role(node) == "image"]
    assert sorted(pictures) == sorted(labels), path
    assert all(len(label.split()) > 1 for label in labels), f"{path}: {labels}"
    sliders = page.evaluate(SLIDERS)
    assert sum(handle for handle, *_ in sliders) == page.evaluate(HANDLES), path
    for _, label, value in sliders:
        assert [n for n in tree if role(n) == "slider" and name(n) == label], f"{path}: {label}"
        assert any(c.isdigit() for c in value or ""), f"{path}: {label}"
    assert not [n for n in tree if role(n) == "status" and name(n)], "nothing is said where nothing was asked"
