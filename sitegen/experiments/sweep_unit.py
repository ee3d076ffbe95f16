"""One unit of the sweep: a contestant on some scenes and starts. Runs wherever `solvers` and numpy are available."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.core.method import Problem
from solvers.core.pose import Pose
from solvers.core.stepper import advance
from solvers.studies.benchmark import CLOSE_DEGREES, is_close, line
from solvers.studies.race import Contestant, Controls, contestants, race_problem

BATCH = 25  # problems per run, as in the race's benchmark: the first 25 seeds of the table are that benchmark


@dataclass(frozen=True)
class Unit:
    """A contestant at each of `points` (the race's controls) with each of `seeds`."""

    method: str
    points: tuple[Mapping[str, Any], ...]
    seeds: tuple[int, ...]


def run_unit(unit: Unit) -> dict[str, list[float]]:
    """Run a unit: rotation errors (degrees), translation errors (u), steps and final status, by point, then by seed."""
    (contestant,) = contestants([unit.method])
    runs: dict[str, list[float]] = {"rre": [], "rte": [], "steps": [], "status": []}
    for problem, truth in _batches([race_problem(Controls(**point), unit.seeds) for point in unit.points]):
        part = _run(contestant, problem, truth)
        for name, values in part.items():
            runs[name] += values
    return runs


def close(runs: Mapping[str, Sequence[float]]) -> list[bool]:
    """Which runs ended near the truth: below 5° and 0.2 u."""
    return [bool(flag) for flag in is_close(runs["rre"], runs["rte"])]


def turned(runs: Mapping[str, Sequence[float]]) -> list[bool]:
    """Which runs ended with a rotation error below 5°."""
    return [bool(error < CLOSE_DEGREES) for error in runs["rre"]]


def _run(contestant: Contestant, problem: Problem, truth: Pose) -> dict[str, list[float]]:
    batch = contestant.begin(problem)
    while not batch.done:
        batch = advance(batch)
    row = line(contestant, batch, truth, 0.0)
    return {
        "rre": [float(error) for error in np.round(row.rre, 4)],
        "rte": [float(error) for error in np.round(row.rte, 4)],
        "steps": [int(count) for count in row.steps],
        "status": [int(status) for status in row.status],
    }


def _batches(cases: Sequence[tuple[Problem, Pose]]) -> list[tuple[Problem, Pose]]:
    """The same problems in batches of `BATCH`, across points whose clouds have the same size."""
    batches: list[tuple[Problem, Pose]] = []
    group: list[tuple[Problem, Pose]] = []
    for case in [*cases, None]:
        if group and (case is None or case[0].source.shape[1:] != group[0][0].source.shape[1:]):
            batches += _cut(*_merge(group))
            group = []
        if case is not None:
            group.append(case)
    return batches


def _merge(group: Sequence[tuple[Problem, Pose]]) -> tuple[Problem, Pose]:
    problems, truths = [p for p, _ in group], [t for _, t in group]
    whole = Problem(
        np.concatenate([p.source for p in problems]),
        np.concatenate([p.target for p in problems]),
        np.concatenate([p.weights for p in problems]),
        _poses([_broadcast(p.start, p.size) for p in problems]),
        np.concatenate([p.seed for p in problems]),
    )
    return whole, _poses(truths)


def _broadcast(pose: Pose, count: int) -> Pose:
    """A pose for each of `count` problems, repeated if there is only one."""
    return Pose(np.broadcast_to(pose.R, (count, 2, 2)), np.broadcast_to(pose.t, (count, 2)))


def _poses(poses: Sequence[Pose]) -> Pose:
    return Pose(np.concatenate([p.R for p in poses]), np.concatenate([p.t for p in poses]))


def _cut(problem: Problem, truth: Pose) -> list[tuple[Problem, Pose]]:
    parts = []
    for first in range(0, problem.size, BATCH):
        rows = slice(first, first + BATCH)
        start = Pose(problem.start.R[rows], problem.start.t[rows])
        part = Problem(problem.source[rows], problem.target[rows], problem.weights[rows], start, problem.seed[rows])
        parts.append((part, Pose(truth.R[rows], truth.t[rows])))
    return parts
