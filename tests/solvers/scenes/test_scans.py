"""Two scans of one room: on its walls, in the robot's own coordinates, from a single draw."""

import numpy as np
import pytest

from solvers import Pose
from solvers.scenes.scans import ranges, two_scans
from solvers.studies.seeds import seeds


def off_walls(points, walls):
    """Each point's distance to the nearest wall."""
    a, e = np.concatenate([w[:-1] for w in walls]), np.concatenate([np.diff(w, axis=0) for w in walls])
    rel = points[:, None] - a
    f = np.clip((rel * e).sum(-1) / (e**2).sum(-1), 0.0, 1.0)
    return np.linalg.norm(rel - f[..., None] * e, axis=2).min(axis=1)


@pytest.mark.parametrize("seed", seeds(25))
@pytest.mark.parametrize("distance", [0.0, 3.5])
def test_scans_lie_on_the_walls(seed, distance):
    """Without noise, each scan moved by its pose lies on the room's walls; the truth maps one scan to the other."""
    scans = two_scans(seed=seed, noise=0.0, turn=70.0, distance=distance)
    for cloud, pose in ((scans.source, scans.source_pose), (scans.target, scans.target_pose)):
        assert off_walls(pose.apply(cloud), scans.walls).max() < 1e-12
    moved = scans.target_pose.apply(scans.truth.apply(scans.source))
    np.testing.assert_allclose(moved, scans.source_pose.apply(scans.source), atol=1e-12)
    assert np.degrees(scans.truth.angle) == pytest.approx(70.0)
    assert np.linalg.norm(scans.truth.t) == pytest.approx(distance)


def test_the_robot_sees_no_farther_than_the_first_wall():
    """In a square with a smaller square inside, a ray stops at the near side; one that leaves both hits nothing."""
    square = np.array([(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0), (-3.0, -3.0)])
    a, b = np.vstack([square[:-1], 0.5 * square[:-1]]), np.vstack([square[1:], 0.5 * square[1:]])
    directions = np.array([(1.0, 0.0), (0.0, -1.0), (np.sqrt(0.5), np.sqrt(0.5))])
    np.testing.assert_allclose(ranges(np.zeros(2), directions, a, b), [1.5, 1.5, 1.5 * np.sqrt(2.0)])
    assert ranges(np.array([9.0, 0.0]), np.array([(1.0, 0.0)]), a, b)[0] == np.inf


def test_each_pose_sees_what_the_other_does_not():
    """The pillars hide parts of the room: at the truth, some source points are far from every target point."""
    scans = two_scans(noise=0.0)
    distances = np.linalg.norm(scans.truth.apply(scans.source)[:, None] - scans.target, axis=2).min(axis=1)
    assert np.median(distances) < 0.1
    assert distances.max() > 0.4


def test_noise_stretches_one_draw_along_the_rays():
    """Twice the noise moves each point twice as far, towards or away from the robot."""
    clean, single, double = (two_scans(noise=s).source for s in (0.0, 0.1, 0.2))
    np.testing.assert_allclose(double - clean, 2.0 * (single - clean), atol=1e-12)
    cross = clean[:, 0] * single[:, 1] - clean[:, 1] * single[:, 0]
    np.testing.assert_allclose(cross, 0.0, atol=1e-12)


def test_turning_the_robot_does_not_move_it():
    """With another turn, only the heading of the second pose differs."""
    first, second = two_scans(turn=0.0), two_scans(turn=-120.0)
    np.testing.assert_array_equal(first.source, second.source)
    np.testing.assert_array_equal(first.target_pose.t, second.target_pose.t)
    assert np.degrees(Pose(second.target_pose.R @ first.target_pose.R.T, np.zeros(2)).angle) == pytest.approx(120.0)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        *[({"noise": -0.1}, "noise"), ({"distance": 9.0}, "distance"), ({"rays": 2}, "rays"), ({"seed": -1}, "seed")],
        *[({"turn": wrong}, "^turn: expected a") for wrong in (float("nan"), float("inf"), "a", None)],
    ],
)
def test_refusals_name_the_argument(wrong, message):
    with pytest.raises(ValueError, match=message):
        two_scans(**wrong)
