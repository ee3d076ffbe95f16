"""Numbers in the text from calls such as `solvers.consensus.trials(0.5, 0.99, 2)`, evaluated by the build and cached.

`plots.trial_budget.needed(0.5)` calls a function of a plot's module with the plot's result as an implicit first
argument. Arithmetic such as `0.12 / sqrt(13)` is evaluated directly, alone or as an argument.
"""

from __future__ import annotations

import ast
import importlib
import math
import operator
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from sitegen.cache.memo import Remembered
from sitegen.figures.gallery import Gallery
from sitegen.problems import hint
from widgets.drawing.picture import SUPERSCRIPT

OURS = ("solvers", "widgets")
SPARE = 2000  # unused numbers to keep per state of the code: a build may ask only for those of an edited chapter
NAMESPACES = (*OURS, "plots")
OPERATORS: dict[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: math.pow, ast.USub: operator.neg,
}
HYPHENS = re.compile(r"\s*((?:solvers|widgets|plots)\.[\w.]*)-[\w.-]+(?=\()")
FUNCTIONS = ("sqrt", "exp", "log", "log2", "sin", "cos", "asin", "degrees", "radians")


class CallError(ValueError):
    """An invalid call; `offset` is the place of the error in its text."""

    def __init__(self, message: str, offset: int) -> None:
        super().__init__(message)
        self.offset = offset


@dataclass(frozen=True)
class Call:
    """A call as written: dotted names with their offsets, and literal arguments."""

    text: str
    names: tuple[tuple[str, int], ...]
    positional: tuple[Any, ...]
    named: dict[str, Any]


def read_value(text: str) -> Call | float:
    """Parse a text: the number if it is arithmetic, else the call. Raises CallError."""
    lead = len(text) - len(text.lstrip())
    text = text.strip()
    try:
        tree = ast.parse(text, mode="eval").body
        return float(_arithmetic(tree))
    except (SyntaxError, LookupError):
        try:
            return read_call(text)
        except CallError as error:
            raise CallError(str(error), error.offset + lead) from None
    except (ArithmeticError, TypeError, ValueError) as error:
        raise CallError(f"{type(error).__name__}: {error}", 0) from None


def _arithmetic(node: ast.expr) -> float:
    """Evaluate arithmetic. Raises LookupError for anything else."""
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return number
        case ast.Name("pi"):
            return math.pi
        case ast.BinOp(left, sign, right):
            return OPERATORS[type(sign)](_arithmetic(left), _arithmetic(right))
        case ast.UnaryOp(sign, operand):
            return OPERATORS[type(sign)](_arithmetic(operand))
        case ast.Call(ast.Name(name), arguments, []) if name in FUNCTIONS:
            answer: float = getattr(math, name)(*map(_arithmetic, arguments))
            return answer
    raise LookupError


def read_call(text: str) -> Call:
    """Parse a call. Raises CallError if the text is not a call, or has an argument that is not a literal."""
    if hyphens := HYPHENS.match(text):  # the spelling of names in ::plot
        spelling = hyphens[0].strip().replace("-", "_")
        raise CallError(f"use underscores in names, not hyphens: {spelling}(…)", hyphens.end(1))
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise CallError(f"not a call: {error.msg}", max((error.offset or 1) - 1, 0)) from None
    if not isinstance(tree, ast.Call):
        allowed = f"arithmetic with + - * / **, pi, {', '.join(FUNCTIONS)}"
        raise CallError(f"expected a call, such as solvers.consensus.trials(0.5, 0.99, 2), or {allowed}", 0)
    names: list[tuple[str, int]] = []
    node: ast.expr = tree.func
    while isinstance(node, ast.Attribute):
        names.append((node.attr, _offset(text, node.end_col_offset or 0) - len(node.attr)))
        node = node.value
    if not isinstance(node, ast.Name) or node.id not in NAMESPACES or not names:
        root = node.id if isinstance(node, ast.Name) else ast.unparse(node)
        raise CallError(f"expected a call to solvers, widgets or plots, got {root!r}{hint(root, NAMESPACES)}", 0)
    names.append((node.id, 0))
    positional = tuple(_literal(text, argument) for argument in tree.args)
    keywords: dict[str, Any] = {}
    for keyword in tree.keywords:
        if keyword.arg is None:
            raise CallError("arguments must be literals, not **", _offset(text, keyword.col_offset))
        keywords[keyword.arg] = _literal(text, keyword.value)
    return Call(text, tuple(reversed(names)), positional, keywords)


def _offset(text: str, column: int) -> int:
    """Convert ast's column, in bytes of UTF-8, to a character offset."""
    return len(text.encode()[:column].decode(errors="ignore"))


def _literal(text: str, node: ast.expr) -> Any:
    try:
        return ast.literal_eval(node)
    except ValueError:
        with suppress(LookupError, ArithmeticError, TypeError, ValueError):
            return _arithmetic(node)
        source = ast.get_source_segment(text, node)
        raise CallError(f"arguments must be literals, not {source!r}", _offset(text, node.col_offset)) from None


def resolve(call: Call) -> Any:
    """The function that a call names. Raises CallError at the first missing name, with the closest one."""
    target: Any = importlib.import_module(call.names[0][0])
    path = call.names[0][0]
    for name, offset in call.names[1:]:
        if isinstance(target, ModuleType) and not hasattr(target, name) and hasattr(target, "__path__"):
            with suppress(ModuleNotFoundError):
                importlib.import_module(f"{path}.{name}")
        if name.startswith("_") or not hasattr(target, name):
            raise CallError(f"{path} has no {name!r}{hint(name, _names(target))}", offset)
        target, path = getattr(target, name), f"{path}.{name}"
    if not callable(target):
        raise CallError(f"{path} is not callable", call.names[-1][1])
    return target


def _names(thing: Any) -> list[str]:
    """The public names of a module or a class that are our own."""
    names = [name for name in dir(thing) if not name.startswith("_") and _is_ours(getattr(thing, name))]
    if isinstance(thing, ModuleType):
        folders = [Path(p) for p in getattr(thing, "__path__", [])]
        names += [p.stem for folder in folders for p in folder.glob("*.py") if not p.stem.startswith("_")]
    return names


def _is_ours(thing: Any) -> bool:
    home = thing.__name__ if isinstance(thing, ModuleType) else getattr(thing, "__module__", "")
    return (callable(thing) or isinstance(thing, ModuleType)) and str(home).partition(".")[0] in OURS


def evaluate(call: Call) -> int | float:
    """Evaluate the call. Raises CallError if it fails or does not return a finite number."""
    return _number(resolve(call), call)


def _number(function: Any, call: Call, *results: Any) -> int | float:
    try:
        result = function(*results, *call.positional, **call.named)
    except Exception as error:  # the author should see any error of the solver
        raise CallError(f"{type(error).__name__}: {error}", 0) from error
    value = result.item() if hasattr(result, "item") and getattr(result, "ndim", 1) == 0 else result
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        actual = value if isinstance(value, float) else type(result).__name__
        raise CallError(f"expected a finite number, got {actual}", 0)
    return value


def of_plot(call: Call, gallery: Gallery) -> int | float:
    """Evaluate a call of a plot's function. Raises CallError."""
    (_, _), (module, module_at), *names = call.names
    plots = {name.replace("-", "_"): plot for name, plot in gallery.plots.items()}
    if module not in plots:
        raise CallError(f"unknown plot {module!r}{hint(module, plots)}", module_at)
    plot = plots[module]
    name, name_at = ".".join(part for part, _ in names), names[0][1] if names else module_at
    if name not in plot.numbers:
        raise CallError(f"plots.{module} has no number {name!r}{hint(name, plot.numbers)}", name_at)
    try:
        result = gallery.result(plot)
    except Exception as error:  # an error in the plot
        raise CallError(f"the plot cannot be computed: {type(error).__name__}: {error}", 0) from error
    return _number(plot.numbers[name], call, result)


class Values:
    """Evaluates calls. Values of each package are cached per state of its code; plots cache their own results."""

    def __init__(self, cache: Path, codes: Mapping[str, str], gallery: Gallery) -> None:
        self._memos = {name: Remembered(cache, f"values {name} {code}", SPARE) for name, code in codes.items()}
        self._gallery = gallery

    def value(self, call: Call) -> int | float:
        """The call's number. Raises CallError."""
        package = call.names[0][0]
        if package == "plots":
            return of_plot(call, self._gallery)
        number: int | float = self._memos[package].answer(call.text, partial(evaluate, call))
        return number

    def keep(self) -> None:
        """Store new values."""
        for memo in self._memos.values():
            memo.keep()


def printed(value: int | float, spec: str = "") -> str:
    """A number as the site prints it: true minus sign, no negative zero, powers of ten written out.

    Raises ValueError for an invalid format.
    """
    text = format(value, spec or ("d" if isinstance(value, int) else ".6g"))
    mantissa, e, exponent = text.partition("e")
    if re.fullmatch(r"-[0.,]*%?", mantissa):
        mantissa = mantissa[1:]
    power = f"·10{str(int(exponent)).translate(SUPERSCRIPT)}" if e else ""
    return mantissa.replace("-", "−") + power
