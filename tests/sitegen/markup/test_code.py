"""Highlighted code: its words have the classes that the style sheet colours, and no character is lost."""

from __future__ import annotations

import inspect
import re
from html import unescape
from pathlib import Path

import pytest

from sitegen.markup import code
from sitegen.markup.code import COLOURED, highlighted

SHEET = Path(__file__).resolve().parents[3] / "templates" / "assets" / "css" / "base" / "type.css"


def test_the_classes_are_those_that_the_style_sheet_colours() -> None:
    rules = re.findall(r":is\(([^)]*)\):where\(pre \*\)", SHEET.read_text("utf-8"))
    assert {name.strip().removeprefix(".") for rule in rules for name in rule.split(",")} == COLOURED


@pytest.mark.parametrize("language", ["python", "text", ""])
def test_the_code_is_there_to_the_letter(language: str) -> None:
    source = inspect.getsource(code) + "\n\nif a < b & c:\n    print('<i>')\n"
    html = highlighted(source, language)
    assert unescape(re.sub(r"</?span[^>]*>", "", html)) == source


def test_words_are_coloured_by_what_they_are() -> None:
    html = highlighted('def f(x):\n    return x + 1  # <one> more\n', "python")
    assert html == (
        '<span class="k">def</span> <span class="nf">f</span>(x):\n'
        '    <span class="k">return</span> x + <span class="mi">1</span>  <span class="c1"># &lt;one&gt; more</span>\n'
    )


def test_an_unknown_language_is_told_with_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"unknown language 'pyhton'; did you mean 'python'\?"):
        highlighted("print()", "pyhton")
