"""The signs that judge a pose without a truth: closed cases, invariance, batches, and refusals."""

import numpy as np
import pytest

from solvers import Pose, fit_rigid, register
from solvers.geometry.downsample import spacing
from solvers.scenes.rooms import room
from solvers.scenes.walls import corridor, hall
from solvers.verify import evidence, halves, usual_reach


def test_a_cloud_on_itself_is_explained_without_residual():
    scene = room("clean")
    estimate = evidence(scene.target, scene.target, Pose.identity())
    assert estimate.share == 1.0
    assert estimate.rms == 0.0
    assert estimate.explained.all()


def test_a_cloud_far_away_is_not_explained_and_holds_nothing():
    scene = room("clean")
    estimate = evidence(scene.source, scene.target, Pose.from_angle(0.0, (100.0, 0.0)))
    assert estimate.share == estimate.rms == estimate.weakest == 0.0


def test_a_known_offset_is_the_residual():
    target = np.column_stack([np.arange(6.0), np.zeros(6)])
    estimate = evidence(target[:4], target, Pose.from_angle(0.0, (0.0, 0.25)))
    assert estimate.rms == pytest.approx(0.25)
    assert estimate.share == 1.0
    assert estimate.weakest == 0.0  # a straight line does not hold the slide


def test_a_corridor_is_weak_and_a_hall_is_not():
    weak, strong = (evidence(s.source, s.target, s.truth).weakest for s in (corridor(), hall()))
    assert weak < 0.005
    assert strong > 0.2


def test_moving_both_clouds_changes_nothing():
    scene, moved = room("combo"), Pose.from_angle(2.0, (30.0, -7.0))
    pose = Pose.from_angle(0.05, (0.1, 0.0))
    first = evidence(scene.source, scene.target, pose)
    second = evidence(scene.source, moved.apply(scene.target), moved.compose(pose))
    for name in ("share", "rms", "weakest"):
        assert getattr(first, name) == pytest.approx(getattr(second, name), rel=1e-9)


def test_a_batch_is_its_single_problems():
    scenes = [room("combo", seed=seed) for seed in (40, 53)]
    source, target = (np.stack([getattr(s, name) for s in scenes]) for name in ("source", "target"))
    poses = Pose(np.stack([np.eye(2)] * 2), np.array([(0.1, 0.0), (0.0, 0.2)]))
    batch, gaps = evidence(source, target, poses), halves(source, target, poses, gate=0.5)
    for i in (0, 1):
        single = evidence(source[i], target[i], poses[i])
        for name in ("explained", "share", "rms", "weakest"):
            np.testing.assert_allclose(getattr(batch, name)[i], getattr(single, name), rtol=1e-12)
        assert gaps[i] == pytest.approx(halves(source[i], target[i], poses[i], gate=0.5), rel=1e-12)


def test_many_poses_of_one_pair_of_clouds_are_judged_at_once():
    """As in `register`, poses may have any leading axes, with one source or one target for all of them."""
    scene = room("combo")
    poses = Pose.from_angle(np.zeros((2, 3)), np.array([0.0, 0.1, 5.0])[:, None] * [1.0, 0.5])
    estimate = evidence(scene.source, scene.target, poses, 0.3)
    assert estimate.explained.shape == (2, 3, len(scene.source))
    sources = np.stack([scene.source, scene.source + 0.2])[:, None]
    separate = evidence(sources, scene.target, poses, 0.3)
    for i in (0, 1):
        for j in (0, 1, 2):
            for many, cloud in ((estimate, scene.source), (separate, sources[i, 0])):
                single = evidence(cloud, scene.target, poses[i, j], 0.3)
                for name in ("explained", "share", "rms", "weakest"):
                    np.testing.assert_allclose(getattr(many, name)[i, j], getattr(single, name), rtol=1e-12)


def test_the_usual_reach_is_three_spacings_in_any_unit():
    """Each target has its own reach; in millimetres only the lengths change, by a factor of a thousand."""
    scene = room("noise")
    pose = Pose.from_angle(0.05, (0.3, 0.1))
    usual = evidence(scene.source, scene.target, pose)
    assert usual_reach(scene.target) == 3.0 * spacing(scene.target)
    assert 0.0 < usual.share < 1.0
    np.testing.assert_array_equal(
        usual.explained, evidence(scene.source, scene.target, pose, usual_reach(scene.target)).explained
    )
    milli = Pose(pose.R, 1e3 * pose.t)
    in_mm = evidence(1e3 * scene.source, 1e3 * scene.target, milli)
    assert in_mm.share == usual.share
    assert in_mm.rms == pytest.approx(1e3 * usual.rms, rel=1e-9)
    thin = np.stack([scene.target, scene.target * 2.0])
    batch = evidence(scene.source, thin, pose)
    for i in (0, 1):
        np.testing.assert_array_equal(batch.explained[i], evidence(scene.source, thin[i], pose).explained)
    assert usual_reach([[1.0, 2.0]] * 3) == 1.0


def test_halves_without_noise_agree():
    scene = room("clean", noise=0.0)
    assert halves(scene.target, scene.target, Pose.from_angle(0.02, (0.05, 0.0)), "point-to-plane") < 1e-3


def test_halves_that_cannot_be_matched_do_not_agree():
    """Neither moves, so they end at one pose, which says nothing. So in a batch, and if one half has no weight."""
    scene = room("clean")
    far = scene.target + 100.0
    assert np.isnan(halves(scene.source, far, Pose.identity(), gate=0.5))
    both = halves(scene.source, np.stack([far, scene.target]), scene.truth, gate=0.5)
    assert np.isnan(both).tolist() == [True, False]
    every_second = np.arange(len(scene.source)) % 2.0
    assert np.isnan(halves(scene.source, scene.target, scene.truth, gate=0.5, weights=every_second))


def test_each_half_has_its_weights():
    """With the wrong points at weight zero the halves agree, for odd and for even counts of points."""
    scene = room("clean", noise=0.0)
    source = scene.target.copy()
    source[::7] += (0.8, -0.3)
    right = (np.arange(len(source)) % 7 != 0).astype(float)
    start = Pose.from_angle(0.02, (0.05, 0.0))
    for count in (len(source), len(source) - 1):
        weighted = halves(source[:count], scene.target, start, "point-to-plane", weights=right[:count])
        assert weighted < 1e-3 < halves(source[:count], scene.target, start, "point-to-plane")


def test_each_half_of_matched_rows_has_its_partners():
    """The halves' distance is that between the fits to the even and to the odd pairs, over the whole source."""
    rng = np.random.default_rng(5)
    p = rng.standard_normal((9, 2))
    q = Pose.from_angle(0.4, (1.0, 2.0)).apply(p) + 0.1 * rng.standard_normal(p.shape)
    ends = [fit_rigid(p[k::2], q[k::2]).pose.apply(p) for k in (0, 1)]
    distance = np.sqrt(np.square(ends[0] - ends[1]).sum(axis=-1).mean())
    assert halves(p, q, Pose.identity(), "kabsch") == pytest.approx(distance, rel=1e-9)
    with pytest.raises(ValueError, match=r"^target: row i must be the partner .* 9 rows and target 8"):
        halves(p, q[1:], Pose.identity(), "kabsch")


def test_what_is_refused():
    scene = room("clean")
    with pytest.raises(ValueError, match=r"^pose: a batch of shape \(0,\)"):
        evidence(scene.source, scene.target, Pose.identity(batch=(0,)))
    with pytest.raises(ValueError, match=r"^pairs: "):
        halves(scene.source, scene.target, Pose.identity(), "kabsch", pairs=[[0, 1], [1, 2]])
    with pytest.raises(ValueError, match=r"^start: both runs begin at the pose that is judged"):
        halves(scene.source, scene.target, Pose.identity(), start=Pose.identity())
    with pytest.raises(ValueError, match=r"^weights: expected shape"):
        halves(scene.source, scene.target, Pose.identity(), weights=np.ones(3))
    with pytest.raises(ValueError, match="reach"):
        evidence(scene.source, scene.target, Pose.identity(), 0.0)
    with pytest.raises(ValueError, match=r"source, target, pose: leading axes do not broadcast: source \(2,\), "):
        evidence(np.stack([scene.source] * 2), scene.target, Pose.identity(batch=(3,)))
    space = np.zeros((4, 3))
    for name, wrong in (
        ("source", (space, scene.target, Pose.identity())),
        ("target", (scene.source, space, Pose.identity())),
        ("pose", (scene.source, scene.target, Pose.identity(3))),
    ):
        with pytest.raises(ValueError, match=f"^{name}: evidence is planar, expected 2 dimensions, got 3"):
            evidence(*wrong)
    result = register(scene.source, scene.target)
    for judge in (evidence, halves):
        for wrong, way in ((np.eye(3), "Pose.from_matrix"), (result, "pass result.pose"), (None, "Pose.from_matrix")):
            with pytest.raises(ValueError, match=f"^pose: expected a Pose, got {type(wrong).__name__}; {way}"):
                judge(scene.source, scene.target, wrong)
    with pytest.raises(ValueError, match="halves"):
        halves(scene.source[:1], scene.target, Pose.identity())
    with pytest.raises(ValueError, match=r"^pose: moves points in 3 dimensions, the clouds have 2"):
        halves(scene.source, scene.target, Pose.identity(3))
    with pytest.raises(ValueError, match="gaet"):
        halves(scene.source, scene.target, Pose.identity(), gaet=1.0)


def test_the_rms_is_that_of_explained_points_alone():
    target = np.column_stack([np.arange(6.0), np.zeros(6)])
    source = np.array([[0.0, 0.25], [1.0, 0.25], [2.0, 0.25], [2.0, 50.0]])
    estimate = evidence(source, target, Pose.identity(), 0.5)
    assert estimate.share == 0.75
    assert estimate.rms == pytest.approx(0.25)
    alone = evidence(source[2:], target, Pose.identity(), 0.5)
    assert (alone.share, alone.rms) == (0.5, pytest.approx(0.25))
