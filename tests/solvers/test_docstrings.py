"""The prose of numpydoc docstrings is at most 88 columns wide; a summary is one line, as wide as code. Items of lists
and references go on indented."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

import solvers

# Their files are read; the page has bytecode only.
pytestmark = pytest.mark.native

ROOT = Path(solvers.__file__).parent
WIDE = {"core/pose.py", "uncertainty/region.py"}
"""Files of one class each, too near to 400 lines for their docstrings to be narrower."""
PATHS = [path for path in sorted(ROOT.rglob("*.py")) if path.relative_to(ROOT).as_posix() not in WIDE]
ITEM = re.compile(r" *(- |\.\. \[)")
SECTION = re.compile(r"^ *(Parameters|Attributes|Returns|Raises|References|Examples)\n *-+$", re.MULTILINE)


def docstrings(source: str) -> Iterator[tuple[int, list[str]]]:
    """The numpydoc docstrings of a source, each as the number of its first line and its lines as written."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            first = node.body[0]
            text = lines[first.lineno - 1 : first.end_lineno]
            if SECTION.search("\n".join(text)):
                yield first.lineno, text


def too_wide(source: str) -> Iterator[int]:
    """The numbers of the lines of prose beyond 88 columns. One-line summaries, examples and formulas, which are
    indented by four, are as wide as code."""
    for first, lines in docstrings(source):
        section, is_code, margin = "", False, len(lines[0]) - len(lines[0].lstrip())
        for number, line in enumerate(lines, start=first):
            if SECTION.match("\n".join(lines[number - first : number - first + 2])):
                section = line.strip()
            is_code = bool(line.strip()) and (is_code or line.lstrip().startswith(">>>"))
            has_fields = section in ("Parameters", "Attributes", "Returns", "Raises")
            is_formula = line.startswith(" " * (margin + (8 if has_fields else 4)))
            is_summary = number == first and not lines[1].strip()
            if len(line) > 88 and not (is_summary or is_code or is_formula):
                yield number


def loose(source: str) -> Iterator[int]:
    """The numbers of lines that go on from a list's item or a reference without being indented more."""
    for first, lines in docstrings(source):
        for number, (item, line) in enumerate(pairwise(lines), start=first + 1):
            margin = len(item) - len(item.lstrip())
            goes_on = bool(line.strip(' "')) and not ITEM.match(line)
            if ITEM.match(item) and goes_on and not line.startswith(" " * (margin + 1)):
                yield number


def test_prose_is_told_from_summaries_examples_and_formulas() -> None:
    wide = "x " * 44 + "x"
    for summary, rows in ((wide, [3, 9]), (f"{wide}\n{wide}", [1, 2, 4, 10])):
        source = f'"""{summary}\n\n{wide}\n\n    {wide}\n\nExamples\n--------\n{wide}\n\n>>> {wide}\n{wide}\n"""\n'
        assert list(too_wide(source)) == rows


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_the_prose_of_docstrings_is_at_most_88_columns_wide(path: Path) -> None:
    assert not list(too_wide(path.read_text("utf-8"))), f"lines of {path} are wider"


def test_a_line_that_leaves_its_item_is_found() -> None:
    source = '"""Summary.\n\n- one\n  goes on\n- two\nleaves\n\nReferences\n----------\n.. [1] A paper,\n1999.\n"""\n'
    assert list(loose(source)) == [6, 11]


@pytest.mark.parametrize("path", sorted(ROOT.rglob("*.py")), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_items_and_references_go_on_indented(path: Path) -> None:
    assert not list(loose(path.read_text("utf-8"))), f"lines of {path} stand below their item's margin"
