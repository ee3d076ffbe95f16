"""Formulas as MathML: spaced as in print, styled by classes, remembered, and with faults at their places."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from sitegen.markup import math
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


def rendered(cache: Path, *formulas: Formula, macros: dict[str, str] | None = None) -> math.Mathematics:
    problems = Problems()
    uses = [FormulaUse(formula, lambda at: Place("x.md", 1, at)) for formula in formulas]
    mathematics = render(uses, macros or {}, cache, problems)
    assert not problems.found
    return mathematics


def test_styles_are_classes_with_a_rule_each(cache: Path) -> None:
    """Of equal styles one, beside the classes that an element has by itself; none for what a class of Temml's says."""
    matrix = Formula(r"\begin{pmatrix} a \\ b \end{pmatrix}", True)
    lines = Formula(r"\begin{aligned} a &= b \end{aligned}", True)
    tagged = Formula(r"\tag{3} x", True)
    mathematics = rendered(cache, matrix, lines, tagged, Formula(r"\hat x", False))
    whole = "".join(mathematics.mathml.values())
    assert ' style=' not in whole
    assert 'class="tml-display"' in mathematics.mathml[matrix]
    used = re.findall(r"(?<=[\" ])m[0-9a-f]{6}(?=[\" ])", whole)
    rules = dict(re.findall(r"\.(m[0-9a-f]{6})\{(.*)\}", mathematics.css))
    assert set(rules) == set(used)
    assert len(mathematics.css.splitlines()) == len(rules) == len(set(rules.values())) < len(used)
    assert "display" not in mathematics.css
    (cell,) = set(re.findall(r'<mtd class="(m\w{6})"', mathematics.mathml[matrix]))
    assert f'<mtd class="{cell} tml-right">' in mathematics.mathml[lines]
    assert re.search('<mtable class="m[^ ]{6}" displaystyle="true">', mathematics.mathml[tagged])


def test_a_formula_is_put_to_temml_once(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Until a macro changes. In a line and as an equation, one source is two formulas."""
    asked: list[list[tuple[str, bool]]] = []
    run = math.run_node

    def noted(script: Path, request: Any, timeout: float) -> Any:
        asked.append([(f["source"], f["display"]) for f in request["formulas"]])
        return run(script, request, timeout=timeout)

    monkeypatch.setattr(math, "run_node", noted)
    inline, display, other = Formula(r"\mine + 1", False), Formula(r"\mine + 1", True), Formula(r"\mine + 2", False)
    one = rendered(cache, inline, display, macros={r"\mine": "a"})
    assert rendered(cache, inline, display, macros={r"\mine": "a"}) == one
    assert one.mathml[inline] != one.mathml[display]
    rendered(cache, other, inline, macros={r"\mine": "a"})
    again = rendered(cache, inline, macros={r"\mine": "b"})
    assert "<mi>b</mi>" in again.mathml[inline]
    assert [sorted(formulas) for formulas in asked] == [
        [(inline.source, False), (inline.source, True)],
        [(other.source, False)],
        [(inline.source, False)],
    ]


@pytest.mark.parametrize(
    ("source", "offset", "message"),
    [
        (r"a + \undefined b", 4, r"Unsupported function name: \undefined"),
        (r"\frac{1}{", 9, "Unexpected end of input in a macro argument, expected '}'"),
        ("a_b_c", 3, "Double subscript"),
        (r"\overline{a}", 0, r"browsers do not draw <menclose>: avoid \overline, \boxed, \cancel …"),
    ],
)
def test_a_fault_is_told_where_it_is_without_its_surroundings(
    source: str, offset: int, message: str, cache: Path
) -> None:
    problems = Problems()
    render([FormulaUse(Formula(source, False), lambda at: Place("x.md", 1, at))], {}, cache, problems)
    assert [str(problem) for problem in problems.found] == [f"x.md:1:{offset}: formula: {message}"]
