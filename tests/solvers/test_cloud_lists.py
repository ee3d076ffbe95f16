"""Lists of clouds: each is its own run, and what comes beside them is one for all or one for each."""

from functools import partial

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.scenes.rooms import kabsch_scene

kabsch = partial(register, method="kabsch")


@pytest.fixture
def scene():
    return kabsch_scene("noisy")


def test_clouds_of_unequal_size_come_as_a_list(scene):
    """A list of clouds is run one by one, and the result reads like a batch's."""
    sizes = (5, 13, 2)
    sources, targets = ([cloud[:n] for n in sizes] for cloud in (scene.source, scene.target))
    result = register(sources, targets, "similarity", weights=[None, np.arange(13.0), None])
    assert result.pose.batch == result.status.shape == result.steps.shape == (3,)
    assert result.status.tolist() == [Status.CONVERGED] * 3
    for i, n in enumerate(sizes):
        weights = np.arange(13.0) if n == 13 else None
        alone = register(sources[i], targets[i], "similarity", weights=weights)
        assert np.array_equal(result.pose[i].matrix, alone.matrix)
        assert np.array_equal(result.history.objective[:, i], alone.history.objective)
    assert [len(s.problem.source[0]) for s in result.states] == list(sizes)
    assert len(result.detail("condition")) == 3


def test_a_list_against_one_target_with_a_start_and_pairs_each(scene):
    sources = [scene.source, scene.source[:6]]
    starts = Pose.from_angle([0.1, 0.2])
    pairs = [np.c_[np.arange(13), np.arange(13)], np.c_[np.arange(6), np.arange(6)]]
    result = kabsch(sources, scene.target, pairs=pairs, start=starts, seed=[5, 6])
    assert np.array_equal(result.history.poses.R[0], starts.R)
    assert np.allclose(result.pose[1].matrix, kabsch(scene.source[:6], scene.target[:6]).matrix, atol=1e-13)
    assert kabsch([scene.source], [scene.target]).pose.batch == (1,)


def test_beside_a_list_an_array_has_one_row_for_each_cloud(scene):
    """Of targets, weights, pairs and seeds alike, as a list of its rows has."""
    sources = [scene.source, scene.source[::-1]]
    given = {
        "target": np.stack([scene.target, scene.target + 1.0]),
        "weights": np.stack([np.arange(13.0), np.ones(13)]),
        "seed": np.array([3, 4]),
    }
    by_array = register(sources, method="similarity", **given)
    by_list = register(sources, method="similarity", **{name: list(x) for name, x in given.items()})
    assert np.array_equal(by_array.matrix, by_list.matrix)
    assert not np.allclose(by_array.matrix[0], by_array.matrix[1])
    pairs = np.stack([np.c_[np.arange(5), np.arange(5)], np.c_[np.arange(5), 12 - np.arange(5)]])
    assert np.array_equal(
        kabsch(sources, scene.target, pairs=pairs).matrix, kabsch(sources, scene.target, pairs=list(pairs)).matrix
    )
    for none in ([None, None], [None, np.ones(13)]):
        assert np.array_equal(kabsch(sources, scene.target, weights=none).matrix, kabsch(sources, scene.target).matrix)
    assert kabsch([scene.source], scene.target, weights=[None]).pose.batch == (1,)
    with pytest.raises(ValueError, match="weights: there are 3, but 2 clouds"):
        kabsch(sources, scene.target, weights=[None] * 3)
    one_for_all = kabsch(sources, scene.target, weights=[1.0] * 13)
    assert np.array_equal(one_for_all.matrix, kabsch(sources, scene.target).matrix)


def test_a_list_of_one_is_a_batch_of_one(scene):
    """Arrays with one leading axis; of several clouds it is lists, whose entries may differ in length."""
    one, two = (kabsch([scene.source] * n, [scene.target] * n) for n in (1, 2))
    alone = kabsch(scene.source, scene.target)
    assert np.array_equal(one.correspondences, alone.correspondences[None])
    assert np.array_equal(one.detail("condition"), [alone.detail("condition")])
    assert np.array_equal(one.covariance.matrix, alone.covariance.matrix[None])
    assert isinstance(two.correspondences, list)
    assert isinstance(two.detail("condition"), list)
    assert two.covariance is None
