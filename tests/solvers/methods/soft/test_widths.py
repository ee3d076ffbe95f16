"""Where a width begins and ends, when one of the two is given."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import METHODS
from solvers.race import Controls, race_problem
from solvers.stepper import begin, run

SCHEDULES = {
    "gmmreg": ("sigma", {}),
    "filterreg": ("sigma", {"variance": "scheduled"}),
    "soft-annealed": ("sigma", {}),
    "association-bp": ("sigma", {}),
    "hypothesis-mixture": ("sigma", {}),
    "fast-robust-icp": ("nu", {}),
}


@pytest.mark.parametrize("first", [0.02, 0.5])
@pytest.mark.parametrize("method", SCHEDULES)
def test_a_width_begins_where_it_is_told_to(method: str, first: float) -> None:
    """Also below where it would end by default: then it ends there, too."""
    width, more = SCHEDULES[method]
    problem, _ = race_problem(Controls(), seeds=[40])
    chosen = METHODS[method]
    state = begin(chosen, problem, chosen.options(first=first, **more)).state()
    assert getattr(state, width)[0] == pytest.approx(first, rel=1e-12)
    assert np.all(state.last <= state.last.dtype.type(first) * (1.0 + 1e-12))


@pytest.mark.parametrize("last", [0.3, 9.0])
@pytest.mark.parametrize("method", SCHEDULES)
def test_a_width_ends_where_it_is_told_to(method: str, last: float) -> None:
    """Also above where it would begin by default: then it begins there, too."""
    width, more = SCHEDULES[method]
    problem, _ = race_problem(Controls(), seeds=[40])
    chosen = METHODS[method]
    batch = begin(chosen, problem, chosen.options(last=last, **more), max_steps=200)
    assert getattr(batch.state(), width)[0] >= last
    state = run(batch)[0].state()
    assert getattr(state, width)[0] == pytest.approx(last, rel=1e-12)
