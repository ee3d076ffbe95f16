"""The examples in the docstrings of `solvers`, run as they stand."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import pytest

import solvers

# The page's bytecode carries no docstrings.
pytestmark = pytest.mark.native

# `python -m solvers` runs on import.
MODULES = ["solvers", *(each.name for each in pkgutil.walk_packages(solvers.__path__, "solvers."))]
MODULES = [name for name in MODULES if not name.endswith("__main__")]


def examples(name: str) -> list[doctest.DocTest]:
    """The docstrings of a module's own functions and classes that have examples."""
    found = doctest.DocTestFinder(exclude_empty=True).find(importlib.import_module(name))
    return [each for each in found if each.examples]


@pytest.mark.parametrize("test", [each for name in MODULES for each in examples(name)], ids=lambda each: each.name)
def test_what_a_docstring_shows_is_what_python_answers(test: doctest.DocTest) -> None:
    """Each with its own imports: names of the module that a reader has not imported are not there."""
    test.globs = {}
    said: list[str] = []
    result = doctest.DocTestRunner(verbose=False).run(test, out=said.append)
    assert result.attempted == len(test.examples)
    assert not result.failed, "".join(said)


def test_there_are_examples_to_run() -> None:
    """The front door's among them."""
    names = {each.name for name in MODULES for each in examples(name)}
    assert {"solvers", "solvers.api.register", "solvers.core.pose.Pose", "solvers.geometry.rigid.fit_rigid"} <= names
