"""Methods passed as objects: a listed one, changed or not, or the user's own."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.core.arrays import FloatArray, ReasonArray, StatusArray
from solvers.scenes import room, room_start
from solvers.stepper import Method, NoOptions, Problem
from solvers.uncertainty import from_matrix, from_starts, monte_carlo
from solvers.verify import halves

SCENE, START = room("clean"), room_start(20.0, 0.8)


@dataclass(frozen=True)
class Options:
    share: float = 1.0


@dataclass(frozen=True, eq=False)
class Centred:
    problem: Problem
    share: FloatArray
    pose: Pose
    objective: FloatArray
    status: StatusArray
    reason: ReasonArray


def start(problem: Problem, options: Options) -> Centred:
    b = problem.size
    share = np.full(b, options.share)
    return Centred(problem, share, problem.start, np.full(b, 1.0), np.zeros(b, np.int8), np.full(b, "", dtype=object))


def step(state: Centred) -> Centred:
    p, q = state.pose.apply(state.problem.source).mean(axis=1), state.problem.target.mean(axis=1)
    pose = Pose(state.pose.R, state.pose.t + state.share[:, None] * (q - p))
    return replace(state, pose=pose, status=np.full(len(p), Status.FINISHED, dtype=np.int8))


CENTRED = Method(
    "centred", "one centroid on the other", "nobody", start, step, Options,
    partners=lambda state: np.tile(np.arange(state.problem.source.shape[1]) % 3 - 1, (state.problem.size, 1)),
)  # fmt: skip


def test_a_method_of_one_s_own_runs() -> None:
    """It runs alone, in a batch and in a list, with its own options and partners."""
    result = register(SCENE.source, SCENE.target, CENTRED, share=0.5)
    assert (result.method, result.status) == ("centred", Status.FINISHED)
    assert np.allclose(result.pose.t, 0.5 * (SCENE.target.mean(axis=0) - SCENE.source.mean(axis=0)))
    assert set(result.correspondences.tolist()) == {-1, 0, 1}
    assert result.fitness == pytest.approx(2 / 3, abs=0.01)
    assert result.rmse > 0.0
    assert result.covariance is None
    batch = register([SCENE.source, SCENE.source], [SCENE.target] * 2, CENTRED, share=0.5)
    assert batch[1].pose == result.pose
    assert np.array_equal(batch[1].correspondences, result.correspondences)
    with pytest.raises(ValueError, match=r"^shares: no option of method 'centred', did you mean 'share'"):
        register(SCENE.source, SCENE.target, CENTRED, shares=0.5)
    bare = replace(CENTRED, name="bare", options=NoOptions, weighted=False)
    with pytest.raises(ValueError, match=r"^xyzzy: no option of method 'bare'; it takes no options$"):
        register(SCENE.source, SCENE.target, bare, xyzzy=1)


def test_a_listed_method_is_itself() -> None:
    by_name = register(SCENE.source, SCENE.target, "icp", start=START, gate=2.6)
    by_method = register(SCENE.source, SCENE.target, METHODS["icp"], start=START, gate=2.6)
    assert by_method.pose == by_name.pose
    assert pickle.loads(pickle.dumps(by_method)).pose == by_name.pose
    patient = replace(METHODS["icp"], max_steps=2)
    few = register(SCENE.source, SCENE.target, patient, start=START, gate=2.6)
    assert few.status is Status.CAPPED
    assert few.correspondences is not None


def test_what_registers_for_the_user_takes_it_too() -> None:
    for method in (METHODS["icp"], CENTRED):
        assert np.isfinite(halves(SCENE.source, SCENE.target, START, method))
        assert len(monte_carlo(np.stack([SCENE.source] * 3), SCENE.target, method).poses.t) == 3
        spread = from_starts(SCENE.source, SCENE.target, method, start=from_matrix(1e-4 * np.eye(3), START))
        assert np.isfinite(spread.deviations).all()


def test_what_is_no_method_is_refused() -> None:
    """So is a method with another's name, since it would be credited with that one's partners and covariance."""
    with pytest.raises(ValueError, match=r"^method: 'icp' is the name of another method; give it one of its own$"):
        register(SCENE.source, SCENE.target, replace(CENTRED, name="icp"))
    with pytest.raises(ValueError, match=r"^method: 'icp' is the name of another method"):
        register(SCENE.source, SCENE.target, replace(METHODS["icp"], partners=None))
    for wrong in (None, 3, step, Method):
        with pytest.raises(ValueError, match=r"^method: .* is unknown.*; known: "):
            register(SCENE.source, SCENE.target, wrong)  # type: ignore[call-overload]
    with pytest.raises(ValueError, match=r"^method: 'cpd-similarity' finds a scale"):
        monte_carlo(SCENE.source, SCENE.target, METHODS["cpd-similarity"])
