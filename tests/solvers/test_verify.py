"""The signs by which a pose is judged without a truth: closed cases, invariance, batches, what is refused."""

import numpy as np
import pytest

from solvers import Pose
from solvers.scenes.rooms import room
from solvers.scenes.walls import corridor, hall
from solvers.verify import evidence, halves


def test_a_cloud_on_itself_is_explained_without_residual():
    scene = room("clean")
    found = evidence(scene.target, scene.target, Pose.identity())
    assert found.share == 1.0
    assert found.rms == 0.0
    assert found.explained.all()


def test_a_cloud_far_away_is_not_explained_and_holds_nothing():
    scene = room("clean")
    found = evidence(scene.source, scene.target, Pose.from_angle(0.0, (100.0, 0.0)))
    assert found.share == found.rms == found.weakest == 0.0


def test_a_known_offset_is_the_residual():
    target = np.column_stack([np.arange(6.0), np.zeros(6)])
    found = evidence(target[:4], target, Pose.from_angle(0.0, (0.0, 0.25)))
    assert found.rms == pytest.approx(0.25)
    assert found.share == 1.0
    assert found.weakest == 0.0  # a straight line holds no slide


def test_a_corridor_is_weak_and_a_hall_is_not():
    weak, held = (evidence(s.source, s.target, s.truth).weakest for s in (corridor(), hall()))
    assert weak < 0.005
    assert held > 0.2


def test_moving_both_clouds_changes_nothing():
    scene, moved = room("combo"), Pose.from_angle(2.0, (30.0, -7.0))
    pose = Pose.from_angle(0.05, (0.1, 0.0))
    one = evidence(scene.source, scene.target, pose)
    other = evidence(scene.source, moved.apply(scene.target), moved.compose(pose))
    for name in ("share", "rms", "weakest"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-9)


def test_a_batch_is_its_single_problems():
    scenes = [room("combo", seed=seed) for seed in (40, 53)]
    source, target = (np.stack([getattr(s, name) for s in scenes]) for name in ("source", "target"))
    poses = Pose(np.stack([np.eye(2)] * 2), np.array([(0.1, 0.0), (0.0, 0.2)]))
    both, apart = evidence(source, target, poses), halves(source, target, poses, gate=0.5)
    for i in (0, 1):
        one = evidence(source[i], target[i], poses[i])
        for name in ("explained", "share", "rms", "weakest"):
            np.testing.assert_allclose(getattr(both, name)[i], getattr(one, name), rtol=1e-12)
        assert apart[i] == pytest.approx(halves(source[i], target[i], poses[i], gate=0.5), rel=1e-12)


def test_halves_without_noise_agree():
    scene = room("clean", noise=0.0)
    assert halves(scene.target, scene.target, Pose.from_angle(0.02, (0.05, 0.0)), "point-to-plane") < 1e-3


def test_what_is_refused():
    scene = room("clean")
    with pytest.raises(ValueError, match="reach"):
        evidence(scene.source, scene.target, Pose.identity(), 0.0)
    with pytest.raises(ValueError, match="leading axes"):
        evidence(scene.source[None], scene.target, Pose.identity())
    with pytest.raises(ValueError, match="halves"):
        halves(scene.source[:1], scene.target, Pose.identity())
    with pytest.raises(ValueError, match="gaet"):
        halves(scene.source, scene.target, Pose.identity(), gaet=1.0)
