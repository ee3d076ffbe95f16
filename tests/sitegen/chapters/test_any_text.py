"""Whatever an author types, the generator reports problems at existing places and never crashes."""

from __future__ import annotations

from hypothesis import example, given, settings
from hypothesis import strategies as st

from sitegen.chapters.content import Chapter
from sitegen.chapters.survey import survey
from sitegen.markup.parser import parse
from sitegen.markup.source import Source
from sitegen.problems import Problems
from tests.sitegen.conftest import TOY, TOY_PLOT

FRAGMENTS = [
    "::figure[",
    "::plot[",
    "{toy-plot id=p}",
    "::try[",
    "::aside[",
    ":claim[",
    ":value[",
    ":ref[",
    ":readout[",
    ":x[",
    "]",
    "{toy id=a}",
    "{",
    "}",
    "{a noise=2}",
    "$",
    "$$",
    "$$ (l)",
    "[@one]",
    "[@",
    "[^n]",
    "[^n]: ",
    "![",
    "](",
    ")",
    "# ",
    "## A {#b}",
    "`",
    "```",
    "| a | b |\n| - | - |\n| ",
    "> ",
    "- ",
    "    ",
    "\n",
    "\n\n",
    " ",
    "*",
    "word",
    "\\",
    '"',
    "é",
    "\t",
    "<b>",
    "\u2028",
]


@settings(max_examples=300, deadline=None)
@given(st.lists(st.sampled_from(FRAGMENTS), max_size=30).map("".join))
@example("\u2028\n{toy-plot id=p}::figure[")
def test_any_text_is_parsed(text: str) -> None:
    problems = Problems()
    source = Source("content/01-a.md", text, problems)
    chapter = Chapter(source, parse(source), "a", "a", "A", "1", "", "", (), False, None)
    survey(chapter, {"toy": TOY}, {"toy-plot": TOY_PLOT}, problems)
    lines = text.split("\n")
    for problem in problems.found:
        assert 1 <= problem.line <= len(lines), problem
        assert 1 <= problem.column <= len(lines[problem.line - 1]) + 1, problem
