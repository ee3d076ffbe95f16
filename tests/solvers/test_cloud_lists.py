"""Lists of clouds: each cloud is a separate run, and other arguments are shared by all or given one for each."""

from functools import partial

import numpy as np
import pytest

from solvers import Pose, Status, fit_rigid, register
from solvers.scenes.rooms import kabsch_scene, room
from solvers.uncertainty import covariance
from solvers.verify import evidence, halves, usual_reach

SPACE = np.random.default_rng(4).standard_normal((7, 3))

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
    """Arrays of targets, weights, pairs and seeds beside a list work like lists of their rows."""
    sources = [scene.source, scene.source[::-1]]
    arguments = {
        "target": np.stack([scene.target, scene.target + 1.0]),
        "weights": np.stack([np.arange(13.0), np.ones(13)]),
        "seed": np.array([3, 4]),
    }
    by_array = register(sources, method="similarity", **arguments)
    by_list = register(sources, method="similarity", **{name: list(x) for name, x in arguments.items()})
    assert np.array_equal(by_array.matrix, by_list.matrix)
    assert not np.allclose(by_array.matrix[0], by_array.matrix[1])
    pairs = np.stack([np.c_[np.arange(5), np.arange(5)], np.c_[np.arange(5), 12 - np.arange(5)]])
    assert np.array_equal(
        kabsch(sources, scene.target, pairs=pairs).matrix, kabsch(sources, scene.target, pairs=list(pairs)).matrix
    )
    for w in ([None, None], [None, np.ones(13)]):
        assert np.array_equal(kabsch(sources, scene.target, weights=w).matrix, kabsch(sources, scene.target).matrix)
    assert kabsch([scene.source], scene.target, weights=[None]).pose.batch == (1,)
    with pytest.raises(ValueError, match="weights: there are 3, but 2 clouds"):
        kabsch(sources, scene.target, weights=[None] * 3)
    shared = kabsch(sources, scene.target, weights=[1.0] * 13)
    assert np.array_equal(shared.matrix, kabsch(sources, scene.target).matrix)


def test_a_list_of_one_is_a_batch_of_one(scene):
    """One cloud gives arrays with one leading axis; several give lists, whose entries may differ in length."""
    single, pair = (kabsch([scene.source] * n, [scene.target] * n) for n in (1, 2))
    alone = kabsch(scene.source, scene.target)
    assert np.array_equal(single.correspondences, alone.correspondences[None])
    assert np.array_equal(single.detail("condition"), [alone.detail("condition")])
    assert np.array_equal(single.covariance.matrix, alone.covariance.matrix[None])
    assert isinstance(pair.correspondences, list)
    assert isinstance(pair.detail("condition"), list)
    assert pair.covariance.mean.batch == (2,)


SIZES = (132, 60, 90)


@pytest.fixture
def rooms():
    """A scene's source in three sizes, its target, and the result for all three."""
    scene = room("noise")
    sources = [scene.source[:n] for n in SIZES]
    return sources, scene.target, register(sources, scene.target, "point-to-plane", gate=0.5, start=scene.truth)


def test_what_moves_points_moves_each_cloud_by_its_own_pose(rooms):
    sources, _, result = rooms
    moved = result.transform(sources)
    assert [cloud.shape for cloud in moved] == [(n, 2) for n in SIZES]
    assert all(np.array_equal(moved[k], result[k].transform(sources[k])) for k in range(3))
    assert result.transform([cloud[:9] for cloud in sources]).shape == (3, 9, 2)
    for few, poses in ((result[:2], r"\(2,\)"), (result[0], r"\(\)")):
        with pytest.raises(ValueError, match=f"^points: there are 3 clouds, but poses of shape {poses}"):
            few.transform(sources)


def test_evidence_of_a_list_is_that_of_each(rooms):
    """The evidence of a list is that of each entry, against one target or one each, whichever argument is the list."""
    sources, target, result = rooms
    targets = [target[: 100 + k] for k in range(3)]
    for p, q in ((sources, target), (sources, targets), (sources[0], targets), (sources, np.stack([target] * 3))):
        estimate = evidence(p, q, result.pose)
        for k in range(3):
            own, partner = (x if isinstance(x, np.ndarray) and x.ndim == 2 else x[k] for x in (p, q))
            alone = evidence(own, partner, result.pose[k])
            assert np.array_equal(estimate.explained[k], alone.explained)
            for name in ("share", "rms", "weakest"):
                assert getattr(estimate, name)[k] == getattr(alone, name)
    assert evidence(sources, target, result.pose[0], reach=0.2).share.shape == (3,)
    with pytest.raises(ValueError, match=r"^pose: expected one for all 3 clouds, or one for each"):
        evidence(sources, target, result.pose[:2])
    with pytest.raises(ValueError, match=r"^target: expected one for all 3 clouds, or one for each"):
        evidence(sources, targets[:2], result.pose)
    with pytest.raises(ValueError, match=r"^cloud 0 of the list: source: 1 of 264 numbers"):
        evidence([np.where(sources[0] == sources[0][0, 0], np.nan, sources[0]), *sources[1:]], target, result.pose)


def test_the_usual_reach_of_a_list_is_that_of_each(rooms):
    sources, _, _ = rooms
    assert usual_reach(sources).tolist() == [usual_reach(cloud) for cloud in sources]
    with pytest.raises(ValueError, match=r"^cloud 1 of the list: target: .*not finite"):
        usual_reach([sources[0], sources[1] * np.nan, sources[2]])


def test_halves_of_a_list_are_those_of_each(rooms):
    """The halves of a list are those of each entry, with one target, weights and seed for all, or one each."""
    sources, target, result = rooms
    targets = [target[: 100 + k] for k in range(3)]
    rng = np.random.default_rng(8)
    weights = [rng.uniform(0.5, 1.0, n) for n in SIZES]
    some_weights = [weights[0], None, weights[2]]
    for p, q, w in (
        (sources, target, None),
        (sources, targets, weights),
        (sources, targets, some_weights),
        (sources[0], targets, weights[0]),
        (np.stack([sources[0]] * 3), targets, None),
    ):
        values = halves(p, q, result.pose, weights=w, gate=0.5)
        for k in range(3):
            own, partner = (x if isinstance(x, np.ndarray) and x.ndim == 2 else x[k] for x in (p, q))
            weight = w[k] if isinstance(w, list) else w
            assert values[k] == halves(own, partner, result.pose[k], weights=weight, gate=0.5)
    draws = {"method": "ransac-congruent", "max_steps": 3}
    by_seed = halves(sources, target, result.pose[0], seed=[4, 5, 4], **draws)
    assert by_seed.tolist() == [halves(sources[k], target, result.pose[0], seed=4 + k % 2, **draws) for k in range(3)]
    with pytest.raises(ValueError, match=r"^weights: expected one for all 3 clouds, or one for each"):
        halves(sources, target, result.pose, weights=weights[:2])
    with pytest.raises(ValueError, match=r"^cloud 2 of the list: source: one point has no two halves"):
        halves([*sources[:2], sources[2][:1]], target, result.pose)


def test_covariances_of_a_list_are_those_of_each(rooms):
    _, _, result = rooms
    ways = (
        ({}, {}), ({"sigma": 0.1}, {"sigma": 0.1}), ({"sigma": [0.1, 0.2, 0.3]}, {"sigma": 0.2}),
        ({"how": "censi", "source_noise": 0.1}, {"how": "censi", "source_noise": 0.1}),
        ({"how": "censi", "source_noise": [np.full(n, 0.1) for n in SIZES], "target_noise": 0.05},
         {"how": "censi", "source_noise": np.full(SIZES[1], 0.1), "target_noise": 0.05}),
    )  # fmt: skip
    for arguments, own in ways:
        batch, alone = covariance(result, **arguments), covariance(result[1], **own)
        assert np.array_equal(batch[1].matrix, alone.matrix)
        assert batch.mean == result.pose
        assert batch.edge_information().shape == (3, 3, 3)
    assert np.array_equal(result.covariance.matrix, covariance(result).matrix)
    with pytest.raises(ValueError, match=r"^sigma: expected one number, or an entry for each of 3 clouds, got 2$"):
        covariance(result, sigma=[0.1, 0.2])
    with pytest.raises(ValueError, match=r"^cloud 2 of the list: sigma: expected a finite deviation"):
        covariance(result, sigma=[0.1, 0.2, -0.3])
    assert register([SPACE, SPACE[:5]], SPACE).covariance is None


def test_a_list_of_one_cloud_takes_an_entry_for_it() -> None:
    """A list of one cloud takes a list with one entry of per-point noise, as lists of several clouds do."""
    cloud = np.random.default_rng(3).normal(size=(30, 2))
    several = register([cloud, cloud], [cloud + 0.1, cloud + 0.1], "icp")
    alone = register([cloud], [cloud + 0.1], "icp")
    noise = np.linspace(0.05, 0.15, 30)
    batch = covariance(several, "censi", source_noise=[noise, noise])
    np.testing.assert_array_equal(covariance(alone, "censi", source_noise=[noise]).matrix[0], batch.matrix[0])


@pytest.mark.parametrize("wrong", [None, 3.0])
def test_what_is_no_cloud_beside_a_list_is_refused_by_name(wrong: object) -> None:
    clouds = [np.zeros((3, 2)), np.zeros((4, 2))]
    with pytest.raises(ValueError, match=r"^target: "):
        evidence(clouds, wrong, Pose.identity())  # type: ignore[arg-type]


def test_a_list_is_of_clouds_of_one_dimension():
    """Mixed dimensions are reported for the list; a transposed cloud in it is reported as it is on its own."""
    plane = SPACE[:, :2]
    with pytest.raises(ValueError, match=r"^source: .* of one dimension, but number 0 .* has 2 and number 1 has 3$"):
        register([plane, SPACE], [plane, SPACE])
    with pytest.raises(ValueError, match=r"^cloud 1 of the list: source: .*pass source.T"):
        register([plane, plane.T], plane)


def test_who_takes_no_list_says_how_to_go_on(rooms):
    sources, _, _ = rooms
    message = "rows of unequal length do not make an array; pass clouds of unequal size one by one$"
    with pytest.raises(ValueError, match=f"^source: {message}"):
        fit_rigid(sources, sources)


def test_a_true_value_of_the_callback_ends_the_run_of_one_cloud(rooms):
    """Each cloud of a list is a separate run with steps counted from 1, so a true value ends only that run."""
    sources, target, _ = rooms
    calls = []
    result = register(sources, target, gate=0.5, callback=lambda k, state: calls.append((k, len(state.status))) or True)
    assert calls == [(1, 1)] * 3
    assert result.steps.tolist() == [1] * 3
