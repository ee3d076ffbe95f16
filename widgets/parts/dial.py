"""A rung of the ladder as the dial shows it: its method and options, its clouds, its objective over all headings, and
the run from one of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solvers import METHODS, Pose, Status
from solvers.core.arrays import BoolArray
from solvers.core.method import Problem
from solvers.core.stepper import Batch, advance, begin
from solvers.metrics import rre, rte
from solvers.scenes.rooms import Scene, room
from solvers.studies.benchmark import is_close
from widgets.drawing.picture import Array

HEADINGS = 180  # on the full ring, 2° apart
COARSE = 3  # every third heading is on the coarse ring
STARTS = 36  # all round the circle, 10° apart, when every start is run
SLICES = 12  # in which the starts are run, so that none holds up the page for long
MOST = 70  # steps, as in the race
EVERY = 2  # every other point is taken, since the ring needs many evaluations
WRONG = 0.4  # fraction of the pairs on rung 2


@dataclass(frozen=True)
class Rung:
    """A method, with its options as a function of a length (u).

    number, says: the dial's number and title. objective: what the ring shows, in words; unit: its unit. length: the
    slider's first value; None: the method does not use it. scale: the method's name for that length. paired: whether
    row i of the source is matched with row i of the target. searches: whether the method ignores its start. flat:
    whether the method has no objective.
    """

    name: str
    number: str
    says: str
    method: str
    objective: str
    unit: str = ""
    length: float | None = None
    scale: str = "Length scale (unused)"
    options: Callable[[float], Mapping[str, Any]] = lambda length: {}
    paired: bool = False
    searches: bool = False
    flat: bool = False

    @property
    def phrase(self) -> str:
        """The title as part of a sentence."""
        return self.says[0].lower() + self.says[1:]


RUNGS: Mapping[str, Rung] = {
    rung.name: rung
    for rung in (
        Rung("pairs", "1", "Pairs, all right", "kabsch", "the sum of the pairs’ squared distances", "u²", paired=True),
        Rung(
            "corrupted", "2", "Pairs, some wrong", "ransac", "the sum of the pairs’ squared distances, each capped",
            "u²", 0.3, "Threshold ε", lambda u: {"inlier": u}, paired=True, searches=True,
        ),
        Rung(
            "nearest", "3", "The nearest point", "capped-icp",
            "the sum of the squared distances to the nearest points, each capped", "u²", 6.0, "Cap τ",
            lambda u: {"cap": u},
        ),
        Rung(
            "surface", "3½", "The nearest surface", "point-to-plane",
            "the sum of the squared distances to the tangents at the nearest points", "u²",
            options=lambda u: {"neighbours": 8},
        ),
        Rung(
            "cells", "4", "The Gaussian of a cell", "ndt",
            "NDT’s score with its sign reversed, on the coarser of two maps", "", 2.4, "Cell size h",
            lambda u: {"cells": (u, u / 2)},
        ),
        Rung(
            "soft", "5a", "Weights over all points", "cpd-rigid", "CPD’s negative log-likelihood at its first σ", "",
            2.0, "First σ", lambda u: {"sigma": u},
        ),
        Rung(
            "means", "5b", "Means of waves", "mmd",
            "the mean squared distance between the waves’ means at the first ℓ", "",
            2.4, "First ℓ", lambda u: {"lengths": (u, u / 2, u / 4, u / 8)},
        ),
        Rung(
            "flow", "9", "A flow to follow", "flow", "nothing, since a flow has no objective",
            options=lambda u: {"samples": 1}, flat=True,
        ),
    )
}  # fmt: skip
DEFAULTS = {rung.name: {"length": rung.length or 1.0} for rung in RUNGS.values()}


@dataclass(frozen=True, eq=False)
class Clouds:
    """The input of a rung: the source (m, 2) and the target (n, 2); the true pose is the identity.

    wrong: (m,) whether a pair is wrong; all False if there are no wrong pairs. scene: where both were measured.
    """

    scene: Scene
    source: Array
    target: Array
    wrong: BoolArray


@lru_cache(maxsize=16)
def clouds(name: str, seed: int, noise: float) -> Clouds:
    """Both scans of the room for a rung; for pairs the target is the same spots as the source, measured again."""
    rung = RUNGS[name]
    scene = room("clean", seed=seed, noise=noise)
    source = scene.source[::EVERY]
    wrong = np.zeros(len(source), dtype=np.bool_)
    if not rung.paired:
        return Clouds(scene, source, scene.target[::EVERY], wrong)
    rng = np.random.default_rng(seed)
    spots = room("clean", seed=seed, noise=0.0).source[::EVERY]
    target = spots + noise * rng.standard_normal(spots.shape)
    rows = rng.permutation(len(source))[: round(WRONG * len(source))]
    if rung.name == "corrupted":
        wrong[rows] = True
        target[rows] = target[np.roll(rows, 1)]
    return Clouds(scene, source, target, wrong)


@dataclass(frozen=True, eq=False)
class Course:
    """A run from one heading (radians, 0 at the truth): its headings (k + 1,), and where and how it ended."""

    headings: Array
    pose: Pose
    objective: float
    status: Status
    rotation: float
    translation: float

    @property
    def arrived(self) -> bool:
        """Whether it ended at the truth."""
        return bool(close(self.pose))


@dataclass(frozen=True, eq=False)
class Dial:
    """A rung on the clouds of a seed. Results are kept, so that turning the robot computes only its own run."""

    rung: Rung
    seed: int
    noise: float
    length: float

    @property
    def clouds(self) -> Clouds:
        """The rung's input."""
        return clouds(self.rung.name, self.seed, self.noise)

    @cached_property
    def coarse(self) -> Array:
        """The objective at every `COARSE`-th heading, (60,)."""
        return _objectives(self.rung.name, self.seed, self.noise, self.length)

    @cached_property
    def ring(self) -> Array:
        """The objective at all headings, (180,), with the robot at its true position."""
        values = np.empty(HEADINGS)
        rest = np.arange(HEADINGS) % COARSE != 0
        values[~rest] = self.coarse
        values[rest] = _objectives(self.rung.name, self.seed, self.noise, self.length, rest=True)
        return values

    def objective(self, turns: Array) -> Array:
        """The rung's objective at these headings (k,)."""
        return np.zeros(len(turns)) if self.rung.flat else np.asarray(self.begun(turns).objective())

    def course(self, heading: float) -> Course:
        """The run from a heading."""
        batch = self.begun(np.array([heading]))
        turns = [_angle(batch.pose())]
        while not batch.done:
            batch = advance(batch)
            turns.append(_angle(batch.pose()))
        state, pose = batch.state(), batch.pose()
        single = pose[0]
        truth = Pose.identity()
        return Course(
            np.concatenate(turns),
            single,
            float(batch.objective()[0]),
            Status(int(state.status[0])),
            float(np.degrees(rre(single, truth))),
            float(rte(single, truth)),
        )

    def arrivals(self, slices: int = SLICES) -> BoolArray:
        """Which starts in the first `slices` slices end at the truth, (3 · slices,)."""
        for k in range(self.slices, slices):
            self._arrived.append(_arrivals(self.rung.name, self.seed, self.noise, self.length, k))
        return np.concatenate([np.zeros(0, dtype=np.bool_), *self._arrived[:slices]])

    @property
    def slices(self) -> int:
        """How many slices have been run."""
        return len(self._arrived)

    @cached_property
    def _arrived(self) -> list[BoolArray]:
        return []

    def begun(self, turns: Array) -> Batch[Any]:
        """The rung's method begun at these headings (k,), with the robot at its true position; no step is taken."""
        k, source, target = len(turns), self.clouds.source, self.clouds.target
        source, target = (np.broadcast_to(cloud, (k, *cloud.shape)).copy() for cloud in (source, target))
        problem = Problem(source, target, np.ones(source.shape[:2]), Pose.from_angle(turns), np.full(k, self.seed))
        method = METHODS[self.rung.method]
        return begin(method, problem, method.options(**self.rung.options(self.length)), MOST)


def made(name: str, seed: int, noise: float, length: float) -> Dial:
    """A rung on the clouds of a seed, with nothing computed yet."""
    return Dial(RUNGS[name], seed, noise, length)


@lru_cache(maxsize=48)
def _objectives(name: str, seed: int, noise: float, length: float, rest: bool = False) -> Array:
    """The objectives of the coarse ring, or of the rest of the full one, cached so that a new dial, as a slider makes
    it, finds them here. Each dial has its own level of detail, so a frame does not depend on what was drawn before."""
    among = (np.arange(HEADINGS) % COARSE != 0) == rest
    values = made(name, seed, noise, length).objective(headings()[among])
    values.flags.writeable = False
    return values


@lru_cache(maxsize=128)
def _arrivals(name: str, seed: int, noise: float, length: float, part: int) -> BoolArray:
    """Which of the starts in one slice end at the truth; cached like the objectives."""
    size = STARTS // SLICES
    batch = made(name, seed, noise, length).begun(starts()[part * size : (part + 1) * size])
    while not batch.done:
        batch = advance(batch)
    arrived = close(batch.pose())
    arrived.flags.writeable = False
    return arrived


def close(pose: Pose) -> BoolArray:
    """Which poses are the truth, the identity, by the race's measure."""
    truth = Pose.identity()
    return is_close(np.degrees(rre(pose, truth)), rte(pose, truth))


def headings() -> Array:
    """The headings of the full ring, radians from −π; the truth is 0."""
    return _around(HEADINGS)


def starts() -> Array:
    """The headings of all starts, radians."""
    return _around(STARTS)


def _around(count: int) -> Array:
    """`count` headings evenly round the circle, radians from −π."""
    return np.asarray(np.radians(np.arange(count) * (360.0 / count) - 180.0))


def _angle(pose: Pose) -> Array:
    return np.asarray(np.arctan2(pose.R[:, 1, 0], pose.R[:, 0, 0]))


def valleys(ring: Array) -> NDArray[np.intp]:
    """The rows of a ring that are lower than both their neighbours, the first of each flat bottom; differences due to
    rounding are ignored."""
    spread = float(ring.max() - ring.min())
    if spread <= 1e-9 * max(1.0, float(np.abs(ring).max())):
        return np.zeros(0, dtype=np.intp)
    steps = np.round((ring - ring.min()) / spread, 6)
    rows = np.flatnonzero(steps != np.roll(steps, 1))
    steps = steps[rows]
    return np.asarray(rows[(steps < np.roll(steps, 1)) & (steps < np.roll(steps, -1))])
