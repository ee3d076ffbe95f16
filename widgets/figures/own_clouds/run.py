"""A run of any method on a reader's clouds, and the signs by which its pose is judged without a known truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from solvers import METHODS, Pose, Status
from solvers.core.method import Problem
from solvers.core.stepper import Batch, advance, begin
from solvers.verify import SPACINGS, Evidence, evidence
from widgets.figures.own_clouds.clouds import Clouds
from widgets.figures.own_clouds.methods import OPEN, OWN, options
from widgets.parts.room import alone, single


@dataclass(frozen=True, eq=False)
class Run:
    """One method on one pair of clouds.

    length: world units, infinite for no gate. share: in [0, 1), expected to have no partner. began: the start. batch:
    None until the first step. pose: the source's current one. objective: after 0, 1, … steps. refused: why the method
    cannot begin, or "".
    """

    method: str
    clouds: Clouds
    length: float
    share: float
    seed: int
    began: Pose
    pose: Pose
    batch: Batch[Any] | None = None
    objective: tuple[float, ...] = ()
    refused: str = ""

    @cached_property
    def options(self) -> dict[str, Any]:
        """The solver's options."""
        return options(self.method, self.length, self.share, self.clouds.area)

    @property
    def steps(self) -> int:
        """The number of steps taken so far."""
        return max(0, len(self.objective) - 1)

    @property
    def done(self) -> bool:
        """Whether no steps are left to take."""
        return not self.clouds.whole or bool(self.refused) or (self.batch is not None and self.batch.done)

    @property
    def status(self) -> str:
        """The status in a word or a few."""
        if not self.clouds.whole or self.refused:
            return "not begun"
        return "at the start" if self.batch is None else Status(int(self.batch.state().status[0])).label

    @property
    def reason(self) -> str:
        """Why the run stopped, in words, or ""."""
        return self.refused or ("" if self.batch is None else str(self.batch.state().reason[0]))

    @property
    def reach(self) -> float:
        """The distance, in world units, within which a source point counts as explained."""
        return SPACINGS * (self.clouds.spacing or 1.0 / self.clouds.fit.scale)

    @cached_property
    def evidence(self) -> Evidence | None:
        """The clouds' evidence for the pose; None if one is missing."""
        if not self.clouds.whole:
            return None
        return evidence(self.clouds.source, self.clouds.target, self.pose, self.reach)

    def step(self) -> Run:
        """The run after one more step; a run that has stopped is returned as it is."""
        if self.done:
            return self
        batch, course = self.batch, self.objective
        if batch is None:
            try:
                method = METHODS[self.method]
                batch = begin(method, _problem(self.clouds, self.began, self.seed), method.options(**self.options))
            except ValueError as error:
                return replace(self, refused=str(error))
            course = (float(batch.objective()[0]),)
        if not batch.done:
            batch = advance(batch)
            course = (*course, float(batch.objective()[0]))
        return replace(self, batch=batch, pose=single(batch.pose()), objective=course)


def begun(method: str, clouds: Clouds, spacings: float, share: float, seed: int, start: Pose) -> Run:
    """A run from `start`, before its first step. spacings: the length scale, in spacings of the target. The start's
    angle and shift are rounded (the shift to ten digits), so that a script can reproduce them on any processor."""
    unit = clouds.spacing or 1.0 / clouds.fit.scale
    length = float("inf") if spacings >= OPEN and OWN[method].opens else spacings * unit
    theta = round(float(np.arctan2(start.R[1, 0], start.R[0, 0])), 12) + 0.0
    exact = Pose.from_angle(theta, [float(f"{shift:.10g}") + 0.0 for shift in start.t])
    return Run(method, clouds, length, share, seed, exact, exact)


def _problem(clouds: Clouds, start: Pose, seed: int) -> Problem:
    weights = np.ones((1, len(clouds.source)))
    return Problem(clouds.source[None], clouds.target[None], weights, alone(start), np.array([seed]))
