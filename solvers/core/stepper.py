"""The one loop that every method runs in.

A method is a pair of functions, `start(problem, options) -> state` and
`step(state) -> state`, on a whole batch: every array has the problems as its leading
axis b, and no problem may see another. States are frozen. The loop takes a problem out
of the batch when its status says that it has stopped, so a step only ever sees running
problems.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from solvers.core.arrays import BoolArray, FloatArray, IntArray
from solvers.core.brief import brief
from solvers.core.extent import mark_narrow, mark_points
from solvers.core.log import debug
from solvers.core.method import Method, Problem, S
from solvers.core.pose import Pose
from solvers.core.poses import stacked
from solvers.core.status import Status, mark
from solvers.core.tree import changed, put, take, uneven

T = TypeVar("T")
_EACH = ("objective", "status", "reason")
_RUNNING = int(Status.RUNNING)  # numpy takes five times as long to compare with an enum's member


@dataclass(frozen=True, eq=False)
class Batch(Generic[S]):
    """A run in progress, immutable.

    Keep it, advance it when there is time, drop it to stop. `state()` gives the current
    states; `pose()` and `objective()` copy less.

    Attributes
    ----------
    method : Method
        The method that is run.
    max_steps : int
        The step limit.
    whole : State
        The states of all b problems, up to date for those that have stopped.
    rows : ndarray of int64
        The problems still running, ascending.
    part : State
        The states of those, up to date.
    steps : ndarray of int64, shape (b,)
        The steps that each problem has taken.

    Examples
    --------
    >>> from solvers.race import CONTESTANTS, Controls, race_problem
    >>> problem, truth = race_problem(Controls(), seeds=[40, 53])
    >>> batch = CONTESTANTS[0].begin(problem)
    >>> batch.done, batch.steps, batch.pose().batch
    (False, array([0, 0]), (2,))
    >>> bool((batch.state().objective == batch.objective()).all())
    True
    """

    method: Method[S]
    max_steps: int
    whole: S
    rows: IntArray
    part: S
    steps: IntArray

    def __repr__(self) -> str:
        running = f"{self.rows.size} of {self.steps.size} running"
        return f"Batch({self.method.name}: {running}, at most {self.max_steps} steps)"

    @property
    def done(self) -> bool:
        """Whether every problem has stopped."""
        return self.rows.size == 0

    def state(self) -> S:
        """The current states of all b problems."""
        return self._now(self.whole, self.part)

    def pose(self) -> Pose:
        """The current poses of all b problems, (b,)."""
        return self._now(self.whole.pose, self.part.pose)

    def objective(self) -> FloatArray:
        """The objective of all b problems at `pose()`, (b,)."""
        return self._now(self.whole.objective, self.part.objective)

    def _now(self, whole: T, part: T) -> T:
        if self.done:
            return whole
        # Nothing to copy while none has stopped.
        return part if self.rows.size == self.steps.size else put(whole, self.rows, part)


def begin(method: Method[S], problem: Problem, options: Any = None, max_steps: int | None = None) -> Batch[S]:
    """Put every problem at its start, with no step taken.

    Unless the method has `any_extent`, a problem whose clouds are both narrower than
    1e-130 u, but not both single points, is degenerate. So is, once it stops, a problem
    with a cloud whose points are all equal.

    Parameters
    ----------
    method : Method
        An entry of `solvers.METHODS`.
    problem : Problem
        The problems, which are not checked here.
    options : object, optional
        An instance of `method.options`. None is its defaults.
    max_steps : int, optional
        The most steps; with 0 all are capped at once. None is the method's own cap.

    Returns
    -------
    Batch
        The run at its beginning.

    Examples
    --------
    >>> from solvers import METHODS
    >>> from solvers.race import Controls, race_problem
    >>> from solvers.stepper import begin
    >>> problem, truth = race_problem(Controls(), seeds=[40])
    >>> begin(METHODS["icp"], problem, max_steps=0).state().reason[0]
    'the cap of 0 steps was reached'
    """
    cap = method.max_steps if max_steps is None else max_steps
    steps = np.zeros(problem.size, dtype=np.int64)
    with np.errstate(under="ignore"):  # a weight that underflows is zero, even if the caller has numpy raise
        state = _sized(method, method.start(problem, method.options() if options is None else options), problem.size)
        state = mark_points(_cap(state if method.any_extent else mark_narrow(state, problem), steps, cap))
    rows = np.flatnonzero(state.status == _RUNNING).astype(np.int64)
    return Batch(method, cap, state, rows, state if rows.size == problem.size else take(state, rows), steps)


def advance(batch: Batch[S]) -> Batch[S]:
    """One step of every problem still running; those that stop leave the batch.

    A step whose pose or objective is not finite is undone for that problem, which is
    then degenerate.

    Parameters
    ----------
    batch : Batch
        The run so far. A finished one is returned as it is.

    Returns
    -------
    Batch
        The run one step on.

    Raises
    ------
    TypeError
        If the method's step has changed the dtype or the trailing shape of a field of
        its state, or does not give a state with one pose, objective, status and reason
        per problem, and one entry of every other array: a bug in the method.

    Examples
    --------
    >>> from solvers.race import CONTESTANTS, Controls, race_problem
    >>> from solvers.stepper import advance
    >>> problem, truth = race_problem(Controls(), seeds=[40])
    >>> batch = CONTESTANTS[0].begin(problem)
    >>> advance(batch).objective() < batch.objective()
    array([ True])
    """
    if batch.done:
        return batch
    with np.errstate(under="ignore"):
        return _advanced(batch)


def _advanced(batch: Batch[S]) -> Batch[S]:
    """`advance` for a run that is not done."""
    rows = batch.rows
    part = _undo_nonfinite(batch.part, _sized(batch.method, batch.method.step(batch.part), rows.size))
    steps = batch.steps.copy()
    steps[rows] += 1
    part = _cap(part, steps[rows], batch.max_steps)
    stopped = part.status != _RUNNING
    if not stopped.any():
        return changed(batch, part=part, steps=steps)
    part = mark_points(part)
    if stopped.all() and rows.size == steps.size:  # a single problem, for one: nothing to sort out
        return changed(batch, whole=part, rows=rows[:0], part=take(part, rows[:0]), steps=steps)
    whole = put(batch.whole, rows[stopped], take(part, stopped))
    return changed(batch, whole=whole, rows=rows[~stopped], part=take(part, ~stopped), steps=steps)


@dataclass(frozen=True, eq=False)
class History:
    """The course of a run, from the start to the last of k steps.

    Attributes
    ----------
    poses : Pose
        Of shape (k + 1, ...); a problem that stopped earlier repeats its last pose.
    objective : ndarray of shape (k + 1, ...)
        The function that the method minimises, at these poses.

    Examples
    --------
    >>> from solvers import register
    >>> result = register([[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]], "kabsch")
    >>> result.history.objective.round(6)
    array([2., 0.])
    """

    poses: Pose
    objective: FloatArray

    __repr__ = brief


Callback = Callable[[int, Any], Any]


def run(batch: Batch[S], callback: Callback | None = None) -> tuple[Batch[S], History]:
    """Advance until every problem has stopped.

    Parameters
    ----------
    batch : Batch
        The run so far, as from `begin`.
    callback : callable, optional
        Called as `callback(k, state)` after step k = 1, 2, … with the state of all b
        problems. Returning a true value ends the run there, and problems still running
        keep `Status.RUNNING`.

    Returns
    -------
    batch : Batch
        The run at its end.
    history : History
        Its course, with the axis of the steps before that of the problems.

    Examples
    --------
    >>> from solvers import METHODS
    >>> from solvers.race import Controls, race_problem
    >>> from solvers.stepper import begin, run
    >>> problem, truth = race_problem(Controls(setting="clean"), seeds=[40, 53])
    >>> batch, history = run(begin(METHODS["icp"], problem), lambda k, state: k == 3)
    >>> batch.steps, history.objective.shape
    (array([3, 3]), (4, 2))
    """
    poses, objective = [batch.pose()], [batch.objective()]
    k = 0
    while not batch.done:
        batch = advance(batch)
        k += 1
        poses.append(batch.pose())
        objective.append(batch.objective())
        debug("%s: step %d, %d of %d still running", batch.method.name, k, batch.rows.size, batch.steps.size)
        if callback is not None and callback(k, batch.state()):
            break
    return batch, History(stacked(poses), np.stack(objective))


def _sized(method: Method[S], state: S, count: int) -> S:
    """Return a method's state if it is one of `count` problems, else raise TypeError."""
    if not isinstance(pose := getattr(state, "pose", None), Pose):
        found = f"one whose pose is of type {type(pose).__name__}" if hasattr(state, "pose") else type(state).__name__
        raise TypeError(f"method {method.name!r}: expected a state with a Pose, got {found}")
    shapes = (("pose", pose.batch), *((name, np.shape(getattr(state, name))) for name in _EACH))
    for name, shape in shapes:
        if shape != (count,):
            raise TypeError(f"method {method.name!r}: {name}: expected shape ({count},), one per problem, got {shape}")
    if other := uneven(state, count):
        name, shape = other
        raise TypeError(f"method {method.name!r}: {name}: expected shape ({count}, ...), one per problem, got {shape}")
    return state


def _cap(state: S, steps: IntArray, max_steps: int) -> S:
    if (steps < max_steps).all():
        return state
    over: BoolArray = (steps >= max_steps) & (state.status == _RUNNING)
    if not over.any():
        return state
    status, reason = mark(state.status, state.reason, over, Status.CAPPED, f"the cap of {max_steps} steps was reached")
    return changed(state, status=status, reason=reason)


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
    mixed = put(after, bad, take(before, bad))
    status, reason = mark(mixed.status, mixed.reason, bad, Status.DEGENERATE, "the step left the range of numbers")
    return changed(mixed, status=status, reason=reason)
