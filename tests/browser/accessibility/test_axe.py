"""For everyone: what axe-core sees of every page, names and roles, the order of the focus, room and touch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import figures
from tests.browser.layout import BEYOND, SMALL, STOPS, remaining

# Some of the many checks stand for all.
OPEN = "[...document.querySelectorAll('details')].slice(0, 9).forEach(each => { each.open = true; })"
BLOCKS = f"""root => {{
  const stops = ({STOPS})().filter(e => root.contains(e));
  const blocks = [...new Set(stops.map(e => {{ while (e.parentElement !== root) e = e.parentElement; return e; }}))];
  return blocks.map(e => [e.className || e.tagName, Math.round(e.getBoundingClientRect().top)]);
}}"""
HEADINGS = "() => [...document.querySelectorAll('h1, h2, h3, h4, h5, h6')].map(e => Number(e.tagName[1]))"
LANDMARKS = """() => ['header.site-header', 'nav', 'main', 'footer.site-footer']
  .map(s => document.querySelectorAll(s).length)"""
# A figure is one place, in whichever state a reference opens it.
LINKS = """() => [...document.querySelectorAll('main a[href]')].map(a =>
  [(a.getAttribute('aria-label') ?? a.textContent).trim().replace(/\\s+/g, ' '),
   a.getAttribute('href').replace(/[?]s=.*/, '')])"""


def accessible(page: Page) -> list[dict[str, Any]]:
    """Chromium's accessibility tree, what is left out of it left out."""
    session = page.context.new_cdp_session(page)
    session.send("Accessibility.enable")
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    return [node for node in nodes if not node["ignored"]]


def role(node: dict[str, Any]) -> str:
    return str(node.get("role", {}).get("value", ""))


def name(node: dict[str, Any]) -> str:
    return str(node.get("name", {}).get("value", ""))


# What passes is not gathered, and style sheets, which hold no video, are not fetched once more.
QUICK = {"resultTypes": ["violations"], "preload": False}


def violations(page: Page, where: str, **options: Any) -> Iterator[str]:
    for found in Axe().run(page, options={**QUICK, **options}).response["violations"]:
        for node in found["nodes"]:
            yield f"{where}: {found['id']}: {node['target']}"


def test_axe_finds_nothing_on_any_page(reader: Callable[..., Reader], pages: list[str]) -> None:
    """At both widths, with a figure alive, its words open and a run pinned; colours once more in the other theme."""
    one = reader(1280, color_scheme="light", reduced_motion="reduce")
    found: list[str] = []
    alike = [path for path in pages if path.startswith("checks-")]  # of one template, with other words
    for path in (path for path in pages if path not in alike[1:]):
        page = one.open(path)
        for figure in figures(page)[:1]:
            figure.live()
            figure.reached("[data-pin]").click()
            expect(figure.root.locator(".runs table")).to_be_visible()
        page.evaluate(OPEN)
        found += violations(page, path)
        page.set_viewport_size({"width": 390, "height": 1000})
        found += violations(page, f"{path}, narrow")
        page.emulate_media(color_scheme="dark")
        found += violations(page, f"{path}, dark", runOnly={"type": "rule", "values": ["color-contrast"]})
        page.close()
    assert not found, "\n".join(found)


def test_names_roles_and_order_on_every_page(reader: Callable[..., Reader], pages: list[str]) -> None:
    """Landmarks, headings, titles and links; what a screen reader gets of every figure; the focus follows the eye."""
    one = reader(reduced_motion="reduce")
    titles: set[str] = set()
    for path in pages:
        page = one.open(path)
        assert page.title() not in titles
        titles.add(page.title())
        assert page.evaluate("document.documentElement.lang") == "en"
        levels = page.evaluate(HEADINGS)
        assert levels.count(1) == 1, path
        assert levels[0] == 1
        assert all(b <= a + 1 for a, b in pairwise(levels)), f"{path}: {levels}"
        header, navs, main, footer = page.evaluate(LANDMARKS)
        alone = path == "404.html"  # it stands without the site's frame: nothing to pass over, one link
        assert (header, main, footer) == ((0, 1, 0) if alone else (1, 1, 1))
        assert navs >= (not alone)
        leads: dict[str, set[str]] = {}
        for text, href in page.evaluate(LINKS):
            assert len(text) > 1 or text.isdigit(), f"{path}: a link to {href} says {text!r}"
            leads.setdefault(text, set()).add(href)
        assert {text: hrefs for text, hrefs in leads.items() if len(hrefs) > 1} == {}, path
        if not alone:
            check_focus(page, path)
        check_tree(page, path)
        page.close()


def check_focus(page: Page, path: str) -> None:
    """The skip link comes first, is then seen and leads past the ladder; in a figure what stands lower comes later."""
    page.keyboard.press("Tab")
    skip = page.locator(".skip")
    expect(skip).to_be_focused()
    assert skip.evaluate("e => e.getBoundingClientRect().top >= 0 && e.getBoundingClientRect().height >= 43.5")
    assert page.locator(skip.get_attribute("href") or "").evaluate("e => e.localName") == "main"
    for figure in figures(page):
        tops = figure.root.evaluate(BLOCKS)
        assert [top for _, top in tops] == sorted(top for _, top in tops), f"{path}#{figure.name}: {tops}"


def check_tree(page: Page, path: str) -> None:
    """Pictures say what they show; handles and crosshairs are sliders with a value in words; nothing is nameless."""
    page.evaluate("document.querySelectorAll('details.figure-rest').forEach((each) => (each.open = true))")
    page.wait_for_function("!document.querySelector('.figure-handles > .crosshair[data-away]:not([hidden])')")
    tree = accessible(page)
    for node in tree:
        if role(node) in ("button", "link", "slider", "switch", "radio", "image", "figure"):
            assert name(node).strip(), f"{path}: {node}"
    drawn = page.locator("svg.plot:not([aria-hidden] *), .graph [role=img], img").evaluate_all(
        "all => all.filter(e => e.checkVisibility()).map(e => e.alt ?? e.getAttribute('aria-label'))"
    )
    pictures = [name(node) for node in tree if role(node) == "image"]
    assert sorted(pictures) == sorted(drawn), path
    assert all(len(label.split()) > 1 for label in drawn), f"{path}: {drawn}"
    sliders = page.locator(".handle:not(.copy), .crosshair:not([hidden])")
    wanted = [figure.name for figure in figures(page) for _ in figure.frame()["handles"]]
    assert sliders.and_(page.locator(".handle")).count() == len(wanted), path
    for slider in sliders.all():
        label = slider.get_attribute("aria-label")
        assert [n for n in tree if role(n) == "slider" and name(n) == label], f"{path}: {label}"
        assert any(c.isdigit() for c in slider.get_attribute("aria-valuetext") or ""), f"{path}: {label}"
    assert not [n for n in tree if role(n) == "status" and name(n)], "nothing is said where nothing was asked"


def test_room_and_touch_on_every_page(reader: Callable[..., Reader], pages: list[str]) -> None:
    """At 390 px every target is at least 44 px; at 320 px, which is 400 % of 1280, and with text at twice its size
    nothing reaches beyond the screen, the details open."""
    one = reader(390, 844, has_touch=True, reduced_motion="reduce")
    for path in pages:
        page = one.open(path)
        page.evaluate(OPEN)
        assert remaining(page, SMALL) == [], path
        page.set_viewport_size({"width": 320, "height": 640})
        assert remaining(page, BEYOND) == [], f"{path} at 320 px"
        page.set_viewport_size({"width": 640, "height": 900})
        page.evaluate("() => { document.documentElement.style.fontSize = '200%'; }")
        assert remaining(page, BEYOND) == [], f"{path} with large text"
        page.close()


def test_every_stop_of_the_keyboard_is_seen(reader: Callable[..., Reader]) -> None:
    """Tab goes through a whole page, each stop shows that it has the focus, in both themes, and none is passed by."""
    for scheme in ("light", "dark"):
        page = reader(color_scheme=scheme, reduced_motion="reduce").open("kabsch.html")
        stops = page.evaluate(f"() => ({STOPS})().length")
        unseen, met = [], 0
        page.keyboard.press("Tab")
        while page.evaluate("document.activeElement !== document.body") and met <= stops:
            seen, what, in_card = page.evaluate(SHOWN)
            met += not in_card  # a card is a stop more, if the eye rests long enough on its link for it to open
            if not seen:
                unseen.append(what)
            page.keyboard.press("Tab")
        assert unseen == [], scheme
        radios = page.evaluate(RADIOS)
        assert met == stops - radios, "all radio buttons of one choice are one stop"
        knob = page.locator("#fig-solve input[type=range]").first
        before = knob.screenshot()
        knob.focus()
        assert knob.screenshot() != before, scheme


# An outline of the element, of what is drawn for it or of the label around it; a slider's knob cannot be asked.
SHOWN = """() => {
  const e = document.activeElement;
  const rims = [[e], [e, '::before'], [e.closest('label')]].filter(([x]) => x);
  const style = rims.map(([x, part]) => getComputedStyle(x, part))
    .map(s => [s.outlineStyle, parseFloat(s.outlineWidth)]);
  const seen = e.matches('.crosshair') ? getComputedStyle(e).opacity === '1'
    : e.matches('input[type=range]') || style.some(([line, width]) => line !== 'none' && width >= 2);
  return [seen, e.outerHTML.slice(0, 90), e.closest('.card') !== null];
}"""
RADIOS = """() => { const sets = [...document.querySelectorAll('.options')].filter(e => e.checkVisibility());
  return sets.reduce((sum, e) => sum + e.querySelectorAll('input').length - 1, 0); }"""
