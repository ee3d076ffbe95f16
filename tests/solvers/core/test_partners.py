"""The correspondences that a result reports, against plain loops and against what the methods say of themselves."""

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.scenes import room
from solvers.scenes.rooms import kabsch_scene
from solvers.uncertainty import covariance
from solvers.uncertainty.closed_form import HESSIAN

HARD = sorted(name for name, method in METHODS.items() if method.partners)
SOFT = sorted(set(METHODS) - set(HARD) - {"flow", "flow-from-source"})


def clouds(method: str, seed: int = 40):
    scene = kabsch_scene("noisy", seed=seed) if METHODS[method].paired else room("noise", seed=seed)
    return scene.source[::3], scene.target[:: 3 if METHODS[method].paired else 1]


def test_all_methods_of_nearest_points_and_of_known_pairs_have_partners():
    assert set(HARD) == {
        "kabsch", "similarity", "ransac", "ransac-congruent", "graduated-nonconvexity", "icp", "trimmed-icp",
        "capped-icp", "kiss-threshold-icp", "fast-robust-icp", "point-to-plane", "gicp",
    }  # fmt: skip


@pytest.mark.parametrize("method", HARD)
def test_fitness_and_rmse_are_those_of_the_correspondences(method):
    source, target = clouds(method)
    result = register(source, target, method)
    rows = result.correspondences
    assert rows.shape == (len(source),)
    assert rows.min() >= -1
    assert rows.max() < len(target)
    pairs = [(p, target[row]) for p, row in zip(result.transform(source), rows, strict=True) if row >= 0]
    assert result.fitness == pytest.approx(len(pairs) / len(source))
    assert result.rmse == pytest.approx(np.sqrt(np.mean([np.sum((p - q) ** 2) for p, q in pairs])))


@pytest.mark.parametrize("method", ["icp", "point-to-plane", "gicp"])
def test_partners_are_the_nearest_points_where_there_is_one(method):
    source, target = clouds(method)
    result = register(source, target, method, gate=0.6)
    distances = np.linalg.norm(result.transform(source)[:, None] - target, axis=-1)
    used = result.correspondences >= 0
    assert 0 < used.sum() <= len(source)
    assert (result.correspondences[used] == distances.argmin(axis=1)[used]).all()
    assert distances.min(axis=1)[used].max() <= 0.6


def test_known_pairs_without_weight_have_no_partner():
    source, target = clouds("kabsch")
    weights = np.where(np.arange(len(source)) % 4 == 0, 0.0, 1.0)
    result = register(source, target, "kabsch", weights=weights)
    assert (result.correspondences == np.where(weights > 0, np.arange(len(source)), -1)).all()
    assert result.fitness == np.mean(weights > 0)


def test_where_no_pair_is_within_the_gate_none_is_told():
    source, target = clouds("icp")
    result = register(source, target + 1e3, "icp", gate=0.1)
    assert result.status == Status.DEGENERATE
    assert (result.correspondences == -1).all()
    assert result.fitness == 0.0
    assert result.rmse == np.inf


def test_a_batch_and_a_list_tell_of_each():
    (first, target), (second, onto) = clouds("icp", 40), clouds("icp", 53)
    batch = register(np.stack([first, first]), target, "icp", start=Pose.from_angle([0.0, 0.4], np.zeros((2, 2))))
    assert batch.correspondences.shape == (2, len(first))
    assert batch.fitness.shape == batch.rmse.shape == (2,)
    single = register(first, target, "icp")
    assert (batch.correspondences[0] == single.correspondences).all()
    results = register([first, second[:-4]], [target, onto], "icp")
    assert [len(rows) for rows in results.correspondences] == [len(first), len(second) - 4]
    assert results.rmse[0] == single.rmse
    assert np.array_equal(results.covariance[0].matrix, single.covariance.matrix)


@pytest.mark.parametrize("method", SOFT)
def test_soft_methods_have_no_single_partners_and_offer_nothing(method):
    source, target = clouds(method)
    result = register(source, target, method, max_steps=1)
    assert result.correspondences is result.fitness is result.rmse is result.covariance is None


@pytest.mark.parametrize("method", HARD)
def test_a_covariance_is_offered_where_there_is_a_closed_form(method):
    result = register(*clouds(method), method)
    if method not in HESSIAN:
        assert result.covariance is None
        return
    assert result.covariance.made_by == "hessian"
    np.testing.assert_array_equal(result.covariance.deviations, covariance(result).deviations)


def test_none_is_offered_in_space():
    points = np.random.default_rng(40).normal(size=(12, 3))
    assert register(points, points + 0.1, "kabsch").covariance is None


def test_of_pairs_that_were_given_their_numbers_are_told():
    """With pairs given, correspondences are pair indices, not target rows: a source row may be in several pairs or
    none."""
    source = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [9.0, 9.0]])
    pairs = np.array([[0, 2], [1, 1], [2, 0], [3, 0]])
    weights = [1.0, 1.0, 1.0, 0.0]
    result = register(source, source[[2, 1, 0]] + 1.0, "kabsch", pairs=pairs, weights=weights)
    outcome = result.correspondences
    assert outcome.tolist() == [0, 1, 2, -1]
    assert pairs[outcome[outcome >= 0]].tolist() == [[0, 2], [1, 1], [2, 0]]


def test_pairs_that_are_none_are_refused_as_such():
    with pytest.raises(ValueError, match=r"^pairs: is empty, shape \(0, 2\); at least one pair is needed$"):
        register(np.eye(2), np.eye(2), "kabsch", pairs=np.zeros((0, 2), dtype=int))
