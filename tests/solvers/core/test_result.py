"""How a result, a single pose and a rounded start behave in Python's own terms."""

import pickle

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.core.edges import Edges
from solvers.scenes.rooms import room


@pytest.fixture(scope="module")
def scene():
    return room("clean")


@pytest.mark.parametrize("d", [2, 3])
def test_a_start_whose_matrix_was_rounded_is_a_rigid_motion(rng, random_pose, d):
    """A start rounded to float32 or to seven digits counts as rigid; one really scaled is refused with its scale, and
    for one rounded to fewer the message says what to pass."""
    points, start = rng.standard_normal((30, d)), random_pose(rng, d)
    for matrix in (start.matrix.astype(np.float32), np.round(start.matrix, 7)):
        result = register(points, start.apply(points), start=matrix)
        assert result.pose.scale == 1.0
        assert np.abs(result.pose.matrix - start.matrix).max() < 1e-6
        if d == 2:
            assert Edges([0], [1], Pose.from_matrix(matrix[None]), np.eye(3)).relative.scale == [1.0]
    with pytest.raises(ValueError, match=r"^start.scale: scale the source first.* at scale 1, not 1.00001$"):
        register(points, points, start=Pose(start.R, start.t, 1.00001))
    if d == 2:
        matrix = np.round(Pose.from_angle(0.3, start.t).matrix, 2)
        with pytest.raises(ValueError, match=r"first, or if its matrix was rounded, pass Pose\(p.R, p.t\) of p = "):
            register(points, points, start=matrix)
        p = Pose.from_matrix(matrix)
        assert register(points, points, start=Pose(p.R, p.t)).pose.scale == 1.0


def test_a_result_is_true_where_its_status_is(scene):
    """A result that found nothing is false, a batch's truth value is ambiguous, and a single pose is not a sequence."""
    failure = register(scene.source, scene.target, gate=1e-9)
    assert (bool(failure), failure.status) == (False, Status.DEGENERATE)
    assert bool(register(scene.source, scene.target)) is True
    batch = register([scene.source] * 2, [scene.target] * 2)
    with pytest.raises(ValueError, match=r"batch of shape \(2,\) is neither true nor false; ended"):
        bool(batch)
    for value in (failure.pose, register(scene.source, scene.target).covariance):
        with pytest.raises(TypeError, match="a single pose has no rows"):
            list(value)
    assert len(list(batch.pose)) == 2


@pytest.mark.parametrize("text", ["converged", "CONVERGED", "done"])
def test_a_status_is_not_compared_with_a_text_in_silence(scene, text):
    """Comparing a status with a text by ==, != or `in` raises an error that names valid comparisons."""
    status = register(scene.source, scene.target).status
    for compare in (
        lambda: status == text, lambda: text == status, lambda: status != text, lambda: text != status,
        lambda: status in (text, "stalled"),
    ):  # fmt: skip
        with pytest.raises(TypeError, match=f"here '{text}': compare it with Status.CONVERGED, or its label"):
            compare()
    with pytest.raises(TypeError, match=r"Status\.STALLED, or its label with 'stalled'"):
        assert status != "stalled"


def test_a_status_is_a_number_beside_numbers():
    """It equals its own number and no other, including in arrays, as a key, and after pickling."""
    for status in Status:
        assert status == int(status) == np.int8(status)
        assert status != int(status) + 1
        assert {status: 1}[int(status)] == 1
        assert pickle.loads(pickle.dumps(status)) is status
        assert (np.array(list(Status), dtype=np.int8) == status).sum() == 1


@pytest.mark.parametrize("method", ["icp", "ndt", "cpd-rigid"])
def test_a_problem_of_a_batch_is_what_it_is_alone(scene, method):
    """It has the same pose, status, partners and course, from a batch with two axes and from a list of clouds."""
    turns = np.radians([[0.0, 20.0, 40.0], [-20.0, 90.0, 170.0]])
    starts = Pose.from_angle(turns, np.zeros((2, 3, 2)))
    batch = register(scene.source, scene.target, method, start=starts)
    clouds = [scene.source, scene.source[::2]]
    results = register(clouds, [scene.target] * 2, method)
    alone = [(batch[i, j], register(scene.source, scene.target, method, start=starts[i, j]))
             for i in range(2) for j in range(3)]  # fmt: skip
    alone += [(part, register(cloud, scene.target, method)) for part, cloud in zip(results, clouds, strict=True)]
    assert len({len(single.history.objective) for single, _ in alone}) > 1  # their courses differ in length
    for part, single in alone:
        assert (part.status, part.reason, part.steps) == (single.status, single.reason, single.steps)
        assert type(part.status) is Status
        assert bool(part) is bool(single)
        assert repr(part) == repr(single)
        assert np.allclose(part.matrix, single.matrix, rtol=0.0, atol=1e-12)
        assert part.history.objective.shape == single.history.objective.shape == (single.steps + 1,)
        assert np.allclose(part.history.poses.matrix, single.history.poses.matrix, rtol=0.0, atol=1e-12)
        assert np.array_equal(part.correspondences, single.correspondences)


def test_any_index_of_the_leading_axes_selects_problems(scene):
    """An index only reaches the leading axes: `...` leaves a matrix's own axes alone, though here they would fit
    too."""
    starts = Pose.from_angle(np.radians([[0.0, 20.0], [40.0, -20.0], [90.0, 170.0]]), np.zeros((3, 2, 2)))
    batch = register(scene.source, scene.target, start=starts)
    mask = np.array([[True, False], [False, True], [True, True]])
    for rows in (1, -1, [0, 1], np.s_[:, 1:], np.s_[..., 1], ..., np.s_[1, ...], mask, np.s_[:0], mask & False):
        part = batch[rows]
        assert part.steps.shape == part.pose.batch == part.detail("pose").batch
        assert np.array_equal(part.steps, batch.steps[rows])
        indices = np.arange(6).reshape(3, 2)[rows]
        assert np.array_equal(part.matrix, batch.matrix.reshape(6, 3, 3)[indices])
        courses = batch.history.poses.matrix.reshape(-1, 6, 3, 3)
        assert np.array_equal(part.history.poses.matrix, courses[:, indices])
        assert part.history.objective.shape == (len(batch.history.objective), *part.pose.batch)
        assert part.correspondences.shape[:-1] == part.fitness.shape == part.pose.batch
    assert len(batch[:, 1:]) == 3
    with pytest.raises(IndexError, match="too many indices"):
        batch[0, 0, 0]
    results = register([scene.source, scene.source[::2]], [scene.target] * 2)
    empty = results[np.zeros(2, dtype=bool)]
    assert empty.pose.batch == empty.steps.shape == empty.fitness.shape == (0,)
    with pytest.raises(ValueError, match="source: expected real numbers, got Result"):
        register(batch, scene.target)


def test_a_single_result_has_no_parts(scene):
    result = register(scene.source, scene.target)
    for use in (len, list, lambda result: result[0]):
        with pytest.raises(TypeError, match="the result of one problem has no"):
            use(result)
    with pytest.raises(IndexError, match="out of bounds"):
        register([scene.source] * 2, scene.target)[2]
