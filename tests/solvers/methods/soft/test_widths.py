"""Where a width begins and ends if only one of the two is given."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from solvers import METHODS
from solvers.race import Controls, race_problem
from solvers.stepper import Batch, begin, run

SCHEDULES = {
    "gmmreg": ("sigma", {}),
    "filterreg": ("sigma", {"variance": "scheduled"}),
    "soft-annealed": ("sigma", {}),
    "association-bp": ("sigma", {}),
    "hypothesis-mixture": ("sigma", {}),
    "fast-robust-icp": ("nu", {}),
}


def batch_of(method: str, **width: float) -> Batch[Any]:
    """A run of the race's first scene, before its first step."""
    problem, _ = race_problem(Controls(), seeds=[40])
    solver = METHODS[method]
    return begin(solver, problem, solver.options(**width, **SCHEDULES[method][1]), max_steps=200)


@pytest.mark.parametrize("first", [0.02, 0.5])
@pytest.mark.parametrize("method", SCHEDULES)
def test_a_width_begins_where_it_is_told_to(method: str, first: float) -> None:
    """If that is below its default end, it also ends there."""
    state = batch_of(method, first=first).state()
    assert getattr(state, SCHEDULES[method][0])[0] == pytest.approx(first, rel=1e-12)
    assert np.all(state.last <= state.last.dtype.type(first) * (1.0 + 1e-12))


@pytest.mark.parametrize("last", [0.3, 9.0])
@pytest.mark.parametrize("method", SCHEDULES)
def test_a_width_ends_where_it_is_told_to(method: str, last: float) -> None:
    """If that is above its default beginning, it also begins there."""
    batch, width = batch_of(method, last=last), SCHEDULES[method][0]
    assert getattr(batch.state(), width)[0] >= last
    assert getattr(run(batch)[0].state(), width)[0] == pytest.approx(last, rel=1e-12)
