"""What the race's cards say of the start, by steps from two starts."""

from __future__ import annotations

import numpy as np

from solvers.core.stepper import advance
from solvers.studies.race import Controls as Race
from solvers.studies.race import race_problem
from widgets.figures.race.field import ENTRIES


def test_only_what_ignores_the_start_is_said_to() -> None:
    """From the truth and from 45° the first step of RANSAC and of the grid leads to one pose. That of branch and bound,
    which tries the start too, does not."""
    problems = [race_problem(Race(degrees=turn, distance=away), [40])[0] for turn, away in ((45.0, 1.43), (0.0, 0.0))]
    for name, entry in ENTRIES.items():
        far, near = (advance(entry.contestant.begin(problem)).pose().matrix for problem in problems)
        assert ("ignores the start" in entry.note) == np.array_equal(far, near), name


def test_the_kiss_threshold_comes_from_the_error_of_the_start() -> None:
    """It follows that error without being it: 6 u at the truth, 12 u from 45° where no point is 7 u off."""
    entry = ENTRIES["kiss-threshold-icp"]
    assert "comes from the start’s error" in entry.note
    reaches, furthest = [], []
    for turn, away in ((0.0, 0.0), (45.0, 1.43)):
        problem, truth = race_problem(Race(degrees=turn, distance=away), [40])
        reaches.append(entry.contestant.begin(problem).state().reach[0])
        moved, right = (pose.apply(problem.source) for pose in (problem.start, truth))
        furthest.append(np.linalg.norm(moved - right, axis=2).max())
    np.testing.assert_allclose(reaches, [6.1, 12.4], atol=0.1)
    assert furthest[0] == 0.0
    assert furthest[1] < 7.0
