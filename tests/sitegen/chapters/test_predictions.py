"""Questions that a figure asks before it runs: the build finds the right answer, and refuses questions without one."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html import unescape
from typing import Any

import pytest

from tests.sitegen.conftest import TOY, Project, cache_without_drawings
from widgets.drawing.picture import Group, Label, Picture

FIGURE = "::figure[C]{toy id=demo}"
ASK = '::predict[How many? | One. | Two.]{demo press=go,go expect="presses < 2 | presses > 1"}'
pytestmark = pytest.mark.usefixtures("desk")


def question(project: Project, line: str) -> tuple[dict[str, Any], list[tuple[str, str]], str]:
    """The record that decides, each answer with whether it is right, and the HTML of the question's section."""
    project.chapter(f"\n{FIGURE}\n\n{line}\n")
    project.build()
    match = re.search(r'<div class="predict" .*?role="status"></p>\s*</div>', project.page("second.html"), re.DOTALL)
    assert match
    record = re.search(r"data-record='([^']*)'", match[0])
    assert record
    answers = re.findall(r'data-right="(\w+)"[^>]*>(.*?)</button>', match[0])
    return json.loads(unescape(record[1])), [(words, right) for right, words in answers], match[0]


def drawn_with(project: Project, mark: Any) -> None:
    """Make the small site's figure draw one more mark in its panel."""

    def draw(state: object) -> Picture:
        picture = TOY.draw(state)
        (panel,) = picture.panels
        return replace(picture, panels=(replace(panel, marks=(*panel.marks, mark)),))

    project.widgets["toy"] = replace(TOY, draw=draw)
    project.cache = cache_without_drawings(project.cache, project.root / "cache")


def test_the_run_decides_which_answer_is_right(project: Project) -> None:
    record, answers, section = question(project, ASK)
    assert record["log"] == [["press", "go"], ["press", "go"]]
    assert answers == [("One.", "no"), ("Two.", "yes")]
    assert " hidden>" in section.partition("\n")[0], "without scripts there is nothing to answer"
    (second,) = ((r, a) for r, a, _ in [question(project, ASK.replace("press=go,go", "press=go"))])
    assert second[1] == [("One.", "yes"), ("Two.", "no")]
    assert question(project, ASK.replace("? | One. | ", "?\n| One. |\n"))[1] == answers  # wrapped at its bars


def test_a_bar_in_emphasis_or_code_parts_nothing(project: Project) -> None:
    _, answers, section = question(project, ASK.replace("How many? | One.", "How *many | few*? | `1 | 1` *or | so*."))
    assert answers == [('<code translate="no">1 | 1</code> <em>or | so</em>.', "no"), ("Two.", "yes")]
    assert "How <em>many | few</em>?" in section


def test_what_decides_is_on_the_tape(project: Project) -> None:
    """Even if nothing else presses so often; the states that lead to it are there too."""
    record, _, _ = question(project, ASK.replace("go,go", "go*5").replace("presses > 1", "presses > 4"))
    (tape,) = (project.site / "tapes").glob("second-demo.*.js")
    states = re.findall(r'"log":(\[\]|\[\[.*?\]\])', tape.read_text("utf-8"))
    assert [json.loads(state) for state in states].count(record["log"]) == 1
    assert max(len(json.loads(state)) for state in states) == 5


def test_of_panels_the_one_is_right_whose_drawing_says_so(project: Project) -> None:
    ask = "::predict[Which one?]{demo press=go panels=main says=right}"
    project.chapter(f"\n{FIGURE}\n\n{ask}\n")
    assert project.problems() == ["content/01-second.md:10:1: this run of figure 'demo' makes no answer right"]
    drawn_with(project, Label((0.0, 0.0), "right", "truth"))
    assert project.problems() == ["content/01-second.md:10:1: this run of figure 'demo' makes every answer right"]


def test_panels_are_answers_by_the_first_line_of_their_captions(project: Project) -> None:
    """In the order of the line; one is right if the very word stands in it, not a part of a longer one."""

    def draw(state: object) -> Picture:
        picture = TOY.draw(state)
        (panel,) = picture.panels
        words = {"main": "all right", "second": "right", "third": "wrong"}
        panels = [
            replace(
                panel,
                name=name,
                label=f"The {name} panel",
                caption=f"<{name}>\nfurther words",
                marks=(*panel.marks, Label((0.0, 0.0), word, "truth")),
            )
            for name, word in words.items()
        ]
        return replace(picture, panels=tuple(panels))

    project.widgets["toy"] = replace(TOY, draw=draw)
    project.cache = cache_without_drawings(project.cache, project.root / "cache")
    _, answers, _ = question(project, "::predict[Which?]{demo press=go panels=third,second,main says=right}")
    assert answers == [("&lt;third&gt;", "no"), ("&lt;second&gt;", "yes"), ("&lt;main&gt;", "no")]


def test_a_ghost_is_of_a_source(project: Project) -> None:
    ask = "::predict[Where to?]{demo press=go within=0.5}"
    project.chapter(f"\n{FIGURE}\n\n{ask}\n")
    (problem,) = project.problems()
    assert problem == "content/01-second.md:10:1: toy draws no group 'source' in panel 'main'"
    drawn_with(project, Group("source", ()))
    _, answers, section = question(project, ask)
    assert answers == []
    assert 'data-within="0.5"' in section
    assert "Place a ghost" in section


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('::predict[Q | a | b]{demo press=go ¦expect="presses < 2"}', "answers: 2, expectations: 1; give at least two"),
        ('::predict[Q | a]{demo press=go ¦expect="presses < 2"}', "answers: 1, expectations: 1; give at least two"),
        (
            '¦::predict[Q | a | b]{demo press=go expect="presses < 9 | presses > 0"}',
            "this run of figure 'demo' makes every answer right",
        ),
        (
            '¦::predict[Q | a | b]{demo press=go expect="presses < 1 | presses > 1"}',
            "this run of figure 'demo' makes no answer right",
        ),
        ('::predict[Q | a | b]{demo expect="presses < 1 | ¦pressed > 1"}', "unknown readout 'pressed'; did you mean"),
        ('::predict[Q | a | b]{demo expect="presses < 1 | ¦so it is"}', "'so it is': expected NAME < 1.5"),
        ('::predict[Q | a | b]{demo press=¦og expect="presses < 1 | presses > 1"}', "toy has no button 'og' to press"),
        ("¦::predict[Q | a | b]{demo press=go}", "a prediction needs expect="),
        ("¦::predict[Q]{demo press=go panels=main}", "a prediction needs expect="),
        ("::predict[¦Q | a | b]{demo press=go within=0.5}", "answers after a | need expect="),
        ("::predict[Q]{demo press=go within=¦near}", "within: expected a positive distance in u, got 'near'"),
        ("::predict[Q]{demo press=go within=¦-1}", "within: expected a positive distance in u, got '-1'"),
        ("::predict[Q]{demo press=go within=¦0}", "within: expected a positive distance in u, got '0'"),
        ("¦::predict[Q]{demo press=go panels=man says=right}", "unknown panel 'man'; did you mean 'main'?"),
        ("::predict[Q]{¦demon press=go within=1}", "unknown figure 'demon' in this chapter; did you mean 'demo'?"),
        ("¦::predict[]{demo press=go within=1}", "::predict has no text"),
        (f"{ASK}\n\n¦{ASK}", "duplicate prediction: figure 'demo' already has one"),
    ],
)
def test_what_is_wrong_with_a_question(project: Project, line: str, message: str) -> None:
    before, _, _ = line.partition("¦")
    drawn_with(project, Group("source", ()))
    project.chapter(f"\n{FIGURE}\n\n{line.replace('¦', '')}\n")
    position = f"content/01-second.md:{10 + before.count(chr(10))}:{1 + len(before.rpartition(chr(10))[2])}"
    messages = project.problems()
    assert any(problem.startswith(f"{position}: {message}") for problem in messages), messages


def test_a_slide_asks_nothing(project: Project) -> None:
    front = 'title: T\nrung: "1"\nslug: second\nsummary: S\nslides:\n  - title: S\n    figure: demo\n    text: |\n'
    project.chapter(f"\n{FIGURE}\n", f"{front}      {ASK}")
    assert any("predictions belong in the chapter, with their figures" in problem for problem in project.problems())
    project.chapter(f"\n{FIGURE}\n\n{ASK}\n", f"{front}      Look.")
    project.build()
    assert 'class="predict"' in project.page("second.html")
    assert 'class="predict"' not in project.page("slides-second.html")


def test_a_notebook_asks_as_well(project: Project) -> None:
    project.chapter(f"\n{FIGURE}\n\n{ASK}\n")
    project.build()
    (notebook,) = (project.site / "notebooks").glob("second*.ipynb")
    assert "Before you run it: How many? · One. · Two." in notebook.read_text("utf-8")
