"""A pose's covariance as a filter's state has it."""

import numpy as np
import pytest

from solvers import Pose, register
from solvers.uncertainty import covariance, from_matrix, spread_of, state_covariance
from solvers.wall_scenes import single_wall

SMALL = np.array([[4.0, 1.0, 0.5], [1.0, 9.0, -2.0], [0.5, -2.0, 2.0]]) * 1e-6
MEAN = Pose.from_angle(2.1, (3.0, -1.5))


def numbers(pose):
    return np.column_stack([pose.t, pose.angle])


@pytest.mark.parametrize("frame", ["source", "target"])
def test_it_is_the_covariance_of_drawn_positions_and_angles(frame):
    spread = from_matrix(SMALL, MEAN, centre=(1.0, 2.0), radius=1.7, frame=frame)
    matrix = state_covariance(spread)
    drawn = np.cov(numbers(spread.sample(40_000)).T)
    root = np.linalg.cholesky(matrix)
    np.testing.assert_allclose(np.linalg.solve(root, np.linalg.solve(root, drawn).T), np.eye(3), atol=0.03)
    np.testing.assert_allclose(state_covariance(spread.to("source")), state_covariance(spread.to("target")), rtol=1e-9)
    np.testing.assert_allclose(matrix[:2, :2], spread.point_covariance(), rtol=1e-9)


def test_a_batch_has_one_for_each_pose():
    poses = Pose.from_angle([0.3, 2.0], [[1.0, 0.0], [0.0, 5.0]])
    batch = from_matrix(np.stack([SMALL, 2.0 * SMALL]), poses)
    for k in (0, 1):
        np.testing.assert_allclose(state_covariance(batch)[k], state_covariance(batch[k]), rtol=1e-9)


def test_a_filter_learns_nothing_along_a_free_direction():
    """A matrix that left the direction out would call it known exactly, and the filter would believe that."""
    wall = single_wall(noise=0.0)
    slid = covariance(register(wall.source, wall.target, "point-to-plane"), sigma=0.01)
    assert slid.free.any()
    with pytest.raises(ValueError, match=r"^reach: a direction has no finite spread; say how far to take it$"):
        state_covariance(slid)
    along = slid.directions[1:, 0] / np.linalg.norm(slid.directions[1:, 0])
    before = np.diag([0.2, 0.2, 0.05]) ** 2
    gain = before @ np.linalg.inv(before + state_covariance(slid, reach=1e3))
    after = (np.eye(3) - gain) @ before
    assert along @ after[:2, :2] @ along == pytest.approx(0.2**2, rel=1e-3)
    assert after.trace() < 0.6 * before.trace()


def test_what_is_no_covariance_is_refused_and_the_message_says_what_to_pass():
    result = register(np.eye(2), np.eye(2), "kabsch")
    ends = spread_of(Pose.from_angle(np.zeros(3), np.eye(3)[:, :2]), centre=(0.0, 0.0), radius=1.0)
    for wrong, part in ((result, r"solvers\.uncertainty\.covariance\(result\)"), (ends, r"spread\.whole")):
        with pytest.raises(ValueError, match=rf"^spread: expected a Covariance, got \w+; pass {part}$"):
            state_covariance(wrong)
    with pytest.raises(ValueError, match=r"^reach: "):
        state_covariance(from_matrix(SMALL, MEAN), reach=-1.0)
