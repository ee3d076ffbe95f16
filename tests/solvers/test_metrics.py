"""Errors against a truth and residuals of pairs: angles round the circle, distances, batches, and what is refused."""

import numpy as np
import pytest

from solvers import Pose, fit_rigid
from solvers.metrics import point_error, residuals, rms, rre, rte, scale_error


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.3, 3.0, np.pi - 1e-9, np.pi])
@pytest.mark.parametrize("d", [2, 3])
def test_the_rotation_error_is_the_angle_between_two_rotations(d, angle, rng, random_pose):
    """RRE is the angle of R R*ᵀ: right for tiny errors and for half turns, never above 180°, and symmetric."""
    truth = random_pose(rng, d)
    extra = np.eye(d)
    extra[:2, :2] = Pose.from_angle(angle).R
    pose = Pose(extra @ truth.R, truth.t)
    assert rre(pose, truth) == pytest.approx(angle, abs=1e-14)
    assert rre(truth, pose) == pytest.approx(angle, abs=1e-14)


def test_angles_are_compared_around_the_circle():
    """179° and −179° are 2° apart, not 358°."""
    assert rre(Pose.from_angle(np.radians(179)), Pose.from_angle(np.radians(-179))) == pytest.approx(np.radians(2))


def test_the_translation_error_is_the_distance_of_the_translations():
    assert rte(Pose.from_angle(1.0, (3.0, 4.0)), Pose.identity()) == 5.0
    assert scale_error(Pose(np.eye(2), np.zeros(2), 0.9), Pose.identity()) == pytest.approx(0.1)


def test_the_point_error_does_not_care_where_the_origin_lies(rng, random_pose):
    """Shifting the coordinates leaves the error measured on points unchanged, but not the translation error."""
    points = rng.standard_normal((20, 2))
    truth = random_pose(rng, 2)
    pose = Pose.from_angle(0.1).compose(truth)
    shift = Pose(np.eye(2), np.array([100.0, 50.0]))
    moved = [shift.compose(p).compose(shift.inverse()) for p in (pose, truth)]
    assert point_error(*moved, shift.apply(points)) == pytest.approx(point_error(pose, truth, points), rel=1e-11)
    assert rte(*moved) > 5 * rte(pose, truth)


def test_residuals_and_their_rms_over_a_batch(rng, random_pose):
    poses = random_pose(rng, 3, (4,))
    source, target = rng.standard_normal((6, 3)), rng.standard_normal((6, 3))
    r = residuals(poses, source, target)
    assert r.shape == (4, 6)
    assert np.allclose(rms(poses, source, target), np.sqrt((r**2).mean(axis=1)))
    weights = np.arange(6.0)
    assert np.allclose(rms(poses, source, target, weights), np.sqrt((r**2) @ weights / 15.0))
    assert np.array_equal(rms(poses, source, target, np.zeros(6)), np.zeros(4))
    assert rre(poses, Pose.identity(3)).shape == rte(poses, Pose.identity(3)).shape == (4,)
    with pytest.raises(ValueError, match="target"):
        residuals(poses, source, target[:5])


def on_points(pose, truth):
    return point_error(pose, truth, np.ones((4, 2)))


def test_what_does_not_fit_together_is_named():
    """Arguments that are not poses, batches that do not broadcast and clouds of another dimension are named, as numpy's
    own messages would not do."""
    three, two, points = Pose.identity(2, (3,)), Pose.identity(2, (2,)), np.ones((4, 2))
    for error in (rre, rte, scale_error, on_points):
        with pytest.raises(ValueError, match=r"^pose, truth: leading axes do not broadcast: pose \(3,\), truth \(2,\)"):
            error(three, two)
        with pytest.raises(ValueError, match=r"^pose: expected a Pose, got ndarray"):
            error(np.eye(3), two)
        with pytest.raises(ValueError, match=r"^truth: expected a Pose, got ndarray"):
            error(two, np.eye(3))
    for metric in (residuals, rms):
        with pytest.raises(ValueError, match=r"^pose: expected a Pose, got ndarray"):
            metric(np.eye(3), points, points)
        with pytest.raises(ValueError, match=r"^pose, source, target: leading axes do not broadcast: pose \(3,\), "):
            metric(three, np.stack([points] * 2), points)
        with pytest.raises(ValueError, match=r"^pose: moves points in 3 dimensions, the clouds have 2"):
            metric(Pose.identity(3), points, points)
    # These take no pairs, so the message does not mention any.
    for metric in (residuals, rms, lambda pose, p, q: fit_rigid(p, q)):
        with pytest.raises(ValueError, match=r"^target: .* source has 4 rows and target 3$"):
            metric(two, points, points[:3])
    with pytest.raises(ValueError, match=r"^weights, residuals: leading axes do not broadcast"):
        rms(three, points, points, np.ones((2, 4)))
    with pytest.raises(ValueError, match=r"^pose, truth, points: leading axes do not broadcast"):
        point_error(three, three, np.stack([points] * 2))


def test_poses_of_the_plane_and_of_space_are_not_compared():
    for error in (rre, rte, scale_error, on_points):
        with pytest.raises(ValueError, match="truth: moves points in 3 dimensions, the pose in 2"):
            error(Pose.identity(), Pose.identity(3))
