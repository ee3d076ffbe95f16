"""The examples in the docstrings of `solvers`, run as they stand."""

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
MODULES = ["solvers", *(each.name for each in pkgutil.walk_packages(solvers.__path__, "solvers."))]
MODULES = [name for name in MODULES if not name.endswith("__main__")]


def examples(name: str) -> list[doctest.DocTest]:
    """The docstrings of a module's own functions and classes that have examples."""
    result = doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(name))
    return [each for each in result if each.examples]


@pytest.mark.parametrize("test", [each for name in MODULES for each in examples(name)], ids=lambda each: each.name)
def test_what_a_docstring_shows_is_what_python_answers(test: doctest.DocTest) -> None:
    """Each with its own imports: names of the module that a reader has not imported are not there."""
    test.globs = {}
    text: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=text.append)
    assert result.attempted == len(test.examples)
    assert not result.failed, "".join(text)


def test_there_are_examples_to_run() -> None:
    """The front door's among them."""
    names = {each.name for name in MODULES for each in examples(name)}
    assert {"solvers", "solvers.api.register", "solvers.core.pose.Pose", "solvers.geometry.rigid.fit_rigid"} <= names


def public_classes() -> Iterator[type]:
    """The classes of `solvers` and of the modules that it hands on: what they list, or else define."""
    for module in ("solvers", *(f"solvers.{name}" for name in solvers._MODULES.values())):
        room = importlib.import_module(module)
        own = [name for name, made in vars(room).items() if getattr(made, "__module__", None) == module]
        for name in getattr(room, "__all__", own):
            if inspect.isclass(getattr(room, name)) and not name.startswith("_"):
                yield getattr(room, name)


def own_members(each: type) -> Iterator[tuple[str, object]]:
    """The public methods and properties that a class itself defines: their names, and what has their docstrings."""
    for name, member in vars(each).items():
        if isinstance(member, classmethod | staticmethod):
            member = member.__func__
        if not name.startswith("_") and (inspect.isfunction(member) or isinstance(member, property | cached_property)):
            yield name, member


def code(thing: object) -> str:
    """What the examples of a docstring run."""
    return "".join(example.source for example in doctest.DocTestParser().get_examples(inspect.getdoc(thing) or ""))


@pytest.mark.parametrize("each", dict.fromkeys(public_classes()), ids=lambda each: f"{each.__module__}.{each.__name__}")
def test_a_public_class_and_its_methods_have_examples(each: type) -> None:
    """A class has one of its own. A method or a property has one, or is used by name in those of its class."""
    example = code(each)
    without = [] if example else [each.__name__]
    for name, member in own_members(each):
        if not code(member) and not re.search(rf"\.{name}\b", example):
            without.append(f"{each.__name__}.{name}")
    assert without == []
