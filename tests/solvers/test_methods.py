"""The list of methods: names without imports, modules when asked."""

from __future__ import annotations

import subprocess
import sys

import pytest

from solvers import METHODS


def test_each_method_stands_under_its_own_name() -> None:
    assert {name: METHODS[name].name for name in METHODS} == {name: name for name in METHODS}
    assert len(METHODS) == len(set(METHODS))


def test_an_unknown_name_is_a_key_error() -> None:
    assert "no such" not in METHODS
    with pytest.raises(KeyError):
        METHODS["no such"]


@pytest.mark.native
def test_a_method_is_imported_when_it_is_asked_for_and_not_by_its_name() -> None:
    code = """
import sys, solvers
assert "cpd-rigid" in solvers.METHODS and len(list(solvers.METHODS)) == len(solvers.METHODS)
before = "solvers.cpd" in sys.modules
solvers.METHODS["cpd-rigid"]
print(before, "solvers.cpd" in sys.modules)
"""
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.split() == ["False", "True"]
