"""The loop and the row mechanism, on a method made for this: a pose that halves its distance to the target's
centroid."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from solvers import Pose, Status
from solvers.core.arrays import FloatArray, ReasonArray, StatusArray
from solvers.core.method import Method, Problem
from solvers.core.status import mark, reasons, statuses
from solvers.core.stepper import advance, begin, run
from solvers.core.tree import CONSTANT, SHARED, put, take


@dataclass(frozen=True)
class HalvingOptions:
    tolerance: float = 1e-3
    breaks_beyond: float = np.inf  # of the pose
    worth_beyond: float = np.inf  # of the objective


@dataclass(frozen=True, eq=False)
class HalvingState:
    problem: Problem = field(metadata=CONSTANT)
    options: HalvingOptions = field(metadata=SHARED)
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray
    offsets: tuple[FloatArray, ...]
    nothing: None = None


SEEN: list[int] = []


def halving_start(problem, options):
    gap = (problem.target - problem.start.apply(problem.source)).mean(axis=1)
    size = np.linalg.norm(gap, axis=-1)
    status, reason = mark(
        statuses((problem.size,)), reasons((problem.size,)), size > 1e6, Status.DEGENERATE, "too far to begin"
    )
    return HalvingState(problem, options, problem.start, size, status, reason, (gap, size))


def halving_step(state):
    assert np.all(state.status == Status.RUNNING)
    SEEN.append(len(state.objective))
    gap = 0.5 * state.offsets[0]
    size = np.linalg.norm(gap, axis=-1)
    status, reason = mark(state.status, state.reason, size < state.options.tolerance, Status.CONVERGED)
    with np.errstate(invalid="ignore"):
        t = np.where((size > state.options.breaks_beyond)[:, None], np.nan, state.pose.t + gap)
        size = np.where(size > state.options.worth_beyond, np.inf, size)
    return replace(
        state, pose=Pose.trusted(state.pose.R, t), objective=size, status=status, reason=reason, offsets=(gap, size)
    )


HALVING = Method("halving", "halve the gap", "none", halving_start, halving_step, HalvingOptions, max_steps=50)


def problems(*distances):
    b = len(distances)
    source = np.tile([[0.0, -1.0], [0.0, 0.0], [0.0, 1.0]], (b, 1, 1))
    target = source.copy()
    target[:, :, 0] = np.array(distances)[:, None]
    return Problem(source, target, np.ones((b, 3)), Pose.identity(2, (b,)), np.arange(b))


def test_finished_problems_leave_the_batch():
    """Each step works only on the problems still running, and each problem stops after its own number of steps."""
    SEEN.clear()
    batch, _ = run(begin(HALVING, problems(1.0, 100.0, 0.1, 10.0)))
    assert batch.done
    assert batch.steps.tolist() == [10, 17, 7, 14]
    assert SEEN == [4] * 7 + [3] * 3 + [2] * 4 + [1] * 3
    assert batch.state().status.tolist() == [Status.CONVERGED] * 4


def test_the_loop_gives_each_problem_what_it_gets_alone():
    distances = (1.0, 100.0, 0.1, 10.0)
    batch, course = run(begin(HALVING, problems(*distances)))
    for i, distance in enumerate(distances):
        alone, own = run(begin(HALVING, problems(distance)))
        assert batch.steps[i] == alone.steps[0]
        assert np.array_equal(batch.pose()[i].t, alone.pose()[0].t)
        k = int(alone.steps[0])
        assert np.array_equal(course.objective[: k + 1, i], own.objective[:, 0])
        assert np.all(course.objective[k:, i] == own.objective[-1, 0])
        assert np.array_equal(course.poses.t[: k + 1, i], own.poses.t[:, 0])


def test_the_cap_stops_and_is_called_the_cap():
    """A problem still running at the last allowed step is 'capped', never 'converged'."""
    batch, course = run(begin(HALVING, problems(1.0, 100.0), max_steps=12))
    assert batch.state().status.tolist() == [Status.CONVERGED, Status.CAPPED]
    assert batch.state().reason[1] == "the cap of 12 steps was reached"
    assert course.objective.shape == (13, 2)
    zero_steps, course = run(begin(HALVING, problems(1.0), max_steps=0))
    assert zero_steps.state().status.tolist() == [Status.CAPPED]
    assert zero_steps.steps.tolist() == [0]
    assert course.poses.batch == (1, 1)


def test_a_problem_hopeless_from_the_start_takes_no_step():
    batch, _ = run(begin(HALVING, problems(1e9, 1.0)))
    assert batch.state().status.tolist() == [Status.DEGENERATE, Status.CONVERGED]
    assert batch.state().reason.tolist() == ["too far to begin", ""]
    assert batch.steps.tolist() == [0, 10]


@pytest.mark.parametrize("breaks", ["breaks_beyond", "worth_beyond"])
def test_a_step_that_is_not_finite_is_undone(breaks):
    """A step whose pose or objective is not finite is taken back and its problem is degenerate; the others go on."""
    batch, course = run(begin(HALVING, problems(1.0, 100.0), HalvingOptions(**{breaks: 20.0})))
    state = batch.state()
    assert state.status.tolist() == [Status.CONVERGED, Status.DEGENERATE]
    assert "range of numbers" in state.reason[1]
    assert np.array_equal(state.pose.t[1], [0.0, 0.0])
    assert np.isfinite(course.objective).all()


def test_a_batch_is_never_changed_by_stepping():
    """Stepping makes a new batch: an old one can be kept and stepped again with the same result."""
    first = begin(HALVING, problems(1.0, 0.002))
    a, b = advance(first), advance(first)
    assert first.steps.tolist() == [0, 0]
    assert first.state().objective.tolist() == [1.0, 0.002]
    assert np.array_equal(a.state().objective, b.state().objective)
    latest = advance(advance(a))
    assert a.rows.tolist() == [0, 1]
    assert latest.rows.tolist() == [0]
    end, _ = run(first)
    assert advance(end) is end


def test_a_callback_sees_every_step_and_may_end_the_run():
    calls = []

    def watch(k, state):
        calls.append((k, len(state.objective), float(state.objective[0])))
        return k == 3

    batch, course = run(begin(HALVING, problems(1.0, 0.001)), watch)
    assert calls == [(1, 2, 0.5), (2, 2, 0.25), (3, 2, 0.125)]
    assert batch.state().status.tolist() == [Status.RUNNING, Status.CONVERGED]
    assert len(course.objective) == 4


def test_taking_rows_and_putting_them_back_changes_nothing_else():
    state = begin(HALVING, problems(1.0, 2.0, 3.0)).whole
    part = take(state, np.array([2, 0]))
    assert part.objective.tolist() == [3.0, 1.0]
    assert part.problem.target[0, 0, 0] == 3.0
    assert part.offsets[1].tolist() == [3.0, 1.0]
    assert part.options is state.options
    result = put(state, np.array([2, 0]), replace(part, objective=np.array([30.0, 10.0])))
    assert result.objective.tolist() == [10.0, 2.0, 30.0]
    assert result.problem is state.problem
    assert state.objective.tolist() == [1.0, 2.0, 3.0]
    mask = np.array([False, True, False])
    assert take(state, mask).objective.tolist() == [2.0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"objective": np.zeros(1, dtype=np.float32)}, r"HalvingState\.objective: was float64\[\]"),
        ({"pose": Pose.identity(3, (1,))}, r"HalvingState\.pose\.R"),
        ({"offsets": (np.zeros((1, 3)), np.zeros(1))}, r"HalvingState\.offsets\[0\]"),
        ({"nothing": 3}, r"HalvingState\.nothing: was NoneType"),
    ],
)
def test_a_field_that_changes_its_kind_is_named(change, message):
    """If a method changes the shape or type of a state field between steps, the error names the field."""
    state = begin(HALVING, problems(1.0, 2.0)).whole
    part = replace(take(state, np.array([1])), **change)
    with pytest.raises(TypeError, match=message):
        put(state, np.array([1]), part)


def test_only_what_still_runs_is_marked():
    status, reason = mark(
        np.array([0, 1, 0], dtype=np.int8), reasons((3,)), np.array([True, True, False]), Status.STALLED, "no way down"
    )
    assert status.tolist() == [Status.STALLED, Status.CONVERGED, Status.RUNNING]
    assert status.dtype == np.int8
    assert reason.tolist() == ["no way down", "", ""]
    labels = ["running", "converged", "stalled", "capped", "degenerate", "proved", "finished"]
    assert [s.label for s in Status] == labels


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"objective": 0.0}, r"method 'halving': objective: expected shape \(2,\), one per problem, got \(\)"),
        ({"pose": Pose.identity()}, r"method 'halving': pose: expected shape \(2,\), one per problem, got \(\)"),
        ({"status": np.zeros(3, dtype=np.int8)}, r"method 'halving': status: .* got \(3,\)"),
        ({"nothing": np.zeros((3, 2))}, r"method 'halving': nothing: expected shape \(2, \.\.\.\), .* got \(3, 2\)"),
        ({"nothing": np.zeros(())}, r"method 'halving': nothing: .* got \(\)"),
        ({"pose": np.eye(3)}, "method 'halving': expected a state with a Pose, got one whose pose is of type ndarray$"),
    ],
)
def test_a_method_that_does_not_answer_for_each_problem_is_told_of_what(change, message):
    with pytest.raises(TypeError, match=message):
        begin(replace(HALVING, start=lambda problem, options: replace(HALVING.start(problem, options), **change)),
              problems(1.0, 2.0))  # fmt: skip
    batch = begin(replace(HALVING, step=lambda state: replace(HALVING.step(state), **change)), problems(1.0, 2.0))
    with pytest.raises(TypeError, match=message):
        advance(batch)


@pytest.mark.parametrize("answer", [None, np.eye(3)])
def test_a_method_that_answers_with_no_state_is_told_so(answer):
    message = f"method 'halving': expected a state with a Pose, got {type(answer).__name__}$"
    with pytest.raises(TypeError, match=message):
        begin(replace(HALVING, start=lambda problem, options: answer), problems(1.0))
    with pytest.raises(TypeError, match=message):
        advance(begin(replace(HALVING, step=lambda state: answer), problems(1.0)))
