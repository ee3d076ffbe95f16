"""The mug's registration as the figure shows it: known pairs in one step, unknown ones in many."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from solvers import METHODS, Pose, Status, fit_rigid
from solvers.collinear import poses_about_line
from solvers.core.method import Problem
from solvers.core.stepper import Batch, advance, begin
from solvers.metrics import point_error, rms, rre
from solvers.mug_scene import Mug, mug, mug_pairs, mug_start
from widgets.drawing.picture import Array, worded
from widgets.parts.room import alone, single

STEPS = 60
OFFSET = 0.4  # u, of the start
UNKNOWN: Mapping[str, str] = {"icp": "icp", "plane": "point-to-plane"}
OPTIONS: Mapping[str, Mapping[str, float]] = {"icp": {}, "plane": {"free_below": 0.05}}
"""Noise and sampling tilt normals, so no eigenvalue is zero to rounding; below a twentieth of the largest is free."""


@dataclass(frozen=True, eq=False)
class Run:
    """A run so far. partners: (m, 3) the target point of each source point. residual: the RMS of what is minimised,
    over the used pairs, u. free: how many of the six directions of motion the pairs leave free; None if unknown.
    """

    task: str
    scene: Mug
    pose: Pose
    steps: int
    partners: Array
    used: int
    residual: float
    free: int | None
    done: bool
    reason: str
    batch: Batch[Any] | None = None

    @property
    def moved(self) -> Array:
        """The source points at the current pose, (m, 3)."""
        return self.pose.apply(self.scene.source)

    @property
    def rotation(self) -> float:
        """The rotation error against the truth, degrees."""
        return float(np.degrees(rre(self.pose, self.scene.truth)))

    @property
    def away(self) -> float:
        """The RMS distance of the mug's lines from their true positions, u."""
        return float(point_error(self.pose, self.scene.truth, np.concatenate(self.scene.outline)))

    def step(self, spin: float) -> Run:
        """The run after one more step. spin: the turn that pairs in a line leave free, radians."""
        if self.done:
            return self
        if self.batch is not None:
            return _batch_run(self.task, self.scene, advance(self.batch), self.steps + 1)
        return replace(_paired_run(self.task, self.scene, solved(self.task, self.scene, spin), True), steps=1)


@lru_cache(maxsize=4)
def scene_of(task: str, seed: int, noise: float, overlap: float, handle: bool) -> Mug:
    """The clouds of a task."""
    if task in UNKNOWN:
        return mug(seed, noise=noise, overlap=overlap, handle=handle)
    return mug_pairs(task, seed=seed, noise=noise)


def begun(task: str, scene: Mug, turn: float) -> Run:
    """A run before its first step; turn: that of the start, degrees."""
    start = mug_start(turn, OFFSET)
    if task not in UNKNOWN:
        return _paired_run(task, scene, start, False)
    weights, seed = np.ones((1, len(scene.source))), np.array([scene.seed])
    problem = Problem(scene.source[None], scene.target[None], weights, alone(start), seed)
    method = METHODS[UNKNOWN[task]]
    return _batch_run(task, scene, begin(method, problem, method.options(**OPTIONS[task]), STEPS), 0)


def solved(task: str, scene: Mug, spin: float) -> Pose:
    """The closed form's pose; for pairs in a line, the one that `spin`, in radians, selects."""
    if task == "line":
        return poses_about_line(scene.source, scene.target, spin)
    return fit_rigid(scene.source, scene.target).pose


def _paired_run(task: str, scene: Mug, pose: Pose, done: bool) -> Run:
    line = task == "line"
    reason = ("the rotation about the line is free" if line else "the pairs fix the pose") if done else ""
    residual = float(rms(pose, scene.source, scene.target))
    free = int(line) if done else None
    return Run(task, scene, pose, 0, scene.target, len(scene.source), residual, free, done, reason)


def _batch_run(task: str, scene: Mug, batch: Batch[Any], steps: int) -> Run:
    state = batch.state()
    pairing = state.pairing
    pose = single(state.pose)
    free = int(state.system.free[0].sum()) if task == "plane" else None
    status = Status(int(state.status[0]))
    reason = "" if status is Status.RUNNING else worded(str(state.reason[0]))
    partners = state.index.points[0, pairing.rows[0]]
    count, residual = int(pairing.count[0]), float(pairing.rms[0])
    return Run(task, scene, pose, steps, partners, count, residual, free, batch.done, reason, batch)
