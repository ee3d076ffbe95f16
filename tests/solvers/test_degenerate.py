"""Scenes that do not determine a pose are recognised, explained in words, and leave the rest of their batch alone."""

import numpy as np
import pytest

from solvers import Pose, Status, fit_planar, fit_rigid, register
from solvers.geometry.rigid import pair_cost

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

SQUARE = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
TRIANGLE = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]])
LINE = np.linspace(-1.0, 2.0, 6)[:, None] * [1.0, 2.0, -0.5] + [3.0, 0.1, 0.7]


def planar(reason, source, target, weights=None):
    return pytest.param(source, target, weights, reason, id=reason)


PLANAR = [
    planar("all weights are zero", TRIANGLE, TRIANGLE, np.zeros(3)),
    planar("all source points with weight are equal", np.full((5, 2), 0.1), np.arange(10.0).reshape(5, 2)),
    planar("all target points with weight are equal", np.arange(10.0).reshape(5, 2), np.full((5, 2), 0.7)),
    planar("both sums of the planar fit are zero", SQUARE, SQUARE * [1.0, -1.0]),
]


@pytest.mark.parametrize("scale", [False, True])
@pytest.mark.parametrize("fit", [fit_rigid, fit_planar])
@pytest.mark.parametrize(("source", "target", "weights", "reason"), PLANAR)
def test_what_the_plane_leaves_open_is_said(fit, source, target, weights, reason, scale):
    """No weight, equal points, or two vanishing sums: degenerate, with a reason in words and a finite pose."""
    result = fit(source, target, weights, scale=scale)
    assert result.status == Status.DEGENERATE
    assert reason in result.reason
    assert np.array_equal(result.pose.R, np.eye(2))
    assert result.pose.scale == 1.0
    assert np.isfinite(result.pose.t).all()
    assert result.condition == np.inf


@pytest.mark.parametrize("fit", [fit_rigid, fit_planar])
def test_a_degenerate_answer_still_brings_the_centroids_together(fit):
    """If the rotation is open, the pose only aligns the centroids; with no weight at all it is the identity."""
    result = fit(SQUARE + 5.0, SQUARE * [1.0, -1.0] - 2.0)
    assert np.allclose(result.pose.t, [-7.0, -7.0])
    nothing = fit(TRIANGLE, TRIANGLE + 4.0, np.zeros(3))
    assert np.array_equal(nothing.pose.t, [0.0, 0.0])


@pytest.mark.parametrize("fit", [fit_rigid, fit_planar])
def test_one_point_is_not_enough_and_two_are_in_the_plane(fit):
    """A single pair leaves the rotation open; two distinct pairs determine it, however many copies there are."""
    assert fit([[1.0, 2.0]], [[3.0, 4.0]]).status == Status.DEGENERATE
    truth = Pose.from_angle(2.5, (1.0, -3.0))
    two = np.array([[1.0, 2.0], [1.5, 2.0]])
    for points in (two, np.repeat(two, 4, axis=0)):
        result = fit(points, truth.apply(points))
        assert result.status == Status.CONVERGED
        assert np.allclose(result.pose.matrix, truth.matrix, atol=1e-13)
    only_one_counts = fit(two, truth.apply(two), [1.0, 0.0])
    assert only_one_counts.status == Status.DEGENERATE


def test_points_equal_but_for_rounding_are_equal(rng):
    """Copies of one point that differ only in the last bit do not count as determining a rotation."""
    source = np.full((20, 2), 1234.567) * (1.0 + 2.2e-16 * rng.integers(-1, 2, (20, 2)))
    assert fit_planar(source, rng.standard_normal((20, 2))).status == Status.DEGENERATE


def test_in_space_a_line_leaves_the_turn_about_itself_free(rng, random_pose):
    """Collinear points in 3-D fit equally well after any turn about their line, so no rotation is claimed."""
    truth = random_pose(rng, 3)
    fit = fit_rigid(LINE, truth.apply(LINE))
    assert fit.status == Status.DEGENERATE
    assert "collinear" in fit.reason
    assert "about their line is free" in fit.reason
    # The claim itself: a turn about the line leaves the sum of squares unchanged.
    axis = (LINE[1] - LINE[0]) / np.linalg.norm(LINE[1] - LINE[0])
    K = np.cross(np.eye(3), axis)
    turn = np.eye(3) + np.sin(1.0) * K + (1.0 - np.cos(1.0)) * K @ K
    about_line = Pose(turn, LINE[0] - turn @ LINE[0])
    assert pair_cost(truth.compose(about_line), LINE, truth.apply(LINE), np.ones(6)) < 1e-24


def test_in_space_three_noncollinear_pairs_suffice(rng, random_pose):
    """Three correct pairs off one line fix the rotation in 3-D; two pairs do not."""
    truth = random_pose(rng, 3)
    source = rng.standard_normal((3, 3))
    fit = fit_rigid(source, truth.apply(source))
    assert fit.status == Status.CONVERGED
    assert fit.determinant == 0
    assert np.allclose(fit.pose.matrix, truth.matrix, atol=1e-12)
    two = fit_rigid(source[:2], truth.apply(source[:2]))
    assert two.status == Status.DEGENERATE
    assert "collinear" in two.reason


def test_the_cloud_at_fault_is_named(rng):
    spread = rng.standard_normal((6, 3))
    assert "source points are collinear" in fit_rigid(LINE, spread).reason
    assert "target points are collinear" in fit_rigid(spread, LINE).reason
    flat = np.zeros((8, 4))
    flat[:, :2] = rng.standard_normal((8, 2))
    assert "span 2 of 4 dimensions" in fit_rigid(flat, rng.standard_normal((8, 4))).reason


def test_in_space_a_correlation_without_direction_is_said():
    """A mirrored regular cross in 3-D fits several rotations equally well, although its points are not collinear."""
    cross = np.vstack([np.eye(3), -np.eye(3)])
    fit = fit_rigid(cross, -cross)
    assert fit.status == Status.DEGENERATE
    assert "several rotations equally well" in fit.reason
    free = fit_rigid(cross, -cross, proper=False)
    assert free.status == Status.CONVERGED
    assert free.cost < 1e-28


def test_where_rotation_and_reflection_tie_the_rotation_is_taken(rng):
    """A reflection fits points on a line in the plane equally well: the determinant is 0, and the rotation is taken."""
    # A hundred lines, because the rounding that decides the determinant's sign differs from line to line.
    source = np.linspace(-1.0, 1.0, 5)[:, None] * rng.standard_normal((100, 1, 2)) + rng.standard_normal((100, 1, 2))
    truth = Pose.from_angle(rng.uniform(-np.pi, np.pi, 100), rng.standard_normal((100, 2)))
    target = truth.apply(source)
    H = (source - source.mean(1, keepdims=True)).swapaxes(1, 2) @ (target - target.mean(1, keepdims=True))
    assert {-1.0, 1.0} <= set(np.sign(np.linalg.det(H)).tolist())
    for result in (fit_rigid(source, target, proper=False), fit_planar(source, target)):
        assert np.all(result.status == Status.CONVERGED)
        assert np.all(result.determinant == 0)
        assert np.allclose(result.pose.matrix, truth.matrix, atol=1e-12)


@pytest.mark.parametrize("fit", [fit_rigid, fit_planar])
@pytest.mark.parametrize("moved", ["source", "target"])
def test_an_undefined_angle_far_from_the_origin_is_still_undefined(fit, moved):
    """If the sums vanish up to the rounding of large coordinates, no angle is derived from that rounding."""
    clouds = {"source": 0.1 * SQUARE, "target": 0.1 * SQUARE * [1.0, -1.0]}
    clouds[moved] = clouds[moved] + [12345.678, -98765.4321]
    result = fit(**clouds)
    assert result.status == Status.DEGENERATE
    assert "both sums" in result.reason


@pytest.mark.parametrize("fit", [fit_rigid, fit_planar])
def test_a_hopeless_problem_leaves_its_batch_alone(fit, rng):
    """Degenerate problems in a batch each get their own reason; the others come out as if alone."""
    source, target = rng.standard_normal((5, 4, 2)), rng.standard_normal((5, 4, 2))
    source[1] = 0.3
    source[3], target[3] = SQUARE, SQUARE * [1.0, -1.0]
    result = fit(source, target)
    assert result.status.tolist() == [1, 4, 1, 4, 1]
    assert "source" in result.reason[1]
    assert "both sums" in result.reason[3]
    assert [bool(r) for r in result.reason] == [False, True, False, True, False]
    for i in (0, 2, 4):
        assert np.allclose(result.pose[i].matrix, fit(source[i], target[i]).pose.matrix, atol=1e-13)


@pytest.mark.parametrize("method", ["kabsch", "similarity"])
def test_the_front_door_reports_the_same(method):
    result = register(SQUARE, SQUARE * [1.0, -1.0], method)
    assert result.status is Status.DEGENERATE
    assert "angle is undefined" in result.reason
    assert result.steps == 1


@pytest.mark.parametrize(("source", "target"), [(1e-200, 1e149), (1e149, 1e-200)])
def test_a_scale_that_no_float64_holds_is_degenerate(source, target):
    """A similarity of clouds 349 powers of ten apart neither overflows on the way nor ends with an infinite scale."""
    cloud = np.array([(0.0, 0.0), (1.0, 0.2), (0.3, 0.9)])
    result = register(cloud * source, cloud * target, "similarity")
    assert result.status == Status.DEGENERATE
    assert "times as wide as the other" in result.reason
    assert np.isfinite(result.pose.matrix).all()
    single = register(cloud, cloud * 1e140, "similarity")
    assert single.status == Status.CONVERGED
    assert single.pose.scale == pytest.approx(1e140)
