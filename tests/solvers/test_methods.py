"""The list of methods: names without imports, modules when asked."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

from solvers import METHODS, Pose
from solvers.stepper import Problem, advance, begin


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


def locked(value: Any) -> int:
    """Makes all arrays of a state read-only; tells how many."""
    if isinstance(value, np.ndarray):
        value.flags.writeable = False
        return 1
    if is_dataclass(value):
        return sum(locked(getattr(value, each.name)) for each in fields(value))
    return sum(map(locked, value)) if isinstance(value, tuple) else 0


@pytest.mark.parametrize("name", list(METHODS))
def test_a_step_writes_into_nothing_that_it_is_given(name: str, rng: Generator) -> None:
    """A state is kept by whoever holds it, and the states before the first step are shared with it."""
    target = rng.standard_normal((2, 40, 2)) @ np.diag([3.0, 1.0])
    source = Pose.from_angle([0.2, -0.3], (0.1, 0.2)).inverse().apply(target)
    problem = Problem(source, target, np.ones((2, 40)), Pose.identity(2, (2,)), np.array([40, 53], dtype=np.int64))
    batch = begin(METHODS[name], problem, max_steps=4)
    while not batch.done:
        assert locked(batch.whole) + locked(batch.part) > 10
        batch = advance(batch)
    assert batch.steps.max() > 0
