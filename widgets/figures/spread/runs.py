"""Registrations of redrawn scans: where they end, how often a region contains the truth, and what one pair expects."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from solvers import Pose
from solvers.api import register
from solvers.studies.coverage import GATE, Runs, ends_of, regions
from solvers.studies.redrawn import Redrawn, redrawn, starts
from solvers.uncertainty import Covariance, Spread

DRAWS, PRESS = 200, 40
STRAY = 0.05  # of the ends; a smaller share is a few stray runs
FAR_OUT = 5.0  # u, how far a free direction is drawn


@dataclass(frozen=True)
class Ask:
    """Everything that determines the draws."""

    place: str
    end: float
    method: str
    heading: float
    shift: float
    noise: float
    seed: int


@dataclass(frozen=True)
class Counts:
    """The numbers of draws in which the Hessian's region contains the truth, Censi's does, and one has no bound."""

    hessian: int = 0
    censi: int = 0
    unbounded: int = 0

    def __add__(self, other: Counts) -> Counts:
        return Counts(self.hessian + other.hessian, self.censi + other.censi, self.unbounded + other.unbounded)


@lru_cache(maxsize=8)
def scans_and_starts(ask: Ask, count: int) -> tuple[Redrawn, Pose]:
    """The scans of `count` draws, and the poses at which their registrations start."""
    scans = redrawn(ask.place, count, seed=ask.seed, end=ask.end, noise=ask.noise)
    return scans, starts(scans.truth, count, heading=ask.heading, shift=ask.shift, seed=ask.seed)


def _runs(ask: Ask, first: int, last: int, count: int) -> Runs:
    """The draws from `first` up to `last`, exclusive, of `count` in all."""
    scans, start_poses = scans_and_starts(ask, count)
    rows = slice(first, last)
    part = replace(scans, source=scans.source[rows], target=scans.target[rows], weights=scans.weights[rows])
    result = register(part.source, part.target, ask.method, start=start_poses[rows], weights=part.weights, gate=GATE)
    return Runs(part, start_poses[rows], (ask.heading, ask.shift), ask.noise, result, {"gate": GATE})


@lru_cache(maxsize=64)
def _block(ask: Ask, k: int) -> tuple[Pose, Counts]:
    """The ends of the draws of press k, and their counts."""
    draws = _runs(ask, k * PRESS, (k + 1) * PRESS, DRAWS)
    hessian, censi = (regions(draws, form) for form in ("hessian", "censi"))
    unbounded = (hessian.free | censi.free).any(axis=-1)
    masks = hessian.covers(draws.scans.truth), censi.covers(draws.scans.truth), unbounded
    return draws.result.pose, Counts(*(int(np.count_nonzero(mask)) for mask in masks))


@lru_cache(maxsize=16)
def ends(ask: Ask, count: int) -> tuple[Spread, Counts]:
    """The spread of the ends of the first `count` draws, a multiple of `PRESS`, and their counts."""
    blocks = [_block(ask, k) for k in range(count // PRESS)]
    poses = Pose(np.concatenate([pose.R for pose, _ in blocks]), np.concatenate([pose.t for pose, _ in blocks]))
    draws = _runs(ask, 0, 1, 1)
    counts = sum((counts for _, counts in blocks), Counts())
    return ends_of(replace(draws, result=replace(draws.result, pose=poses))), counts


@lru_cache(maxsize=16)
def closed_forms(ask: Ask) -> tuple[Covariance, Covariance]:
    """The Hessian's and Censi's covariances for the first pair of scans, centred on the truth."""
    draws = _runs(ask, 0, 1, 1)
    truth = draws.scans.truth
    hessian, censi = (
        replace(regions(draws, form)[0].to("source"), mean=truth).to("target") for form in ("hessian", "censi")
    )
    return hessian, censi


def true_mode(spread: Spread, truth: Pose) -> int:
    """The cluster whose mean is nearest to the truth; stray ends are none."""
    away = [np.linalg.norm(mode.mean.matrix - truth.matrix) for mode in spread.modes]
    return int(np.argmin(np.where(spread.shares >= min(STRAY, spread.shares[0]), away, np.inf)))
