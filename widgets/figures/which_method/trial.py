"""The advice put to the test: on 25 scenes with the properties in the answers, from one start, against the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from solvers import Pose
from solvers.api import register
from solvers.metrics import rre, rte
from solvers.scenes import room_start
from solvers.scenes.rooms import kabsch_scene
from solvers.studies.benchmark import is_close
from solvers.studies.race import SEEDS, Controls, race_problem
from widgets.drawing.picture import Array
from widgets.figures.which_method.rules import RUNGS, Answers

STARTS: Mapping[str, tuple[float, float]] = {"near": (10.0, 0.3), "rough": (45.0, 1.43), "none": (150.0, 1.43)}
SEEN: Mapping[str, float] = {"most": 1.0, "half": 0.6}  # the fraction of what the source sees that the target sees too
WRONG: Mapping[str, int] = {"right": 0, "some": 4}  # of 13 pairs
GATE, WIDE = 0.5, 2.6  # u: the gate of a refinement, and that of a run that begins far off
OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "ransac": {"inlier": 0.25},
    "propose": {"separation": 2.0, "tolerance": 0.28, "inlier": 0.32},
    "gicp": {"neighbours": 8},
    "ndt": {"cells": (2.4, 1.2), "max_shift": 0.5, "max_turn": 0.2},
    "soft": {"first": 2.2, "shrink": 0.9, "last": 0.12, "least_support": 0.15},
    "mmd": {"count": 128},
    "search": {"cell": 0.25},
}
TREES, APART, NOISE = 60, 0.6, 0.05  # points, and u

OF = len(SEEDS)

Clouds = tuple[Array, Array, Pose]


def options(name: str, near: bool) -> dict[str, Any]:
    """A rung's options; near: whether it begins close enough for a narrow gate."""
    gate = {"gate": GATE if near else WIDE} if name in ("icp", "gicp") else {}
    return {**gate, **OPTIONS.get(name, {})}


def grove(seed: int, share: float) -> tuple[Array, Array]:
    """Two clouds of scattered points, the trunks of a grove: the source has all, the target the leftmost ones.

    share: the fraction that the target sees, as in `SEEN`.
    """
    rng = np.random.default_rng(seed)
    trunks = np.empty((0, 2))
    for trunk in rng.uniform((-5.0, -3.2), (5.0, 3.2), (2000, 2)):
        if len(trunks) < TREES and (not len(trunks) or np.hypot(*(trunks - trunk).T).min() > APART):
            trunks = np.vstack([trunks, trunk])
    source, target = (trunks + NOISE * rng.standard_normal(trunks.shape) for _ in range(2))
    return source, target[np.sort(np.argsort(trunks[:, 0])[: kept(share)])]


def kept(share: float) -> int:
    """The number of trunks in a target."""
    return round(0.9 * share * TREES)


def clouds_of(answers: Answers) -> Clouds:
    """The 25 sources and targets, and the true poses."""
    return _clouds(answers.pairs, answers.overlap, answers.surfaces)


@lru_cache(maxsize=8)
def _clouds(pairs: str, overlap: str, surfaces: str) -> Clouds:
    if pairs != "none":
        scenes = [kabsch_scene("noisy", seed=seed, outliers=WRONG[pairs]) for seed in SEEDS]
        truth = Pose(np.stack([s.truth.R for s in scenes]), np.stack([s.truth.t for s in scenes]))
        return np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), truth
    if surfaces == "walls":
        problem, truth = race_problem(Controls(setting="combo", overlap=SEEN[overlap]))
        return problem.source, problem.target, truth
    sources, targets = zip(*(grove(seed, SEEN[overlap]) for seed in SEEDS), strict=True)
    return np.stack(sources), np.stack(targets), Pose.identity(2, (OF,))


@lru_cache(maxsize=256)
def _ends(path: tuple[str, ...], answers: Answers) -> Pose:
    """Where the 25 runs of a path end; each rung begins where the one before ended."""
    source, target, truth = clouds_of(answers)
    if not path:
        return room_start(*STARTS[answers.start]).compose(truth)
    start, near = _ends(path[:-1], answers), answers.start == "near" or len(path) > 1
    settings = options(path[-1], near)
    return register(source, target, RUNGS[path[-1]].method, start=start, seed=list(SEEDS), **settings).pose


@dataclass(frozen=True, eq=False)
class Run:
    """A path, or one rung alone, on the 25 scenes of some answers."""

    path: tuple[str, ...]
    answers: Answers

    @cached_property
    def errors(self) -> tuple[Array, Array]:
        """The rotation errors in degrees, and the translation errors in u."""
        pose, (_, _, truth) = _ends(self.path, self.answers), clouds_of(self.answers)
        return np.degrees(rre(pose, truth)), rte(pose, truth)

    @property
    def found(self) -> int:
        """The number of scenes on which it ends within 5° and 0.2 u of the truth."""
        return int(np.count_nonzero(is_close(*self.errors)))

    @property
    def turn(self) -> float:
        """The median rotation error, degrees."""
        return float(np.median(self.errors[0]))


def run(path: tuple[str, ...], answers: Answers) -> Run:
    """The run of a path; answers that do not affect it are normalised, so that equal runs are shared."""
    runs = tuple(name for name in path if RUNGS[name].method)
    if answers.pairs != "none":
        answers = Answers(answers.pairs)
    elif runs[0] in ("propose", "search"):
        answers = replace(answers, start="none")
    return _run(runs, answers)


@lru_cache(maxsize=256)
def _run(path: tuple[str, ...], answers: Answers) -> Run:
    return Run(path, answers)
