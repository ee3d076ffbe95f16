"""A climb of the NDT score, recorded step by step for its figure to draw as paths, marks and charts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from solvers import Pose
from solvers.core.status import Status
from solvers.core.stepper import Batch, advance, begin
from solvers.methods.ndt import ndt
from solvers.methods.ndt.floor import floored
from solvers.methods.ndt.ndt_map import NdtMap
from solvers.methods.ndt.score import evaluate
from solvers.scenes.rooms import Scene
from widgets.drawing.picture import Array, Ellipses
from widgets.parts.room import problem

Cap = Literal["", "shift", "turn"]


@dataclass(frozen=True, eq=False)
class Climb:
    """A run with its history. states: from the start to now, each a batch of one, k + 1 after k steps.
    caps: (k + 1) which limit shortened the step that led to each state. truth: the score of the true pose on the cells
    of each level, which only a simulation can know. gaussians: each level's cells as a mark."""

    batch: Batch[ndt.NdtState]
    states: tuple[ndt.NdtState, ...]
    caps: tuple[Cap, ...]
    truth: tuple[float, ...]
    gaussians: tuple[Ellipses, ...]

    @property
    def now(self) -> ndt.NdtState:
        return self.states[-1]

    @property
    def pose(self) -> Pose:
        return self.now.pose[0]

    @property
    def status(self) -> Status:
        return Status(int(self.now.status[0]))

    @property
    def steps(self) -> int:
        return len(self.states) - 1

    @property
    def levels(self) -> list[int]:
        """The level on whose cells each state is scored."""
        return [int(state.level[0]) for state in self.states]

    @property
    def rises(self) -> list[int]:
        """The steps after which the next level's cells took over."""
        levels = self.levels
        return [k for k in range(1, len(levels)) if levels[k] > levels[k - 1]]

    @property
    def halved(self) -> list[int]:
        """How often the step that led to each state was halved."""
        return [int(state.halved[0]) for state in self.states]

    @property
    def damping(self) -> Array:
        """λ of the step that led to each state, (k + 1,); nothing led to the first."""
        return np.array([np.nan, *(float(state.damping[0]) for state in self.states[1:])])

    @property
    def relative(self) -> Array:
        """The score of each state over that of the truth on the same cells, (k + 1,); 0 where the truth scores 0."""
        scores = [-float(state.objective[0]) for state in self.states]
        at = [self.truth[level] for level in self.levels]
        return np.array([s / t if t > 0.0 else 0.0 for s, t in zip(scores, at, strict=True)])

    @property
    def gradient(self) -> Array:
        """Norm of each state's gradient by (tx, ty, ρφ), ρ the scan's RMS radius, in score per u, (k + 1,)."""
        return np.array([float(np.linalg.norm(_scaled(state)[0])) for state in self.states])


def _scaled(state: ndt.NdtState) -> tuple[Array, Array]:
    return ndt.scaled(state.at.gradient, state.at.hessian, state.radius)


def start(scene: Scene, pose: Pose, options: ndt.NdtOptions, max_steps: int) -> Climb:
    """The run from `pose`, before its first step."""
    batch = begin(ndt.NDT, problem(scene, pose), options, max_steps)
    state = batch.state()
    truth = tuple(score(state, level, scene.truth) for level in range(len(state.maps)))
    return Climb(batch, (state,), ("",), truth, tuple(map(_gaussians, state.maps)))


def restart(run: Climb, scene: Scene, pose: Pose) -> Climb:
    """The same run from another start, keeping what does not depend on the start."""
    batch = begin(ndt.NDT, problem(scene, pose), run.now.options, run.batch.max_steps)
    return replace(run, batch=batch, states=(batch.state(),), caps=("",))


def _gaussians(cells: NdtMap) -> Ellipses:
    """The Gaussians of the first grid, at two standard deviations."""
    first = cells.kept[0] & (cells.grid[0] == 0)
    return Ellipses(cells.mean[0, first], floored(cells.covariance[0, first]), "target", sigmas=2.0, filled=True)


def score(state: ndt.NdtState, level: int, pose: Pose) -> float:
    """The score of any pose on the cells of a level."""
    moved = pose.apply(state.problem.source)
    return float(evaluate(state.maps[level], moved, np.zeros((1, 2)), derivatives=False).score[0])


def step(run: Climb) -> Climb:
    """The run after one more step; a run that has ended is returned as it is."""
    if run.batch.done:
        return run
    batch = advance(run.batch)
    return replace(run, batch=batch, states=(*run.states, batch.state()), caps=(*run.caps, cap(run.now)))


def cap(state: ndt.NdtState) -> Cap:
    """Which limit shortens the step that the solver proposes at a state; if both do, the one that shortens it more."""
    free, _ = ndt.newton_step(state.at.gradient, state.at.hessian, state.radius, np.full(1, np.inf), np.inf)
    shift = float(np.linalg.norm(free[0, :2])) / float(state.max_shift[0])
    turn = abs(float(free[0, 2])) / state.options.max_turn
    if max(shift, turn) <= 1.0:
        return ""
    return "shift" if shift > turn else "turn"
