"""LaTeX → MathML by Temml: all new formulas of a build in one call of Node, cached under a hash of their inputs.

A strict Content-Security-Policy blocks style attributes, so each distinct one becomes a class.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Mapping, Set
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from markdown_it.token import Token

from sitegen.cache.memo import Remembered
from sitegen.cache.memory import Memory
from sitegen.external import fetch, pins
from sitegen.external.node import run_node
from sitegen.problems import Place, Problems
from sitegen.progress import Progress, quiet

SCRIPT = Path(__file__).with_name("temml.mjs")
FORMAT = "1"  # of the entries; raised for a change that the hashed inputs do not show
SPARE = 2000  # how many formulas of earlier builds to keep: those of drafts come and go together
STYLE = re.compile(r'<(?P<tag>\w+)(?P<before>[^<>]*?) style="(?P<style>[^"]*)"(?P<after>[^<>]*)>')
COMBINING = "\u0332"  # Temml underlines the text that it rejects with these
SEEN_BY_CLASS = {"display:block math;"}  # implied by the class tml-display


@dataclass(frozen=True)
class Formula:
    """A formula as an author wrote it."""

    source: str
    display: bool


def formula_of(token: Token) -> Formula:
    """The formula of a token, inline or as an equation."""
    inline = token.type == "math_inline"
    return Formula(token.content if inline else token.content.strip(), not inline)


@dataclass(frozen=True)
class FormulaUse:
    """A use of a formula: `at` maps an offset in its source to a place."""

    formula: Formula
    at: Callable[[int], Place]


@dataclass(frozen=True)
class Mathematics:
    """MathML for each formula, and the CSS rules for the classes that replace style attributes."""

    mathml: Mapping[Formula, str]
    css: str


def render(
    uses: Iterable[FormulaUse],
    macros: Mapping[str, str],
    cache: Path,
    problems: Problems,
    progress: Progress = quiet,
    memory: Memory | None = None,
) -> Mathematics:
    """All formulas as MathML. Invalid LaTeX goes to `problems` and becomes empty; formulas that browsers would draw
    incompletely go to `problems` too."""
    all_uses = list(uses)
    formulas = {use.formula for use in all_uses}
    make = partial(_mathematics, formulas, macros, cache, progress)
    mathematics, faults = (memory or Memory()).answer("formulas", (formulas, macros), make)
    for use in all_uses:
        if "<menclose" in mathematics.mathml[use.formula]:
            problems.add(use.at(0), "formula: browsers do not draw <menclose>: avoid \\overline, \\boxed, \\cancel …")
        if fault := faults.get(use.formula):
            position = fault["position"]
            place = use.at(min(position, len(use.formula.source)) if isinstance(position, int) else 0)
            problems.add(place, f"formula: {_message(str(fault['message']))}")
    return mathematics


def _mathematics(
    formulas: Set[Formula], macros: Mapping[str, str], cache: Path, progress: Progress
) -> tuple[Mathematics, dict[Formula, Any]]:
    """All formulas, and Temml's errors for those that it cannot parse."""
    version = pins.read_manifest()["temml"].version
    made_by = _hash([FORMAT, version, SCRIPT.read_text("utf-8"), sorted(macros.items())])
    memo = Remembered(cache, f"maths {made_by}", SPARE)
    new = sorted((formula for formula in formulas if not memo.knows(_key(formula))), key=_key)
    fresh: dict[Formula, Any] = {}
    if new:
        module = fetch.gather(["temml"], cache=cache, progress=progress)["temml/dist/temml.mjs"]
        request = [{"source": f.source, "display": f.display} for f in new]
        answers = run_node(SCRIPT, {"module": str(module), "macros": dict(macros), "formulas": request}, timeout=120)
        fresh = dict(zip(new, answers, strict=True))
    order = sorted(formulas, key=_key)
    results = {formula: memo.answer(_key(formula), partial(fresh.get, formula)) for formula in order}
    memo.keep()
    styles: dict[str, str] = {}
    mathml = {formula: _with_classes(str(answer.get("mathml", "")), styles) for formula, answer in results.items()}
    css = "".join(f".{name}{{{style}}}\n" for style, name in sorted(styles.items()))
    return Mathematics(mathml, css), {formula: result for formula, result in results.items() if "mathml" not in result}


def _key(formula: Formula) -> str:
    return ("display " if formula.display else "inline ") + formula.source


def _hash(data: object) -> str:
    return hashlib.sha256(json.dumps(data).encode()).hexdigest()[:24]


def _message(message: str) -> str:
    """Temml's message without the excerpt that it appends, which our place makes redundant."""
    first = message.strip().split("\n")[0].replace(COMBINING, "")
    return re.sub(r",?\s*at (position \d+|end of input).*$", "", first).strip(" :")


def _with_classes(mathml: str, styles: dict[str, str]) -> str:
    """The MathML with classes instead of style attributes; `styles` collects style → class."""

    def swap(match: re.Match[str]) -> str:
        style, attributes = match["style"], match["before"] + match["after"]
        if style in SEEN_BY_CLASS:
            return f"<{match['tag']}{attributes}>"
        name = styles.setdefault(style, f"m{hashlib.sha256(style.encode()).hexdigest()[:6]}")
        if ' class="' in attributes:
            with_class = attributes.replace(' class="', f' class="{name} ', 1)
            return f"<{match['tag']}{with_class}>"
        return f'<{match["tag"]} class="{name}"{attributes}>'

    return STYLE.sub(swap, mathml)
