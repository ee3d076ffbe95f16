"""A reference to a figure in a state: its link holds the differences, wherever the figure is; mistakes are reported."""

from __future__ import annotations

import json
import re
from base64 import urlsafe_b64decode
from typing import Any

import pytest

from tests.sitegen.conftest import START, Project
from widgets.engine.contract import parsed

FIRST = START.partition("Read")[0].replace("---\n", "---\nslug: start\n", 1)
FIGURE = "\n::figure[A toy.]{toy id=demo noise=0.5}\n"

WRONG = {
    "a control": ("fig:demo]{¦nose=1}", "toy has no control 'nose'; did you mean 'noise'?"),
    "a value": ("fig:demo]{noise=¦3}", "noise: 3 lies outside 0 … 1"),
    "a button": ("fig:demo]{press=¦gone}", "toy has no button 'gone' to press; did you mean 'go'?"),
    "a button in quotes": ('fig:demo]{press="go,¦gone"}', "toy has no button 'gone' to press; did you mean 'go'?"),
    "a bare word": ("fig:demo]{¦noisy}", "expected name=value, got 'noisy'"),
    "a chapter": ("second]{¦noise=1}", "only a figure has a state: :ref[fig:id]{press=finish}"),
    "a figure that is none": ("¦fig:dmo]{noise=1}", "unknown figure 'dmo'; did you mean 'demo'?"),
}


def link(page: str) -> tuple[str, dict[str, Any]]:
    """The target and the decoded state of a page's only link to a state."""
    ((to, data),) = re.findall(r'href="([^"?]*)\?s=([\w-]+)"', page)
    return to, json.loads(urlsafe_b64decode(data + "=" * (-len(data) % 4)))


@pytest.fixture
def desk(project: Project) -> Project:
    """The small site with a figure on its second page."""
    project.write("content/00-start.md", FIRST + "Text.\n")
    project.write("content/01-second.md", f"---\ntitle: T\nslug: second\nsummary: S\n---\n{FIGURE}")
    return project


def test_a_link_opens_a_figure_of_another_page(desk: Project) -> None:
    """It holds the differences from the figure's opening state there, as a record that Python reads."""
    desk.write("content/00-start.md", FIRST + "See :ref[fig:demo]{noise=0.25 seed=53 press=go*2}.\n")
    desk.build()
    to, text = link(desk.page("index.html"))
    assert to == "second.html#fig-demo"
    assert text == {"widget": "toy", "controls": {"noise": 0.25}, "seed": 53, "log": [["press", "go"], ["press", "go"]]}
    record = parsed(desk.widgets["toy"], text)
    assert (record.controls.noise, record.seed, len(record.log)) == (0.25, 53, 2)


def test_a_link_opens_a_figure_of_its_own_page(desk: Project) -> None:
    desk.write("content/01-second.md", f"---\ntitle: T\nslug: second\nsummary: S\n---\n{FIGURE}\n"
               "See :ref[fig:demo]{scene=noisy press=go} and :ref[fig:demo].\n")  # fmt: skip
    desk.build()
    to, text = link(desk.page("second.html"))
    assert to == "#fig-demo"
    assert text["controls"] == {"scene": "noisy", "noise": 0.9}  # with the value that the scene brings
    assert 'href="#fig-demo">' in desk.page("second.html")


def test_of_figures_of_one_name_a_page_s_own_is_opened(desk: Project) -> None:
    """With the differences from its own opening state, not from that of the other page's."""
    desk.write("content/00-start.md", FIRST + FIGURE.replace("0.5", "0.25"))
    desk.write("content/01-second.md", f"---\ntitle: T\nslug: second\nsummary: S\n---\n{FIGURE}\n"
               "See :ref[fig:demo]{noise=0.25}.\n")  # fmt: skip
    desk.build()
    to, text = link(desk.page("second.html"))
    assert (to, text["controls"]) == ("#fig-demo", {"noise": 0.25})


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_told_at_its_place(desk: Project, name: str) -> None:
    value, words = WRONG[name]
    text = f"{FIRST}See :ref[{value}.\n"
    before = text.partition("¦")[0]
    desk.write("content/00-start.md", text.replace("¦", ""))
    (message,) = desk.problems()
    line, column = 1 + before.count("\n"), len(before) - before.rfind("\n")
    assert message.startswith(f"content/00-start.md:{line}:{column}: ")
    assert words in message
