"""Runs the docstring examples of `solvers` exactly as written."""

from __future__ import annotations

import doctest
import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from functools import cached_property

import pytest

import solvers

# The page's bytecode carries no docstrings.
pytestmark = pytest.mark.native

# `python -m solvers` runs on import.
MODULES = ["solvers", *(module.name for module in pkgutil.walk_packages(solvers.__path__, "solvers."))]
MODULES = [name for name in MODULES if not name.endswith("__main__")]


def examples(name: str) -> list[doctest.DocTest]:
    """The docstrings with examples among those of a module's own functions and classes."""
    result = doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(name))
    return [test for test in result if test.examples]


@pytest.mark.parametrize("test", [test for name in MODULES for test in examples(name)], ids=lambda test: test.name)
def test_what_a_docstring_shows_is_what_python_answers(test: doctest.DocTest) -> None:
    """Each example runs with its own imports alone, without the names of the module that it is in."""
    test.globs = {}
    text: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=text.append)
    assert result.attempted == len(test.examples)
    assert not result.failed, "".join(text)


def test_there_are_examples_to_run() -> None:
    """Examples are found, including those of the front door."""
    names = {test.name for name in MODULES for test in examples(name)}
    assert {"solvers", "solvers.api.register", "solvers.core.pose.Pose", "solvers.geometry.rigid.fit_rigid"} <= names


def public_classes() -> Iterator[type]:
    """The public classes of `solvers` and the modules that it exposes: those in `__all__`, or else their own."""
    for module in ("solvers", *(f"solvers.{name}" for name in solvers._MODULES.values())):
        room = importlib.import_module(module)
        own = [name for name, value in vars(room).items() if getattr(value, "__module__", None) == module]
        for name in getattr(room, "__all__", own):
            if inspect.isclass(getattr(room, name)) and not name.startswith("_"):
                yield getattr(room, name)


def own_members(cls: type) -> Iterator[tuple[str, object]]:
    """The public methods and properties that a class itself defines, each with the object that has its docstring."""
    for name, member in vars(cls).items():
        if isinstance(member, classmethod | staticmethod):
            member = member.__func__
        if not name.startswith("_") and (inspect.isfunction(member) or isinstance(member, property | cached_property)):
            yield name, member


def code(obj: object) -> str:
    """The code of the examples in a docstring."""
    return "".join(example.source for example in doctest.DocTestParser().get_examples(inspect.getdoc(obj) or ""))


@pytest.mark.parametrize("cls", dict.fromkeys(public_classes()), ids=lambda cls: f"{cls.__module__}.{cls.__name__}")
def test_a_public_class_and_its_methods_have_examples(cls: type) -> None:
    """Each public class has an example. Each of its methods and properties has one too, or is used in the class's."""
    example = code(cls)
    without = [] if example else [cls.__name__]
    for name, member in own_members(cls):
        if not code(member) and not re.search(rf"\.{name}\b", example):
            without.append(f"{cls.__name__}.{name}")
    assert without == []
