"""What a reader can export: the picture as SVG and PNG, pinned runs as CSV; and how a page prints."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest
from PIL import Image
from playwright.sync_api import Locator, Page, expect

from tests.browser.conftest import Reader
from tests.browser.figure import Figure, link_of

SVG = "{http://www.w3.org/2000/svg}"


def save(page: Page, button: Locator, to: Path) -> Path:
    with page.expect_download() as coming:
        button.click()
    path = to / coming.value.suggested_filename
    coming.value.save_as(path)
    return path


@pytest.mark.parametrize(
    ("name", "figure"), [("kabsch", "fig-solve"), ("ndt-score", "fig-score"), ("race", "fig-curves")]
)
def test_a_picture_stands_alone(reader: Callable[..., Reader], tmp_path: Path, name: str, figure: str) -> None:
    """The SVG refers to nothing outside; its colours are the light theme's; the PNG shows the same picture."""
    page = reader(color_scheme="dark").open(f"{name}.html")
    root = page.locator(f"#{figure}")
    root.locator(".figure-more summary").click()
    drawing = save(page, root.locator('[data-picture="svg"]'), tmp_path)
    bitmap = save(page, root.locator('[data-picture="png"]'), tmp_path)
    assert [drawing.name, bitmap.name] == [f"{name}-{figure}.svg", f"{name}-{figure}.png"]
    tree = ElementTree.fromstring(drawing.read_text("utf-8"))
    nodes = list(tree.iter())
    assert not [node for node in nodes if "class" in node.attrib or "style" in node.attrib]
    values = [value for node in nodes for value in node.attrib.values()]
    assert not [value for value in values if "var(" in value or "light-dark" in value or "NaN" in value]
    assert tree.findtext(f"{SVG}desc")
    assert sum(node.tag == f"{SVG}path" for node in nodes) > 4
    style = tree.findtext(f"{SVG}style") or ""
    assert "data:font/woff2;base64," in style
    assert "http" not in style
    tab = page.context.new_page()
    tab.set_viewport_size({"width": int(tree.attrib["width"]), "height": int(tree.attrib["height"])})
    tab.goto(drawing.as_uri())
    shot = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
    picture = Image.open(bitmap).convert("RGB")
    assert picture.size == (2 * shot.width, 2 * shot.height)
    assert picture.getpixel((2, 2)) == (255, 255, 255)
    histogram = Image.composite(shot, picture.resize(shot.size), Image.new("L", shot.size, 128)).histogram()
    assert sum(histogram[:3]) < 0.2 * shot.width * shot.height  # without the dark page's background
    used = {colour for _, colour in picture.getcolors(picture.width * picture.height) or []}
    assert len(used) > 20


def test_a_picture_that_cannot_be_made_says_so(reader: Callable[..., Reader]) -> None:
    """A canvas that is too large yields no image; the next success removes the message."""
    page = reader(accept_downloads=True).open("kabsch.html")
    root = page.locator("#fig-solve")
    root.locator(".figure-more summary").click()
    png, report = root.locator('[data-picture="png"]'), root.locator(".figure-take [role=status]")
    page.evaluate("""() => {
        const { toBlob } = HTMLCanvasElement.prototype;
        HTMLCanvasElement.prototype.toBlob = function (heard) {
            HTMLCanvasElement.prototype.toBlob = toBlob;
            heard(null);
        };
    }""")
    png.click()
    expect(report).to_have_text("No PNG can be made: too large for an image. Save it as SVG.")
    with page.expect_download():
        png.click()
    expect(report).to_have_text("")


def test_pinned_runs_are_saved_as_csv(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """Every control, the seed and the readouts, as numbers that a spreadsheet can read."""
    solve = Figure(reader(reduced_motion="reduce").open("kabsch.html"), "fig-solve").live()
    solve.reached("[data-pin]").click()
    before = solve.readout("rms")
    solve.button("solve").click()
    after = solve.changes("rms", before)
    solve.reached("[data-pin]").click()
    path = save(solve.page, solve.root.locator('.runs [data-do="Save"]'), tmp_path)
    assert path.name == "kabsch-fig-solve-runs.csv"
    rows = list(csv.DictReader(path.read_text("utf-8").splitlines()))
    assert [row["Actions"] for row in rows] == ["0", "1"]
    [rms] = [name for name in rows[0] if name == "RMS residual now (u)"]
    assert [float(row[rms]) for row in rows] == [float(before), float(after)]


def test_what_is_sound_of_a_link_is_taken(reader: Callable[..., Reader]) -> None:
    """A value out of range, an unknown control, an invalid seed and unknown actions are left out, and named."""
    visitor = reader(reduced_motion="reduce")
    record = {
        "widget": "kabsch",
        "controls": {"noise": 0.3, "wrong": 99, "<img src=x onerror=alert(1)>": 1},
        "seed": -1,
        "log": [["press", "solve"], ["press", "<b>no such button</b>"], ["press", "solve"]],
    }
    solve = Figure(visitor.open(f"kabsch.html#fig-solve?s={link_of(record)}"), "fig-solve").live()
    note = solve.root.locator(".figure-status")
    expect(note).to_contain_text("Ignored in the state")
    for part in ("wrong", "“<img src=x onerror=alert(1)>”"[:31], "the seed", "action 2"):
        expect(note).to_contain_text(part, ignore_case=True)
    solve.settled()
    assert solve.record()["controls"]["noise"] == 0.3
    assert solve.record()["controls"]["wrong"] != 99
    assert solve.record()["log"] == [["press", "solve"]]
    assert solve.page.locator("main img[src=x]").count() == 0


def test_a_chapter_prints_with_its_figures_as_they_are(reader: Callable[..., Reader]) -> None:
    """On paper, each figure's picture is as it was left, in light colours, complete, and without buttons."""
    visitor = reader(color_scheme="dark", reduced_motion="reduce")
    page = visitor.open("race.html")
    page.emulate_media(media="print")
    assert page.locator("figure button:not([data-sort]):visible").count() == 0
    page = visitor.open("kabsch.html")
    solve = Figure(page, "fig-solve").live()
    before = solve.readout("rms")
    solve.button("solve").click()
    after = solve.changes("rms", before)
    page.emulate_media(media="print")
    assert page.locator("button:not(.try):visible, input:visible, .ladder:visible").count() == 0
    assert solve.readout("rms") == after
    panels = page.locator("figure .figure-panel:not(.figure-rest *) > svg")  # pictures behind More stay there
    assert panels.count() >= 3
    for panel in panels.all():
        box = panel.bounding_box()
        assert box is not None
        assert box["width"] > 100
        assert box["height"] > 60
        assert panel.evaluate("node => getComputedStyle(node).backgroundColor") == "rgb(243, 243, 239)"
    assert page.pdf().startswith(b"%PDF")


def test_a_picture_from_a_slide_has_the_captions_that_are_seen(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """All of them inside the picture; beside the notes they shrink with it."""
    page = reader(1280, 720, reduced_motion="reduce").open("slides-race.html#3")
    root = page.locator("#fig-race")
    sizes = []
    for name in ("alone", "beside the notes"):
        root.locator(".figure-more").evaluate("details => { details.open = true; }")
        with page.expect_download() as coming:
            root.locator('[data-picture="svg"]').evaluate("button => button.click()")
        path = tmp_path / name
        coming.value.save_as(path)
        tree = ElementTree.fromstring(path.read_text("utf-8"))
        texts = tree.findall(f"{SVG}text")
        assert texts
        assert all(0 < float(text.attrib["x"]) < float(tree.attrib["width"]) for text in texts)
        sizes.append(float(texts[0].attrib["font-size"]))
        page.keyboard.press("n")
    assert sizes[1] == pytest.approx(0.72 * sizes[0])


def test_a_picture_taken_in_motion_is_that_of_the_numbers(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """They are those of the motion's end, and so is the picture."""
    page = reader(reduced_motion="no-preference").open("icp.html")
    nearest = Figure(page, "fig-nearest").live().settled()
    nearest.root.locator(".figure-more summary").click()
    page.evaluate("Ladder.limits.motion = 1e9")
    nearest.button("step").click()
    expect(nearest.root.locator("svg.moving")).to_have_count(1)
    button = nearest.root.locator('[data-picture="svg"]')
    first = save(page, button, tmp_path).read_text("utf-8")
    nearest.settled()
    assert save(page, button, tmp_path).read_text("utf-8") == first
    assert "<g transform" not in first


# Of each drawing that is seen: its panel, and how wide its lines and how long their dashes are on the screen, px.
SEEN = """root => [...root.querySelectorAll('.figure-panel > svg')].filter(svg => svg.checkVisibility()).map(svg => {
  const unit = svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
  const styles = [...svg.querySelectorAll('path')].map(path => getComputedStyle(path));
  return styles.filter(({ stroke }) => stroke !== 'none').map(({ strokeWidth, strokeDasharray, vectorEffect }) => {
    const lengths = [strokeWidth, ...(strokeDasharray === 'none' ? [] : strokeDasharray.split(','))];
    return lengths.map(length => (vectorEffect === 'non-scaling-stroke' ? 1 : unit) * parseFloat(length));
  });
})"""


def test_a_picture_has_every_drawing_that_is_seen_with_its_lines(reader: Callable[..., Reader], tmp_path: Path) -> None:
    """The charts too, and what is behind More once that is open; lines and dashes are as wide and long as on screen."""
    page = reader(color_scheme="light", reduced_motion="reduce").open("icp.html")
    nearest = Figure(page, "fig-nearest").seen()
    nearest.root.locator(".figure-more summary").click()
    counts = []
    for _ in range(2):
        seen = nearest.root.evaluate(SEEN)
        path = save(page, nearest.root.locator('[data-picture="svg"]'), tmp_path)
        drawings = ElementTree.fromstring(path.read_text("utf-8")).findall(f"{SVG}svg")
        counts.append(len(drawings))
        assert len(drawings) == len(seen)
        for drawing, lines in zip(drawings, seen, strict=True):
            scale = float(drawing.attrib["width"]) / float(drawing.attrib["viewBox"].split()[2])
            stroked = [path for path in drawing.iter(f"{SVG}path") if path.get("stroke", "none") != "none"]
            assert len(stroked) == len(lines)
            for taken, line in zip(stroked, lines, strict=True):
                lengths = [taken.attrib["stroke-width"], *taken.get("stroke-dasharray", "").split()]
                numbers = [scale * float(length.rstrip(",")) for length in lengths]
                assert numbers == pytest.approx(line, abs=0.03)
        nearest.root.locator("details.figure-rest > summary").click()
    assert counts[1] > counts[0] > 0
