"""A run of a soft method as a figure shows it: σ held, estimated or scheduled, and the rises of the objective."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solvers import METHODS, Pose
from solvers.core.stepper import Batch, advance, begin
from solvers.metrics import rre, rte
from solvers.scenes.rooms import Scene
from widgets.parts.room import problem, single

RISE = 1e-9  # per point; a smaller rise is rounding error
SHRINK = 0.9
LAST = 0.08  # u, where a schedule ends
REST = 1e-3  # of the RMS radius: a run whose step moves less has come to rest


@dataclass(frozen=True)
class Rule:
    """A method with its options. width: how σ changes: 'held', 'estimated' or 'scheduled'. sigma: its first value, u.

    filter: FilterReg's. clutter: the weight w. volume: V, u².
    """

    method: str
    width: str
    sigma: float
    clutter: float
    volume: float
    filter: str = "exact"

    @property
    def last(self) -> float:
        """The last σ, u, if it is scheduled."""
        return min(self.sigma, LAST)

    @property
    def restarts(self) -> bool:
        """Whether the run restarts at every step's pose: CPD always estimates σ, so only a restart can set it."""
        return self.method.startswith("cpd") and self.width != "estimated"

    @property
    def promise(self) -> str:
        """What is known of the objective in advance: 'never rises', 'within a stage' or 'none'."""
        if self.method == "gmmreg":
            return "never rises" if self.width == "held" else "within a stage"
        return "never rises" if self.method.startswith("cpd") and self.width != "scheduled" else "none"

    def options(self, sigma: float) -> dict[str, Any]:
        """The solver's options, starting at this σ."""
        if self.method == "gmmreg":
            return {"first": sigma, "last": sigma if self.width == "held" else self.last, "tolerance": REST}
        common = {"clutter": self.clutter, "volume": self.volume}
        if self.method != "filterreg":
            return {"sigma": sigma, **common, "tolerance": REST}
        settings: dict[str, Any] = {"variance": "estimated" if self.width == "estimated" else "scheduled"}
        if self.width == "held":
            settings |= {"last": sigma, "shrink": 1.0}
        elif self.width == "scheduled":
            settings |= {"last": self.last, "shrink": SHRINK}
        return {"filter": self.filter, **settings, "first": sigma, **common, "tolerance": REST}

    def after(self, sigma: float) -> float:
        """The σ of the next step, if this figure sets it."""
        return max(SHRINK * sigma, self.last) if self.width == "scheduled" else sigma


@dataclass(frozen=True)
class Entry:
    """One pose of the course. objective: per point, or MMD²; truth: the same at the true pose with this σ. staged:
    whether σ has changed, and with it what GMMReg minimises. rotation, translation: errors, degrees and u."""

    objective: float
    truth: float
    sigma: float
    scale: float
    rotation: float
    translation: float
    staged: bool


@dataclass(frozen=True, eq=False)
class Run:
    """A run so far. batch: one problem. course: from the start to now. rest: whether a run that restarts at every step
    has come to rest."""

    rule: Rule
    scene: Scene
    began: Pose
    batch: Batch[Any]
    course: tuple[Entry, ...]
    most: int
    rest: bool = False

    @property
    def now(self) -> Any:
        """The solver's state, a batch of one."""
        return self.batch.state()

    @property
    def pose(self) -> Pose:
        """The source's current pose."""
        return single(self.batch.pose())

    @property
    def sigma(self) -> float:
        """The current σ, u."""
        return self.course[-1].sigma

    @property
    def steps(self) -> int:
        """The number of steps taken so far."""
        return len(self.course) - 1

    @property
    def done(self) -> bool:
        """Whether the run has stopped."""
        return self.rest or self.batch.done or self.steps >= self.most

    @property
    def stop(self) -> str:
        """Why the run stopped, in words."""
        if self.rest:
            return "the pose has come to rest"
        if self.batch.done:
            return str(self.now.reason[0])
        return f"the cap of {self.most} steps was reached" if self.done else ""

    @property
    def rises(self) -> tuple[int, ...]:
        """The steps after which the objective was larger than before; a new stage of GMMReg is not a rise."""
        values = [e.objective for e in self.course]
        return tuple(k for k in range(1, len(values)) if values[k] > values[k - 1] + RISE and not self.course[k].staged)

    def step(self) -> Run:
        """The run after one more step; a run that has stopped stays as it is."""
        if self.done:
            return self
        batch, rest = advance(self.batch), False
        if self.rule.restarts and not batch.done:
            state, sigma = batch.state(), self.rule.after(self.sigma)
            rest = bool(state.change[0] <= REST) and sigma == self.sigma
            batch = _new_batch(self.rule, self.scene, single(state.pose), sigma, self.most)
        entry = _entry(self.rule, self.scene, batch.state(), self.now)
        return replace(self, batch=batch, rest=rest, course=(*self.course, entry))


def begun(rule: Rule, scene: Scene, start: Pose, most: int) -> Run:
    """A run of the scene from `start`, before its first of at most `most` steps."""
    batch = _new_batch(rule, scene, start, rule.sigma, most)
    return Run(rule, scene, start, batch, (_entry(rule, scene, batch.state(), None),), most)


def _new_batch(rule: Rule, scene: Scene, start: Pose, sigma: float, most: int) -> Batch[Any]:
    method = METHODS[rule.method]
    p = problem(scene, start)
    # A similarity may have scaled its cloud already.
    p = replace(p, start=Pose(start.R[None], start.t[None], np.reshape(np.asarray(start.scale), (1,))))
    return begin(method, p, method.options(**rule.options(sigma)), most + 1)


def measured(rule: Rule, state: Any) -> float:
    """The objective as the figure shows it: the negative log-likelihood per point, or the MMD² of two mixtures."""
    value = float(state.objective[0])
    if rule.method == "gmmreg":
        return value * 4.0 * np.pi * float(state.sigma[0]) ** 2
    points = state.problem.source if rule.method == "filterreg" else state.problem.target
    return value / int(points.shape[1])


def at(rule: Rule, scene: Scene, pose: Pose, sigma: float) -> float:
    """The objective at another pose with this σ."""
    return measured(rule, _new_batch(rule, scene, pose, sigma, 1).state())


def _entry(rule: Rule, scene: Scene, state: Any, before: Any) -> Entry:
    pose, sigma = single(state.pose), float(state.sigma[0])
    return Entry(
        objective=measured(rule, state),
        truth=at(rule, scene, scene.truth, sigma),
        sigma=sigma,
        scale=float(np.asarray(pose.scale)),
        rotation=float(np.degrees(rre(pose, scene.truth))),
        translation=float(rte(pose, scene.truth)),
        staged=rule.method == "gmmreg" and before is not None and sigma != float(before.sigma[0]),
    )
