"""Formulas as MathML: spaced as in print."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sitegen.markup.math import Formula, FormulaUse, render
from sitegen.problems import Place, Problems

THIN = '<mspace width="0.1667em"></mspace>'


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (r"p_1, \dots, p_m", "p1,…,pm"),
        (r"x_1 + \cdots + x_m", "x1+⋯+xm"),
        (r"\exp", "exp"),
        (r"A \operatorname{Ad}", "A|Ad"),
        (r"\sqrt2 \, \sin x", "2|sin|x"),
        (r"r_i \, \sin x", "ri|sin|x"),
        (r"a \, b", "a|b"),
    ],
)
def test_dots_and_functions_are_spaced_as_in_print(source: str, expected: str, cache: Path) -> None:
    """A thin space, |, comes before and after a function unless nothing is there; dots are not operators."""
    formula, problems = Formula(source, display=False), Problems()
    mathml = render([FormulaUse(formula, lambda at: Place("x.md", 1, at))], {}, cache, problems).mathml[formula]
    assert not problems.found
    assert not re.search("<mo[^>]*>[…⋯]", mathml)
    assert re.sub("<[^>]*>|\u2061", "", mathml.replace(THIN, "|")) == expected
