"""A run of nearest-point registration as a figure shows it: both halves of every step, and errors against the truth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from solvers import METHODS, Pose, Status
from solvers.core.stepper import Batch, advance, begin
from solvers.methods.icp.icp import IcpState, Pairing, pair
from solvers.metrics import rre, rte
from solvers.scenes.rooms import Scene
from widgets.parts.room import alone, problem, single

RISE = 1e-9  # relative: a smaller rise is rounding error


@dataclass(frozen=True)
class Rule:
    """How pairs are chosen: a method with its options, and whether its objective and its RMS can never rise."""

    method: str
    options: dict[str, float]
    objective_falls: bool
    rms_falls: bool


@dataclass(frozen=True)
class Entry:
    """One pose of the course. moved: the RMS at this pose of the pairs that the last step fitted, u (NaN at the start).
    changed: how many points have a new partner. mean: √(objective / points), u."""

    rms: float
    moved: float
    used: int
    changed: int
    mean: float
    rotation: float
    translation: float


@dataclass(frozen=True, eq=False)
class Run:
    """A run so far. began: its start. truth: the pairs at the true pose, by the same rule."""

    rule: Rule
    scene: Scene
    began: Pose
    batch: Batch[IcpState]
    course: tuple[Entry, ...]
    truth: Pairing

    @property
    def now(self) -> IcpState:
        """The solver's state, a batch of one."""
        return self.batch.state()

    @cached_property
    def pose(self) -> Pose:
        """The source's current pose."""
        return single(self.batch.pose())

    @property
    def steps(self) -> int:
        """The number of steps taken so far."""
        return len(self.course) - 1

    @property
    def done(self) -> bool:
        """Whether the run has stopped."""
        return self.batch.done

    @property
    def status(self) -> Status:
        """The solver's status."""
        return Status(int(self.now.status[0]))

    @property
    def reason(self) -> str:
        """Why the run stopped, in words."""
        return str(self.now.reason[0])

    @property
    def rises(self) -> tuple[int, ...]:
        """The steps after which the RMS over the used pairs was larger than before."""
        rms = [entry.rms for entry in self.course]
        return tuple(k for k in range(1, len(rms)) if rms[k] > rms[k - 1] * (1 + RISE))

    def step(self) -> Run:
        """The run after one more step; a run that has stopped stays as it is."""
        if self.done:
            return self
        batch = advance(self.batch)
        entry = _entry(self.scene, batch.state(), self.now)
        return replace(self, batch=batch, course=(*self.course, entry))


def begun(rule: Rule, scene: Scene, start: Pose, steps: int, truth: Pairing | None = None) -> Run:
    """A run of the scene from `start`, before its first of at most `steps` steps. truth: taken from another run of the
    scene by the same rule, if there is one."""
    method = METHODS[rule.method]
    batch = begin(method, problem(scene, start), method.options(**rule.options), steps)
    state: IcpState = batch.state()
    if truth is None:
        truth = pair(state.problem, state.index, state.reach, state.scale, state.options, alone(scene.truth))
    return Run(rule, scene, start, batch, (_entry(scene, state, None),), truth)


def _entry(scene: Scene, state: IcpState, before: IcpState | None) -> Entry:
    pairing, pose = state.pairing, single(state.pose)
    moved, changed = np.nan, 0
    if before is not None:
        previous = before.pairing
        squares = np.square(pairing.moved[0] - state.index.points[0, previous.rows[0]]).sum(axis=1)
        moved = float(np.sqrt(squares[previous.used[0]].mean()))
        changed = int((previous.rows[0] != pairing.rows[0]).sum())
    return Entry(
        rms=float(pairing.rms[0]),
        moved=moved,
        used=int(pairing.count[0]),
        changed=changed,
        mean=float(np.sqrt(state.objective[0] / len(scene.source))),
        rotation=float(np.degrees(rre(pose, scene.truth))),
        translation=float(rte(pose, scene.truth)),
    )
