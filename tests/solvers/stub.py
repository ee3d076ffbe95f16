"""The types that editors and type checkers see: `python -m tests.solvers.stub` writes solvers/_functions.pyi.

It lists the modules that come with `solvers`, a signature for each method's function, an overload of `register` for
each method, and `METHODS` with each method's options, all derived from `solvers` and `solvers.per_method`.
"""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path

import solvers
from solvers import METHODS, per_method
from solvers.core.registry import ALIASES
from solvers.methods.soft import filterreg
from solvers.numerics import fourier_features, kernel_filters, robust

STUB = Path(per_method.__file__).with_name("_functions.pyi")
CHOICES = {
    "weight": robust.KERNELS,
    "kernel": fourier_features.KERNELS,
    "filter": kernel_filters.KINDS,
    "variance": filterreg.VARIANCES,
}
"""The options whose values are words, and the words allowed."""
HEAD = '''"""The types of the modules, of the methods' functions, of `register` and of `METHODS`, written from the code.

By `python -m tests.solvers.stub`; a test holds this file to that.
"""

from collections.abc import ItemsView, Iterator, KeysView, Mapping, Sequence
from typing import Any, Generic, Literal, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

{modules}
from solvers.core.arrays import FloatArray, IntArray
from solvers.core.method import Method
from solvers.core.pose import Pose
from solvers.core.registry import MethodName
from solvers.core.result import Result
from solvers.core.stepper import Callback
from solvers.geometry import downsample as downsample
from solvers.options import (
{options}
)

__all__: list[str] = [
{names}
]

_O = TypeVar("_O")
'''
LISTED = '''class _Listed(Method[Any], Generic[_O]):
    options: type[_O]

class _Methods(Mapping[str, _Listed[Any]]):
'''
REST = '''    @overload
    def __getitem__(self, name: str, /) -> _Listed[Any]: ...
    def __iter__(self) -> Iterator[MethodName]: ...
    def keys(self) -> KeysView[MethodName]: ...
    def items(self) -> ItemsView[MethodName, _Listed[Any]]: ...
    def __len__(self) -> int: ...

METHODS: _Methods
'''


def stub() -> str:
    """The text of the stub file."""
    classes = sorted({METHODS[name].options.__name__ for name in METHODS})
    modules = [f"from solvers import {name} as {name}" for name, file in solvers._MODULES.items() if name == file]
    names = sorted(["METHODS", "register", *solvers._MODULES, *per_method.NAMES, *per_method.ALSO])
    head = {"modules": modules, "options": [f"    {name}," for name in classes], "names": _wrapped(names)}
    parts = [HEAD.format(**{key: "\n".join(lines) for key, lines in head.items()})]
    for function, name in per_method.NAMES.items():
        parts += [_signature(function, _parameters(name)), ""]
    parts += [f"{alias} = {function}" for alias, function in per_method.ALSO.items()]
    for name in METHODS:
        usual = " = ..." if name == "icp" else ""
        source, target, star, *own = _parameters(name)
        options = f"options: {METHODS[name].options.__name__} | None = ..."
        choice = f"method: Literal[{_names(name)}]{usual}"
        parts += ["", "@overload", _signature("register", [source, target, choice, star, options, *own])]
    parameters, cloud_names = list(inspect.signature(solvers.register).parameters.values()), ("source", "target")
    own = [f"{p.name}: {p.annotation}" for p in parameters if p.name in cloud_names] + ["method: Method[Any]", "*"]
    own += [f"{p.name}: {p.annotation} = ..." for p in parameters if p.kind is p.KEYWORD_ONLY]
    parts += ["", "@overload", _signature("register", [*own, "**keywords: Any"])]
    parts += ["", LISTED + "".join(_item(name) for name in METHODS) + REST]
    return "\n".join(parts)


def write() -> None:
    """Write the stub file."""
    STUB.write_text(stub(), "utf-8")


def _names(method: str) -> str:
    """A method's name and its common aliases, as members of a Literal."""
    return _literal([method, *(alias for alias, own in ALIASES.items() if own == method)])


def _literal(words: Sequence[str]) -> str:
    return ", ".join(f'"{word}"' for word in words)


def _item(method: str) -> str:
    options = METHODS[method].options.__name__
    return f"    @overload\n    def __getitem__(self, name: Literal[{_names(method)}], /) -> _Listed[{options}]: ...\n"


def _parameters(method: str) -> list[str]:
    """The parameters of a method's function, with a star before the keyword-only ones."""
    return list(_with_star(per_method.parameters(method)))


def _with_star(parameters: Sequence[inspect.Parameter]) -> Iterator[str]:
    has_star = False
    for parameter in parameters:
        if parameter.kind is inspect.Parameter.KEYWORD_ONLY and not has_star:
            has_star = True
            yield "*"
        words = CHOICES.get(parameter.name) if parameter.annotation == "str" else None
        kind = f"Literal[{_literal(words)}]" if words else parameter.annotation
        yield f"{parameter.name}: {kind}{'' if parameter.default is inspect.Parameter.empty else ' = ...'}"


def _wrapped(names: Sequence[str]) -> list[str]:
    text = ", ".join(f'"{name}"' for name in names) + ","
    return textwrap.wrap(text, 112, initial_indent="    ", subsequent_indent="    ")


def _signature(name: str, parameters: Sequence[str]) -> str:
    # Do not wrap a parameter at its spaces.
    text = ", ".join(p.replace(" ", "\0") for p in parameters) + ","
    lines = textwrap.wrap(text, 112, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False)
    return f"def {name}(\n" + "\n".join(lines).replace("\0", " ") + "\n) -> Result: ..."


if __name__ == "__main__":
    write()
