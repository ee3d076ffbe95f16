"""Authors' mistakes in a figure's module: each is reported at its place, once, with all other problems of the build.

A mark ¦ comes before the place that must be named.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import widgets.figures
from sitegen.figures.widget_faults import sound
from sitegen.problems import Problems
from tests.sitegen.conftest import START, Project
from widgets.engine import registry
from widgets.engine.host import Host
from widgets.engine.registry import WIDGETS

MODULE = '''\
"""A figure."""

from dataclasses import dataclass

from widgets.drawing.picture import Group, Handle, Label, Panel, Picture, Points, Readout, View, number
from widgets.engine.contract import Button, Key, Motion, Widget
from widgets.engine.controls import choice, slider


@dataclass(frozen=True)
class Controls:
    """Two controls."""

    scene: str = choice("clean", "Scene", {"clean": "Clean", "noisy": "Noisy"}, sets={"noisy": {"noise": 0.5}})
    noise: float = slider(0.1, "Noise", 0.0, 1.0, 0.05, "u")


def start(controls, seed):
    return controls, 0


def act(state, action):
    return state[0], state[1] + 1


def draw(state):
    controls, presses = state
    marks = (Points([[controls.noise, 0.5]], "source"),)
    readouts = (Readout("noise", "Noise", number(controls.noise), "u"),)
    panels = (Panel("main", "A point", View(0.0, 1.0, 0.0, 1.0), marks),)
    return Picture(panels, readouts, "A point.")


def motion(before, after):
    return None


def python(state):
    return "print(1)"


WIDGET = Widget(
    name="NAME",
    title="A figure",
    controls=Controls,
    presets={"default": {}, "noisy": {"scene": "noisy"}},
    start=start,
    act=act,
    draw=draw,
    buttons=(Button("go", "Go", primary=True), Button("run", "Run", "run", repeats="go")),
    legend=(Key("source", "a point"),),
    tape=(({"scene": "clean"}, ("go",)),),
    motion=motion,
    python=python,
)
'''

POINTS = 'Points([[controls.noise, 0.5]], "source")'
READOUT = 'number(controls.noise), "u"'
SCENE = 'scene: str = choice("clean", "Scene", {"clean": "Clean", "noisy": "Noisy"}, sets={"noisy": {"noise": 0.5}})'

# The text in the module, its replacement, and the message. Without a mark, the message is placed at the function.
MISTAKES = {
    "nan in a mark": (
        POINTS,
        'Points([[0.1, 0.5], [float("nan"), 0.5]], "source")',
        "draw: panel 'main', mark 1 (Points): xy: expected numbers, got (nan, 0.5) in row 1: omit points without",
    ),
    "nan in a group": (
        POINTS,
        'Group("all", (Points([[0.1, float("nan")]], "source"),))',
        "draw: panel 'main', mark 1 (Group 'all'), mark 1 (Points): xy: expected numbers, got (0.1, nan) in row 0",
    ),
    "a mark of no pairs": (
        POINTS,
        'Points([[0.1, 0.5, 0.2]], "source")',
        "draw: panel 'main', mark 1 (Points): xy: expected rows of two numbers, got [[0.1, 0.5, 0.2]]",
    ),
    "an unknown role": (
        POINTS,
        'Points([[0.1, 0.5]], "sorce")',
        "draw: panel 'main', mark 1 (Points): unknown role 'sorce'; did you mean 'source'?",
    ),
    "an unknown shape": (
        POINTS,
        'Points([[0.1, 0.5]], "source", "squire")',
        "draw: panel 'main', mark 1 (Points): unknown shape 'squire'; did you mean 'square'?",
    ),
    "a label of a number": (
        POINTS,
        "Label([0.1, 0.5], 3)",
        "draw: panel 'main', mark 1 (Label): text: expected text, got 3",
    ),
    "a mark that is none": (
        POINTS,
        '"o"',
        "draw: panel 'main', mark 1: expected a mark of widgets.drawing.picture, got 'o'",
    ),
    "a numeric readout": (
        READOUT,
        'controls.noise, "u"',
        "draw: readout 'noise': value: expected text, got 0.1: use number(value)",
    ),
    "a readout's role": (
        READOUT,
        f'{READOUT}, "targt"',
        "draw: readout 'noise': unknown role 'targt'; did you mean 'target'?",
    ),
    "a handle's name": (
        'readouts, "A point."',
        'readouts, "A point.", (Handle("grip", "Grip", (0.0, 0.0), "0", {}),)',
        "draw: handle 'grip': missing from the WIDGET's handles; none are defined",
    ),
    "what a handle sets": (
        'readouts, "A point."',
        'readouts, "A point.", (Handle("grip", "Grip", (0.0, 0.0), "0", {}, sets="noize"),)',
        "draw: handle 'grip': sets: unknown slider 'noize'; did you mean 'noise'?",
    ),
    "what is disabled": (
        'readouts, "A point."',
        'readouts, "A point.", disabled=frozenset({"gone"})',
        "draw: disabled: unknown button 'gone'; did you mean 'go'?",
    ),
    "no picture": ("return Picture(", "Picture(", "draw: expected a Picture, got None"),
    "drawing that fails": (
        "    panels = (",
        "    presses = ¦[][presses]\n    panels = (",
        "draw: IndexError: list index out of range",
    ),
    "a start that fails": ("    return controls, 0", "    return ¦controls.noize, 0", "start: AttributeError: "),
    "an action that fails": ("    return state[0], state[1] + 1", "    return ¦state[2]", "act: IndexError: "),
    "python that fails": ('    return "print(1)"', '    ¦raise KeyError("x")', "python: KeyError: 'x'"),
    "python that is no text": ('return "print(1)"', "return 1", "python: expected text, got 1"),
    "a motion of no panel": (
        "    return None",
        '    return Motion("all", 0.0, (0.0, 0.0), (0.0, 0.0), "mian")',
        "motion: unknown panel 'mian'; did you mean 'main'?",
    ),
    "its name": (
        'name="NAME"',
        'name=¦"nmae"',
        "name: expected 'NAME', the name of its module, got 'nmae'",
    ),
    "a default out of range": (
        "noise: float = slider(0.1",
        "¦noise: float = slider(1.1",
        "controls 'noise': invalid default: 1.1 lies outside 0 … 1",
    ),
    "a default that is no option": (
        'scene: str = choice("clean"',
        '¦scene: str = choice("clear"',
        "controls 'scene': invalid default: no option 'clear'; did you mean 'clean'?",
    ),
    "a control without a field": (
        'noise: float = slider(0.1, "Noise", 0.0, 1.0, 0.05, "u")',
        "¦noise: float = 0.1",
        "controls 'noise': expected slider(…), choice(…) or toggle(…)",
    ),
    "what an option sets": (
        SCENE,
        "¦" + SCENE.replace("0.5", "5"),
        "controls 'scene': option 'noisy' sets noise: 5 lies outside 0 … 1",
    ),
    "what names a slider": (
        'noise: float = slider(0.1, "Noise", 0.0, 1.0, 0.05, "u")',
        '¦noise: float = slider(0.1, "Noise", 0.0, 1.0, 0.05, "u", named=("scene", {"niosy": "Noise σ"}))',
        "controls 'noise': its label depends on scene: no option 'niosy'; did you mean 'noisy'?",
    ),
    "what brings a mark of the legend": (
        'Key("source", "a point")',
        'Key("source", ¦"a point", under=("scene", "niosy"))',
        "legend 'a point': under: scene: no option 'niosy'; did you mean 'noisy'?",
    ),
    "an option of an unused preset": (
        '"noisy": {"scene": "noisy"}',
        '¦"noisy": {"scene": "nosy"}',
        "presets 'noisy': scene: no option 'nosy'; did you mean 'noisy'?",
    ),
    "a control of an unused preset": (
        '"noisy": {"scene": "noisy"}',
        '¦"noisy": {"nose": 0.2}',
        "presets 'noisy': no control 'nose'; did you mean 'noise'?",
    ),
    "the legend's role": (
        'Key("source", "a point")',
        'Key("sorce", ¦"a point")',
        "legend 'a point': unknown role 'sorce'; did you mean 'source'?",
    ),
    "the legend's shape": (
        'Key("source", "a point")',
        'Key("source", ¦"a point", "dased")',
        "legend 'a point': unknown shape 'dased'; did you mean 'dashed'?",
    ),
    "controls that can change": (
        "@dataclass(frozen=True)\nclass Controls:",
        "@dataclass\n¦class Controls:",
        "controls: expected a frozen dataclass: write @dataclass(frozen=True)",
    ),
    "a button of the tape": (
        '(({"scene": "clean"}, ("go",)),)',
        '¦(({"scene": "clean"}, ("goo",)),)',
        "tape: entry 1: log: NAME has nothing to press called 'goo'; did you mean 'go'?",
    ),
    # Parentheses alone leave no trace in the syntax tree, so the place is that of what they enclose.
    "buttons without a comma": (
        'buttons=(Button("go", "Go", primary=True), Button("run", "Run", "run", repeats="go"))',
        'buttons=(¦Button("go", "Go", primary=True))',
        "buttons: expected a tuple, got Button(name='go', ",
    ),
    "a legend without a comma": (
        '(Key("source", "a point"),)',
        '(¦Key("source", "a point"))',
        "legend: expected a tuple, got Key(role='source', label='a point', ",
    ),
    "handles without a comma": (
        'legend=(Key("source", "a point"),)',
        'handles=(¦"grip")',
        "handles: expected a tuple, got 'grip'; one item needs a comma: (item,)",
    ),
    "a tape without a comma": (
        '(({"scene": "clean"}, ("go",)),)',
        '(¦({"scene": "clean"}, ("go",)))',
        "tape: entry 1: expected ({controls}, (presses,)), got {'scene': 'clean'}; one item needs a comma: (item,)",
    ),
    "presses without a comma": (
        '(({"scene": "clean"}, ("go",)),)',
        '¦(({"scene": "clean"}, ("go")),)',
        "tape: entry 1: expected ({controls}, (presses,)), got ({'scene': 'clean'}, 'go'); one item needs a comma",
    ),
    "what runs": (
        'Button("run", "Run", "run", repeats="go")',
        'Button(¦"run", "Run", "run", repeats="gone")',
        "buttons 'run': repeats: unknown button to press 'gone'; did you mean 'go'?",
    ),
    "a line that is no Python": (
        "    return controls, 0",
        "    return controls, 0¦)",
        " cannot be imported: unmatched ')'",
    ),
    "a name that is not there": (
        "from widgets.engine.controls import choice, slider\n",
        "¦from widgets.engine.controls import choice, slidr\n",
        " cannot be imported: ImportError: cannot import name 'slidr'",
    ),
    "a failure at import": (
        "WIDGET = ",
        "LIMIT = ¦1 / 0\nWIDGET = ",
        " cannot be imported: ZeroDivisionError: division by zero",
    ),
    "no widget": ("WIDGET = ", "WIGDET = ", " cannot be imported: AttributeError: missing WIDGET = Widget(…)"),
}

PLACED = """\
::figure[C]{NAME id=demo}

::try[T]{demo noise=0.3}

By :ref[fig:demo] the noise is :readout[demo noise]{noise=0.2}.
"""


@pytest.fixture
def module(project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str], None]:
    """Write a figure's module and have it found like those of the site; the first chapter refers to nothing."""
    folder = tmp_path / "widgets" / "figures"
    monkeypatch.setattr(widgets.figures, "__path__", [*widgets.figures.__path__, str(folder)])
    project.widgets = WIDGETS  # type: ignore[assignment]
    project.write("content/00-start.md", START.partition("Read")[0])

    def write(name: str, text: str) -> None:
        project.write(f"widgets/figures/{name.replace('-', '_')}.py", text.replace("NAME", name))
        monkeypatch.setattr(registry, "_NAMES", {name})
        monkeypatch.delitem(sys.modules, f"widgets.figures.{name.replace('-', '_')}", raising=False)

    return write


def with_place(name: str, source: str, message: str) -> tuple[str, str]:
    """The module's source, and the place to be reported: the mark's, a field's function's, or the first."""
    begins = source.index("¦") if "¦" in source else max(source.find(f"def {message.partition(':')[0]}("), 0)
    before = source[:begins]
    position = f"{before.count(chr(10)) + 1}:{len(before) - before.rfind(chr(10))}"
    return source.replace("¦", ""), f"widgets/figures/{name.replace('-', '_')}.py:{position}"


@pytest.mark.parametrize("case", MISTAKES)
def test_a_mistake_in_a_figure(project: Project, module: Callable[[str, str], None], case: str) -> None:
    """Reported once, at its place, with its figure, its field and what was expected, besides the chapter's own."""
    old, new, text = MISTAKES[case]
    name = "-".join(re.findall("[a-z]+", f"case {case}"))
    assert MODULE.count(old.replace("¦", "")) == 1
    source, position = with_place(name, MODULE.replace(old.replace("¦", ""), new), text)
    module(name, source)
    project.chapter(PLACED.replace("NAME", name) + "\nAnd [@on2001].\n")
    first, *result = project.problems()
    assert first.startswith("content/01-second.md:13:7: unknown reference 'on2001'")
    assert len(result) == 1, "\n".join(result)
    words = text.replace("NAME", name)
    assert result[0].startswith(f"{position}: figure {name}{'' if words[0] == ' ' else ', '}{words}"), result[0]
    if words.split(":")[0] in ("draw", "start", "act", "python", "motion"):
        assert "placed at content/01-second.md:7)" in result[0]


def test_a_sound_figure_has_no_faults(project: Project, module: Callable[[str, str], None]) -> None:
    module("case-sound", MODULE)
    project.chapter(PLACED.replace("NAME", "case-sound"))
    project.build(strict=True)
    assert '<span class="computed">0.20</span>' in project.page("second.html")


def test_a_strict_build_draws_what_no_chapter_shows(project: Project, module: Callable[[str, str], None]) -> None:
    """Every preset of every figure, also after each button; a build that is not strict does not draw them."""
    bad = '"sorce" if controls.scene == "noisy" and presses else "source"'
    source = MODULE.replace('Points([[controls.noise, 0.5]], "source")', f"Points([[controls.noise, 0.5]], {bad})")
    line = source[: source.index("def draw(")].count("\n") + 1
    module("case-unplaced", source)
    project.chapter("Text.\n")
    project.build()
    message = "figure case-unplaced, draw: panel 'main', mark 1 (Points): unknown role 'sorce'; did you mean 'source'?"
    start = f"widgets/figures/case_unplaced.py:{line}:1"
    assert project.problems(strict=True) == [f"{start}: {message} (preset noisy press=go; not placed in any chapter)"]
    project.chapter(PLACED.replace("NAME", "case-unplaced"))
    assert project.problems(strict=True) == [
        f"{start}: {message} (preset noisy press=go; placed at content/01-second.md:7)"
    ]


def test_what_a_strict_build_drew_is_not_drawn_again(
    project: Project, module: Callable[[str, str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    module("case-kept", MODULE)
    project.chapter("Text.\n")
    project.build(strict=True)
    requests: list[str] = []
    frame = Host.frame
    monkeypatch.setattr(Host, "frame", lambda host, request: requests.append(request) or frame(host, request))
    project.build(strict=True)
    assert requests == []


def test_a_slide_of_a_figure_that_fails_is_no_traceback(project: Project, module: Callable[[str, str], None]) -> None:
    """In a state that only a slide shows."""
    bad = 'float("nan") if controls.noise == 0.8 else controls.noise'
    module("case-slide", MODULE.replace("Points([[controls.noise, 0.5]]", f"Points([[{bad}, 0.5]]"))
    slide = "slides:\n  - title: A\n    figure: demo\n    set: noise=0.8"
    project.chapter(PLACED.replace("NAME", "case-slide"), f"title: T\nslug: second\nsummary: S\n{slide}")
    (result,) = project.problems()
    assert "figure case-slide, draw: panel 'main', mark 1 (Points): xy: expected numbers, got (nan, 0.5)" in result


def test_the_figures_of_the_site_are_sound() -> None:
    problems = Problems()
    assert sound(WIDGETS, problems).keys() == set(WIDGETS)
    assert problems.found == []
