"""A drag updates a drawing in place: elements that stay are kept, and the result equals the frame's own markup."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from sitegen.assets.swatches import contrast
from tests.browser.conftest import Reader
from tests.browser.figure import Figure

KEPT = "([name, panel]) => (window.kept = [...Ladder.drawing(document.getElementById(name), panel).children]).length"
STAYED = "([name, panel]) => kept.every(e => e.parentNode === Ladder.drawing(document.getElementById(name), panel))"
SAME = """name => Ladder.figures.get(name).frame.panels.every(({ name: panel, svg }) => {
  const template = document.createElement("template");
  template.innerHTML = svg;
  return Ladder.drawing(document.getElementById(name), panel).outerHTML === template.innerHTML;
})"""


def test_a_drag_keeps_the_drawing_s_elements(reader: Callable[..., Reader]) -> None:
    """The first live frame replaces the build's; from then on none of the panel's elements is replaced."""
    solve = Figure(reader(reduced_motion="reduce").open("kabsch.html"), "fig-solve").live()
    before = solve.readout("rms")
    solve.drag("source", 40, 20)
    moved = solve.changes("rms", before)
    assert solve.page.evaluate(KEPT, [solve.name, "main"]) > 2
    solve.drag("source", 30, 30)
    solve.changes("rms", moved)
    assert solve.page.evaluate(STAYED, [solve.name, "main"])
    assert solve.page.evaluate(SAME, solve.name)


def test_what_does_not_belong_to_the_drawing_goes_with_the_next_frame(reader: Callable[..., Reader]) -> None:
    """With a pen's ink in it, for instance, the whole drawing is swapped."""
    solve = Figure(reader(reduced_motion="reduce").open("kabsch.html"), "fig-solve").live()
    before = solve.readout("rms")
    solve.drag("source", 40, 20)
    moved = solve.changes("rms", before)
    solve.page.evaluate(
        "name => { const svg = Ladder.drawing(document.getElementById(name), 'main');"
        "  svg.prepend(svg.firstElementChild.cloneNode()); }",
        solve.name,
    )
    assert not solve.page.evaluate(SAME, solve.name)
    solve.drag("source", 30, 30)
    solve.changes("rms", moved)
    assert solve.page.evaluate(SAME, solve.name)


def test_a_handle_moves_without_a_layout(reader: Callable[..., Reader]) -> None:
    """It is placed at the layer's corner and translated to the frame's place."""
    solve = Figure(reader(reduced_motion="reduce").open("kabsch.html"), "fig-solve").live()
    before = solve.readout("rms")
    solve.drag("source", 40, 20)
    solve.changes("rms", before)
    handle = solve.handle("source")
    assert handle.evaluate("e => [e.offsetLeft, e.offsetTop, e.style.left, e.style.top]") == [0, 0, "", ""]
    middle, box = handle.bounding_box(), solve.root.locator('[data-panel="main"] > svg').first.bounding_box()
    assert middle
    assert box
    (source_handle,) = (h for h in solve.frame()["handles"] if h["name"] == "source")
    assert abs(middle["x"] + middle["width"] / 2 - box["x"] - source_handle["left"] / 100 * box["width"]) < 0.5
    assert abs(middle["y"] + middle["height"] / 2 - box["y"] - source_handle["top"] / 100 * box["height"]) < 0.5


def test_marks_on_a_field_have_an_edge(reader: Callable[..., Reader]) -> None:
    """Including those of the animated group and of earlier clicks; orange on light purple has little contrast."""
    terrain = Figure(reader(color_scheme="dark", reduced_motion="reduce").open("landscape.html"), "fig-mmd").live()
    area = terrain.root.locator('[data-panel="map"] > svg').bounding_box()
    assert area
    for part in (0.3, 0.6):
        before = terrain.readout("reached")
        terrain.page.mouse.click(area["x"] + part * area["width"], area["y"] + part * area["height"])
        terrain.changes("reached", before)
    before = terrain.readout("reached")
    terrain.button("sow").click()
    terrain.changes("reached", before)
    marks = terrain.root.locator('[data-panel="map"] > svg').locator("path.source, .shape.truth").all()
    assert len(marks) > 50
    for mark in marks:
        assert mark.evaluate("e => [e, e.parentElement].some(each => getComputedStyle(each).filter !== 'none')")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_an_area_in_a_legend_has_an_outline_that_is_seen(reader: Callable[..., Reader], scheme: str) -> None:
    """Its fill alone is as faint as in the picture: the outline has a contrast of 3 with the page, as WCAG asks."""
    page = reader(color_scheme=scheme).open("search.html")
    styles = page.locator("#fig-turns .key.area").evaluate_all("""keys => keys.map(e => getComputedStyle(e, '::before'))
      .map(style => [style.borderTopWidth, style.opacity, style.borderTopColor])""")
    paper = _hex(page.evaluate("getComputedStyle(document.documentElement).backgroundColor"))
    assert len(styles) == 3
    assert {(width, opacity) for width, opacity, _ in styles} == {("1px", "1")}
    assert min(contrast(paper, _hex(colour)) for _, _, colour in styles) >= 3.0


def _hex(colour: str) -> str:
    """A computed rgb(…) as #rrggbb."""
    red, green, blue = re.findall(r"\d+", colour)[:3]
    return f"#{int(red):02x}{int(green):02x}{int(blue):02x}"


def test_a_label_of_fixed_width_has_the_width_of_its_letters(reader: Callable[..., Reader]) -> None:
    """Where nobody spaces letters it looks like the others; the panel's typeface is the one whose widths are known."""
    page = reader().open("index.html")
    Figure(page, "fig-which").seen()
    ratios = page.evaluate("""() => document.fonts.ready.then(() => [...document.querySelectorAll('text[textLength]')]
      .filter(each => each.checkVisibility()).map(each => {
        const free = each.cloneNode(true);
        free.removeAttribute('textLength');
        each.after(free);
        const ratio = free.getComputedTextLength() / each.getComputedTextLength();
        free.remove();
        return ratio;
      }))""")
    assert len(ratios) > 10
    assert ratios == pytest.approx([1.0] * len(ratios), abs=0.03)


LOOKS = """() => [...document.querySelectorAll('svg.panel :is(path, text)')].map(mark => {
  const { fill, stroke, fontSize } = getComputedStyle(mark);
  return mark.localName === 'path' ? ['path', fill, stroke !== 'none'] : ['text', parseFloat(fontSize) > 100, true];
})"""


def test_a_drawing_without_its_sheet_is_lines_and_numbers(reader: Callable[..., Reader]) -> None:
    """A reading view takes the drawing and leaves its style sheet: its lines are no black areas then, and its numbers
    are large enough. Where the sheet is, it draws as if the drawing said nothing."""
    visitor = reader(alone=True, java_script_enabled=False)
    visitor.expect("ERR_FAILED")
    page = visitor.page()
    page.route("**/*.css", lambda route: route.abort())
    page.goto(f"{visitor.origin}/icp.html")
    looks = {tuple(look) for look in page.evaluate(LOOKS)}
    assert looks == {("path", "none", True), ("text", True, True)}
    page = visitor.open("icp.html")
    inherits = """[...document.querySelectorAll('svg.panel')].every(drawing =>
      ['fill', 'stroke', 'stroke-width', 'stroke-linecap', 'font-size'].every(name =>
        getComputedStyle(drawing)[name] === getComputedStyle(drawing.parentNode)[name]))"""
    assert page.evaluate(inherits)
