"""Fields in the browser: coarse at once, finer while no other request is made, the same bytes at every level."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import expect

from sitegen.assets.swatches import contrast
from sitegen.assets.tokens import colours
from sitegen.bench.pages import until
from tests.browser.conftest import Reader
from tests.browser.figure import Figure
from widgets.engine.contract import preset
from widgets.engine.host import Host
from widgets.figures.ndt_score import WIDGET

# The frames shown from now on: the level and rotation of each.
WATCH = """name => { window.levels = [];
  Ladder.figures.get(name).on("frame", frame => levels.push([frame.detail, frame.controls.rotation])); }"""
LEVELS = list(range(WIDGET.details))


@pytest.fixture
def score(reader: Callable[..., Reader]) -> Figure:
    figure = Figure(reader(reduced_motion="reduce").open("ndt-score.html"), "fig-score").live()
    figure.page.evaluate(WATCH, "fig-score")
    return figure


def levels(score: Figure) -> list[list[float]]:
    return score.page.evaluate("levels.splice(0)")  # type: ignore[no-any-return]


def test_a_moved_control_shows_the_coarse_map_and_then_each_finer_one(score: Figure) -> None:
    """Every level once, in order; the final picture is the build's own drawing of the record."""
    score.set("rotation", "7")
    score.settled()
    assert [level for level, _ in levels(score)] == LEVELS
    native = Host().render("fig-score", score.record())
    assert score.frame() == native
    html = score.page.evaluate("name => document.querySelector(`#${name} svg.panel`).outerHTML", "fig-score")
    assert html.count("<path") == native["panels"][0]["svg"].count("<path")


def test_levels_are_the_build_s_byte_for_byte(score: Figure) -> None:
    """Each level of each preset, requested in a fresh state, is the native frame of that level."""
    for name in WIDGET.presets:
        for level in LEVELS:
            record = {**preset(WIDGET, name).plain(), "seed": 53 + level}
            request: dict[str, Any] = {"figure": "fig-x", "record": record, "detail": level}
            live = score.page.evaluate("request => Ladder.runtime.frame(request)", request)
            assert live == Host().render("fig-x", record, level), (name, level)


def test_a_new_input_goes_before_what_is_left_to_refine(score: Figure) -> None:
    """A control moved at the first finer drawing: no more of the old map comes, and the new one is completed."""
    score.page.evaluate(
        """name => {
          const figure = Ladder.figures.get(name);
          const slider = figure.root.querySelector("[name=rotation]");
          const move = (to) => {
            slider.value = to;
            slider.dispatchEvent(new Event("input", {bubbles: true}));
          };
          const off = figure.on("frame", (frame) => {
            if (frame.detail !== 1) return;
            off();
            move(9);
          });
          move(8);
        }""",
        "fig-score",
    )
    score.settled()
    pairs = levels(score)
    assert [level for level, rotation in pairs if rotation == 8] == [0, 1]
    assert [level for level, rotation in pairs if rotation == 9] == LEVELS


# Finer drawings are held until `arrive()`; other requests are answered as usual.
HELD = """() => {
  const { runtime } = Ladder, { frame } = runtime;
  window.late = [];
  window.arrive = () => late.splice(0).forEach(go => go());
  runtime.frame = (question) => frame.call(runtime, question).then((found) =>
    question.finer ? new Promise(go => late.push(() => go(found))) : found);
}"""


def test_a_finer_drawing_that_comes_too_late_is_dropped(score: Figure) -> None:
    """If the control moves while a finer drawing is on its way, the old map does not replace the new one."""
    score.set("rotation", "7")  # drawing off screen, before the first touch, is over
    score.settled()
    levels(score)
    score.page.evaluate(HELD)
    for value in ("8", "9"):
        score.set("rotation", value)
        until(score.page, f"late.length && levels.some(([, rotation]) => rotation === {value})")
    until(score.page, "late.length >= 2")
    score.page.evaluate("arrive()")
    until(score.page, "late.length")  # the new value's next finer one, requested since the one before was shown
    assert levels(score) == [[0, 8], [0, 9], [1, 9]]
    assert score.frame()["controls"]["rotation"] == 9


FINEST = f"(arrive(), Ladder.figures.get('fig-score').frame.detail === {LEVELS[-1]})"


def moved_while_finer_drawings_are_held(score: Figure) -> None:
    """Its map is the coarsest, and the next finer one is on its way."""
    score.set("rotation", "7")
    score.settled()
    score.page.evaluate(HELD)
    score.set("rotation", "8")
    until(score.page, "late.length > 0")
    assert score.frame()["detail"] == 0


def test_a_finer_drawing_leaves_an_error_in_place(score: Figure) -> None:
    """It answers no question, so it does not take back what was said of a link that was followed meanwhile."""
    moved_while_finer_drawings_are_held(score)
    score.page.evaluate("location.hash = 'fig-score?s=xx'")
    score.becomes("failed")
    until(score.page, FINEST)
    score.becomes("failed")
    expect(score.root.locator(".status-words")).to_contain_text("it is damaged")


@pytest.mark.parametrize(
    ("question", "state"),
    [
        ("ask(Ladder.record.press(figure.record, 'climb')); figure.leave()", "live"),
        ("ask({...figure.record, seed: -1})", "failed"),
    ],
    ids=["given up", "refused"],
)
def test_a_question_without_an_answer_does_not_leave_the_map_coarse(score: Figure, question: str, state: str) -> None:
    """It interrupted the finer drawings of the map that stays, so they are asked for again."""
    moved_while_finer_drawings_are_held(score)
    score.page.evaluate(f"(figure => {{ figure.{question}; }})(Ladder.figures.get('fig-score'))")
    until(score.page, FINEST)
    score.becomes(state)
    assert score.record()["controls"]["rotation"] == 8


def test_a_climb_on_a_known_field_does_not_make_it_coarse(score: Figure) -> None:
    """With the field complete, a click is answered only at the finest level."""
    score.set("rotation", "5")
    score.settled()
    levels(score)
    box = score.seen().root.locator('.figure-panel[data-panel="map"] svg').bounding_box()
    assert box
    score.page.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 0.4 * box["height"])
    score.settled()
    assert [level for level, _ in levels(score)] == LEVELS[-1:]
    assert score.record()["log"][0][:2] == ["click", "map"]


def test_the_tape_has_the_finest_level(reader: Callable[..., Reader]) -> None:
    """The page shows the full map before any script, and so does a press before Python is up."""
    figure = Figure(reader().open("ndt-score.html"), "fig-score")
    assert figure.frame()["detail"] == LEVELS[-1]
    details = figure.page.evaluate(
        "[...document.querySelectorAll('script.figure-record')].map(s => JSON.parse(s.textContent).frame.detail)"
    )
    assert details == [LEVELS[-1]]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_keyboard_s_crosshair_stands_out_of_any_field(reader: Callable[..., Reader], theme: str) -> None:
    """Its lines, and beside them what parts them from the field, whose colours come close to theirs."""
    page = reader(reduced_motion="reduce", color_scheme=theme).open("ndt-score.html")
    score = Figure(page, "fig-score").live()
    crosshair = score.root.locator(".crosshair").first
    crosshair.focus()
    page.keyboard.press("ArrowLeft")
    score.settled()
    image = Image.open(io.BytesIO(crosshair.screenshot())).convert("RGB")
    pixels = [image.getpixel((x, image.height // 5)) for x in range(image.width)]
    row = ["#" + bytes(pixel).hex() for pixel in pixels]  # type: ignore[arg-type]
    middle = row.index(colours()["accent"][theme == "dark"])
    sides = row[middle - 4 : middle], row[middle + 1 : middle + 5]
    assert min(max(contrast(row[middle], colour) for colour in side) for side in sides) >= 3


def test_every_line_of_a_climb_has_an_edge_on_the_field(score: Figure) -> None:
    """Accepted steps and rejected tries alike: no one colour stands out of every shade."""
    score.button("climb").click()
    score.settled()
    filters = score.root.locator("svg .heat ~ .line:is(.source, .outlier)").evaluate_all(
        "all => Object.fromEntries(all.map((e) => [e.classList[1], getComputedStyle(e).filter]))"
    )
    assert {"source", "outlier"} <= set(filters)
    assert "none" not in filters.values()
