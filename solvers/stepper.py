"""The one loop that every method runs in, and what a method must offer to run in it.

A method is a pair of functions, `start(problem, options) -> state` and `step(state) -> state`. States are frozen; a
step makes a new one. Both work on a whole batch: every array has the problems as its leading axis b (one problem is a
batch of one), and no problem may see another. The loop takes a problem out of the batch when its status says that it
has stopped, so a step only ever sees running problems, and may be written without a thought for the others.

How to add a method
-------------------
1. A module with a frozen options dataclass, whose `__post_init__` refuses bad values by `solvers.validate` (a
   ValueError that names the option), and a frozen state dataclass with at least the fields of `State`: `problem`
   (declared as `field(metadata=CONSTANT)`), `pose`, `objective`, `status`, `reason`, and whatever a figure is to show:
   pairs, weights, cells … The options ride along as `field(metadata=SHARED)`. `solvers.rows` says what a field may
   hold.
2. `start` fills the state at `problem.start`. What is precomputed (normals, a map) is another constant field. All
   random numbers of the run are drawn here, per problem, by `numpy.random.default_rng(problem.seed[i])`; no generator
   is kept. A problem that is hopeless from the outset gets `Status.DEGENERATE` and a reason (`solvers.status.mark`).
3. `step` returns `dataclasses.replace(state, pose=…, objective=…, status=…, …)`: running, converged, stalled or
   degenerate, the last two with a reason where words help. It must not raise for geometry and must not write into
   arrays.
4. A `Method(...)` with name, summary and source, added to the list in `solvers/methods.py`.
tests/solvers/test_methods.py then says where else its name belongs: the docs' list and, where it needs no pairs,
`widgets/own_methods.py`. The front door, the race, the benchmark and the figures find it by that list.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from solvers.arrays import BoolArray, FloatArray, IntArray, ReasonArray, StatusArray
from solvers.pose import Pose
from solvers.rows import put, take
from solvers.status import Status, mark


@dataclass(frozen=True, eq=False)
class Problem:
    """b registration problems, already validated.

    source: (b, m, d), the cloud that is moved. target: (b, n, d), the cloud that stays. Paired methods get m = n with
    row i's partner in row i. weights: (b, m) of the source rows (of the pairs, when paired). start: b poses.
    seed: (b,) int64.
    """

    source: FloatArray
    target: FloatArray
    weights: FloatArray
    start: Pose
    seed: IntArray

    @property
    def size(self) -> int:
        """b, the number of problems."""
        return int(self.source.shape[0])

    @property
    def dim(self) -> int:
        """d, the number of coordinates of a point."""
        return int(self.source.shape[-1])


class State(Protocol):
    """What every method's state carries, whatever else it does; all of leading axis b."""

    @property
    def problem(self) -> Problem: ...
    @property
    def pose(self) -> Pose: ...
    @property
    def objective(self) -> FloatArray:
        """(b,) what the method minimises, at `pose`."""

    @property
    def status(self) -> StatusArray: ...
    @property
    def reason(self) -> ReasonArray: ...


S = TypeVar("S", bound=State)
T = TypeVar("T")


@dataclass(frozen=True)
class NoOptions:
    """The options of a method that has none."""


@dataclass(frozen=True, eq=False)
class Method(Generic[S]):
    """A registration method, as `solvers.METHODS` lists it.

    name: what `register(method=…)` calls it. summary: one line. source: the paper it follows.
    options: the frozen dataclass of its own options, with defaults.
    paired: matches row i with row i, and takes `pairs`. weighted: takes `weights`.
    dims: the dimensions it works in, or None for any. max_steps: the usual cap.
    """

    name: str
    summary: str
    source: str
    start: Callable[[Problem, Any], S]
    step: Callable[[S], S]
    options: type = NoOptions
    paired: bool = False
    weighted: bool = False
    dims: tuple[int, ...] | None = (2,)
    max_steps: int = 70


@dataclass(frozen=True, eq=False)
class Batch(Generic[S]):
    """A run in progress, immutable: hold it, step it when there is time, forget it to stop.

    whole: all b problems, each finished one as it ended. rows: the problems still running, ascending. part: their
    states. steps: (b,) taken by each so far. Read the present by `state()`, or by `pose()` and `objective()`, which
    copy less.
    """

    method: Method[S]
    max_steps: int
    whole: S
    rows: IntArray
    part: S
    steps: IntArray

    @property
    def done(self) -> bool:
        """Whether every problem has stopped."""
        return self.rows.size == 0

    def state(self) -> S:
        """The states of all b problems as they stand."""
        return self._now(self.whole, self.part)

    def pose(self) -> Pose:
        """The poses of all b problems as they stand."""
        return self._now(self.whole.pose, self.part.pose)

    def objective(self) -> FloatArray:
        """The objective of all b problems as it stands, (b,)."""
        return self._now(self.whole.objective, self.part.objective)

    def _now(self, whole: T, part: T) -> T:
        if self.done:
            return whole
        # Nothing to copy while none has stopped.
        return part if self.rows.size == self.steps.size else put(whole, self.rows, part)


def begin(method: Method[S], problem: Problem, options: Any = None, max_steps: int | None = None) -> Batch[S]:
    """Every problem at its start, no step taken. `options` is an instance of `method.options`, default its defaults;
    with `max_steps` 0 all are capped at once."""
    state = method.start(problem, method.options() if options is None else options)
    cap = method.max_steps if max_steps is None else max_steps
    steps = np.zeros(problem.size, dtype=np.int64)
    state = _cap(state, steps, cap)
    rows = np.flatnonzero(state.status == Status.RUNNING).astype(np.int64)
    return Batch(method, cap, state, rows, state if rows.size == problem.size else take(state, rows), steps)


def advance(batch: Batch[S]) -> Batch[S]:
    """One step of every problem still running; those that stop leave the batch. A finished batch is returned as it is.

    A step whose pose or objective is not finite is undone for that problem, which is then degenerate.
    """
    if batch.done:
        return batch
    rows = batch.rows
    part = _undo_nonfinite(batch.part, batch.method.step(batch.part))
    steps = batch.steps.copy()
    steps[rows] += 1
    part = _cap(part, steps[rows], batch.max_steps)
    stopped = part.status != Status.RUNNING
    if not stopped.any():
        return replace(batch, part=part, steps=steps)
    if stopped.all() and rows.size == steps.size:  # as a single problem does: nothing to sort out
        return replace(batch, whole=part, rows=rows[:0], part=take(part, rows[:0]), steps=steps)
    whole = put(batch.whole, rows[stopped], take(part, stopped))
    return replace(batch, whole=whole, rows=rows[~stopped], part=take(part, ~stopped), steps=steps)


@dataclass(frozen=True, eq=False)
class History:
    """The course of a run: poses (k + 1, …) and objective (k + 1, …), from the start to the last of k steps.
    A problem that stopped earlier repeats its last entry."""

    poses: Pose
    objective: FloatArray


Callback = Callable[[int, Any], Any]


def run(batch: Batch[S], callback: Callback | None = None) -> tuple[Batch[S], History]:
    """Advance until every problem has stopped.

    callback(k, state) is called after step k = 1, 2, … with the state of all b problems; a true answer ends the run
    there, and what was running is said to be running still.
    """
    poses, objective = [batch.pose()], [batch.objective()]
    k = 0
    while not batch.done:
        batch = advance(batch)
        k += 1
        poses.append(batch.pose())
        objective.append(batch.objective())
        if callback is not None and callback(k, batch.state()):
            break
    course = Pose(
        np.stack([p.R for p in poses]), np.stack([p.t for p in poses]), np.stack([np.asarray(p.scale) for p in poses])
    )
    return batch, History(course, np.stack(objective))


def _cap(state: S, steps: IntArray, max_steps: int) -> S:
    over: BoolArray = (steps >= max_steps) & (state.status == Status.RUNNING)
    if not over.any():
        return state
    status, reason = mark(state.status, state.reason, over, Status.CAPPED, f"the cap of {max_steps} steps was reached")
    return replace(state, status=status, reason=reason)  # type: ignore[type-var]


def _undo_nonfinite(before: S, after: S) -> S:
    pose = after.pose
    finite = (
        np.isfinite(pose.R).all(axis=(-2, -1))
        & np.isfinite(pose.t).all(axis=-1)
        & np.isfinite(pose.scale)
        & np.isfinite(after.objective)
    )
    if finite.all():
        return after
    bad = ~finite
    kept = put(after, bad, take(before, bad))
    status, reason = mark(kept.status, kept.reason, bad, Status.DEGENERATE, "the step left the range of numbers")
    return replace(kept, status=status, reason=reason)  # type: ignore[type-var]
