"""A survey keeps its results to itself: the tokens stay as they were parsed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from markdown_it.token import Token

import sitegen
from sitegen.chapters.content import Chapter
from sitegen.chapters.survey import survey
from sitegen.chapters.surveyed import Survey
from sitegen.markup.directives import Directive
from sitegen.markup.located import Anchor, NoteMark, located
from sitegen.markup.parser import parse
from sitegen.markup.source import Source
from sitegen.problems import Problems
from tests.sitegen.conftest import TOY, TOY_PLOT

TEXT = """## One {#first}

Text[^n] with a mark again[^n].

[^n]: The note.

## One

$$
a = b
$$ (sum)

::figure[A toy.]{toy id=a}

::plot[A plot.]{toy-plot id=p}

::try[More noise]{a noise=2}

::figure[See :promise[here]{noise=2 expect="error rises"}.]{toy id=b}
"""


def chapter_of(text: str) -> Chapter:
    """A chapter with this text, on rung 1."""
    source = Source("content/01-a.md", text, Problems())
    return Chapter(source, parse(source), "a", "a", "A", "1", "", "", (), False)


def survey_of(chapter: Chapter, widgets: bool = True) -> tuple[Survey, Problems]:
    """Its survey, and the problems."""
    problems = Problems()
    return survey(chapter, {"toy": TOY} if widgets else {}, {"toy-plot": TOY_PLOT}, problems), problems


def of_type(chapter: Chapter, *types: str) -> list[Token]:
    """The tokens of these types, including those within lines of text."""
    tokens = [part for token in chapter.document.tokens for part in (token, *(token.children or []))]
    return [token for token in tokens if token.type in types]


def test_each_token_is_looked_up_in_the_survey() -> None:
    """Given only a token, the survey returns what it has become."""
    chapter = chapter_of(TEXT)
    result, _ = survey_of(chapter)
    assert [result.anchor(token) for token in of_type(chapter, "heading_open")] == ["first", "one"]
    assert [result.is_first(token) for token in of_type(chapter, "footnote_ref")] == [True, False]
    assert [result.number(token) for token in of_type(chapter, "math_block_label")] == ["1.1"]
    assert [result.figure(token) for token in of_type(chapter, "figure")] == list(result.figures.values())
    assert [result.plot(token) for token in of_type(chapter, "plot")] == list(result.plots.values())
    (button,) = map(result.button, of_type(chapter, "try"))
    assert button is not None
    assert button.figure is result.figures["a"]
    (promise,) = map(result.promise, of_type(chapter, "promise_open"))
    assert promise is not None
    assert promise.figure is result.figures["b"]
    assert result.promises == [promise]


def test_a_second_survey_of_the_same_tokens_knows_nothing_of_the_first() -> None:
    """Without the widget, nothing of its figures is left; with it again, the survey is as before."""
    chapter = chapter_of(TEXT)
    first, _ = survey_of(chapter)
    without, problems = survey_of(chapter, widgets=False)
    second, _ = survey_of(chapter)
    assert [problem.message for problem in problems.found] == ["unknown widget 'toy'; none are defined"] * 2
    assert without.tokens.figures == {}
    assert without.tokens.buttons == {}
    assert without.promises == []
    assert second.tokens == first.tokens


def test_two_equal_lines_are_two_tokens() -> None:
    """A result for one does not apply to the other."""
    chapter = chapter_of("::figure[A toy.]{toy id=a}\n\n" * 2)
    result, problems = survey_of(chapter)
    first, second = map(result.figure, of_type(chapter, "figure"))
    assert first is not None
    assert second is not None
    assert first.place.line < second.place.line
    assert ["duplicate" in problem.message for problem in problems.found] == [True]


@pytest.mark.parametrize("inside", ["::figure[A toy.]{toy id=a}", "::plot[A plot.]{toy-plot id=a}", "## A heading"])
def test_a_footnote_holds_nothing_that_is_numbered(inside: str) -> None:
    """This is reported once, at its place."""
    result, problems = survey_of(chapter_of(f"Text[^n].\n\n[^n]: A note.\n\n    {inside}\n"))
    assert [(problem.line, "not in a footnote" in problem.message) for problem in problems.found] == [(5, True)]
    assert result.figures == {}


def test_what_a_token_stands_for_is_asked_by_its_kind() -> None:
    """Asking for another kind is the caller's mistake."""
    (token,) = of_type(chapter_of("Text[^n].\n\n[^n]: A note.\n"), "footnote_ref")
    assert located(token, NoteMark).thing == NoteMark("n")
    assert located(token, object).place.column == 5
    for kind in (Directive, Anchor):
        with pytest.raises(TypeError, match=f"'footnote_ref' does not stand for a {kind.__name__}"):
            located(token, kind)


def test_nobody_else_touches_what_the_parser_notes() -> None:
    """A token's `meta` is read and written in one module only."""
    home = Path(sitegen.__file__).parent
    files = {path.relative_to(home).as_posix(): path.read_text("utf-8") for path in home.rglob("*.py")}
    assert [name for name, text in files.items() if re.search(r"\.meta\b", text) and "importlib" not in text] == [
        "markup/located.py"
    ]
