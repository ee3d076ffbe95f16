"""Fast and robust ICP's Anderson steps: their coordinates, what they save, and how a refusal affects the history."""

from itertools import pairwise

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.methods.icp.fast_robust import _coordinates, _posed
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def rooms(setting, degrees, distance=1.43):
    scenes = [room(setting, seed=s) for s in SEEDS]
    return np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), room_start(degrees, distance)


def test_coordinates_of_poses_go_there_and_back(rng, random_pose):
    """Extrapolation uses a rotation vector and a moved centre relative to a pose; converting there and back is
    exact."""
    for d in (2, 3):
        origin = random_pose(rng, d, (50,))
        poses = Pose(random_pose(rng, d, (50,)).R, origin.t + rng.standard_normal((50, d)))
        radius, centre = rng.uniform(0.1, 9.0, 50), rng.standard_normal((50, d))
        result = _posed(_coordinates(poses, origin, radius, centre), origin, radius, centre)
        assert np.allclose(result.matrix, poses.matrix, atol=1e-12)


def test_extrapolated_steps_are_kept_only_where_the_energy_falls_and_save_steps():
    """Over 25 rooms the accelerated run takes fewer steps; its first step has nothing to extrapolate from."""
    source, target, start = rooms("combo", 15.0)
    history = []
    fast = register(
        source, target, "fast-robust-icp", start=start, max_steps=200,
        callback=lambda k, state: history.append(state.accelerated.copy()),
    )  # fmt: skip
    plain = register(source, target, "fast-robust-icp", start=start, max_steps=200, history=0)
    assert np.median(fast.steps) < 0.8 * np.median(plain.steps)
    history = np.stack(history)
    assert history[1:10].mean() > 0.3
    assert not history[0].any()
    assert np.all(fast.status == Status.CONVERGED)
    assert np.all(fast.detail("nu") == fast.detail("last"))


@pytest.mark.parametrize("forget", [True, False])
def test_a_refused_extrapolation_empties_the_history_or_leaves_it(forget):
    """The history grows by one a step up to its cap. After a refusal it is either emptied or, as in the authors' code,
    kept at its length, with the poses that the run was at; then only a new stage empties it."""
    source, target, start = rooms("combo", 30.0)
    states = []
    register(
        source, target, "fast-robust-icp", start=start, max_steps=40, forget=forget,
        callback=lambda k, state: states.append(state),
    )  # fmt: skip
    refusals = 0
    for old, new in pairwise(states):
        same = (old.status == Status.RUNNING) & (new.nu == old.nu)
        refused = same & (old.depth > 0) & ~new.accelerated
        refusals += refused.sum()
        expected = np.where(refused & forget, 0, np.minimum(old.depth + 1, 6))
        assert np.array_equal(new.depth[same], expected[same])
        assert np.array_equal(new.past_x.t[same, 0], old.pose.t[same])
        assert np.array_equal(new.past_x.t[same, 1:], old.past_x.t[same, :-1])
        assert np.all(new.depth[new.nu != old.nu] == 0)
    assert refusals > 50


@pytest.mark.parametrize("copies", [2, 5, 9])
def test_equal_target_points_count_once_for_the_last_width(copies):
    """A standing robot's sweeps repeat their points; counted one by one, copies are neighbours at distance zero."""
    scene, start = room("clean"), room_start(5.0, 0.3)
    once, often = (
        register(scene.source, target, "fast-robust-icp", start=start)
        for target in (scene.target, np.repeat(scene.target, copies, axis=0))
    )
    assert often.status is once.status is Status.CONVERGED
    assert np.allclose(often.matrix, once.matrix, rtol=0.0, atol=1e-9)


def test_widths_weights_energy_and_rms_are_what_they_are_said_to_be():
    """In every state of a batch whose problems halve ν at different steps, from all distances between the points."""
    source, target, start = rooms("combo", 15.0)
    states = []
    register(source[:6], target[:6], "fast-robust-icp", start=start, callback=lambda k, state: states.append(state))
    changes = np.stack([state.nu for state in states])
    halved = changes[1:] != changes[:-1]
    assert (halved.any(axis=1) & ~halved.all(axis=1)).any()
    for state in states:
        moved = state.pose.apply(source[:6])
        gap = np.linalg.norm(moved[:, :, None] - target[:6, None], axis=-1).min(axis=2)
        nu = state.nu[:, None]
        weights = np.exp(-np.square(gap / nu) / 2.0)
        np.testing.assert_allclose(state.pairing.weights, weights, rtol=1e-9)
        np.testing.assert_allclose(state.objective, (2.0 * nu**2 * (1.0 - weights)).sum(axis=1), rtol=1e-9)
        rms = np.sqrt((weights * gap**2).sum(axis=1) / weights.sum(axis=1))
        np.testing.assert_allclose(state.pairing.rms, rms, rtol=1e-9)
    gap = np.linalg.norm(start.apply(source[:6])[:, :, None] - target[:6, None], axis=-1).min(axis=2)
    np.testing.assert_allclose(states[0].nu, 3.0 * np.median(gap, axis=1), rtol=1e-12)
    others = np.sort(np.linalg.norm(target[:6, :, None] - target[:6, None], axis=-1), axis=2)[:, :, 1:7]
    np.testing.assert_allclose(states[0].last, np.median(np.median(others, axis=2), axis=1) / np.sqrt(27.0), rtol=1e-12)
