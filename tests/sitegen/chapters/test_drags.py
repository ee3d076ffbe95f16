"""Drags in a chapter: a promise, a button, a readout and a slide can each move a handle, as a reader would."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.sitegen.conftest import START, TOY, Project
from widgets.drawing.picture import Handle, Picture
from widgets.engine.contract import Action, Widget


def act(state: object, action: Action) -> object:
    """A drag of the point changes its noise; a press counts as usual."""
    if action.kind != "drag":
        return TOY.act(state, action)
    return replace(state, controls=replace(state.controls, noise=action.x - action.y))  # type: ignore[attr-defined]


def draw(state: object) -> Picture:
    return replace(TOY.draw(state), handles=(Handle("point", "Move", (0.5, 0.5), "x", {}),))


DRAGGED: Widget = replace(TOY, act=act, draw=draw, handles=("point", "turn"))


@pytest.fixture
def desk(project: Project) -> Project:
    """The small site, with a figure that has handles and a first chapter that refers to no other."""
    project.write("content/00-start.md", START.partition("Read")[0])
    project.widgets["toy"] = DRAGGED
    return project


def test_a_drag_is_replayed_everywhere(desk: Project) -> None:
    """In a caption, in text, by a button, in a readout and on a slide; presses named after a drag follow it."""
    expect = 'expect="noise is 0.75; presses is 1"'
    slide = "slides:\n  - title: S\n    figure: demo\n    set: press=go drag=\"point 1 0.5\"\n    text: T\n"
    desk.chapter(
        f'\n::figure[:promise[C]{{drag="point 1 0.25" press=go {expect}}}]{{toy id=demo}}\n\n'
        f'It is :readout[demo noise]{{drag="point 0.9 0.5, point 0.5 -0.35"}}.\n\n'
        f'::try[B]{{demo drag="turn 0.1 0, point 0.5 -0.25" then=go {expect}}}\n',
        f'title: T\nrung: "1"\nslug: second\nsummary: S\n{slide}',
    )
    desk.build()
    page = desk.page("second.html")
    assert ">0.85<" in page
    assert '"log":[["drag","turn",0.1,0.0],["drag","point",0.5,-0.25]]}' in page
    assert '"log":[["press","go"],["drag","point",1.0,0.5]]' in desk.page("slides-second.html")


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ('drag="¦pont 1 2"', "toy has no handle 'pont' to drag; did you mean 'point'?"),
        ('drag="point 1 2, ¦trun 0 1"', "toy has no handle 'trun' to drag; did you mean 'turn'?"),
        ("drag=¦point", "'point': expected a handle and where to put it, in u"),
        ('drag="¦point 1"', "'point 1': expected a handle"),
        ('drag="point 1 2,¦"', "toy has no handle '' to drag; known: point, turn"),
        ('drag="turn 1 2, ¦point 1 2 3"', "'point 1 2 3': expected a handle"),
        ('drag="¦point 1 two"', "'point 1 two': expected a handle"),
        ('drag="¦point 1 nan"', "'point 1 nan': expected a handle"),
        ('drag="¦point 1 2e6"', "'point 1 2e6': expected a handle"),
        ('¦drg="point 1 2"', "toy has no control 'drg'; did you mean 'drag'?"),
    ],
)
def test_what_is_wrong_with_a_drag(desk: Project, attributes: str, message: str) -> None:
    """Each mistake is reported once, at the drag itself."""
    button = f"::try[A]{{demo {attributes}}}"
    desk.chapter(f"\n::figure[C]{{toy id=demo}}\n\n{button.replace('¦', '')}\n")
    (problem,) = desk.problems()
    position, words = problem.split(": ", 1)
    assert position == f"content/01-second.md:10:{button.index('¦') + 1}"
    assert words.startswith(message)


def test_a_figure_without_handles_takes_no_drag(desk: Project) -> None:
    desk.widgets["toy"] = TOY
    desk.chapter('\n::figure[:promise[C]{drag="point 1 2" expect="noise > 0"}]{toy id=demo}\n')
    (problem,) = desk.problems()
    assert problem.endswith("toy has no handle 'point' to drag; none are defined")
