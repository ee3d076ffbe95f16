"""The mug: its points lie on it, both clouds are drawn independently, and the options do what they say."""

import numpy as np
import pytest

from solvers import Status, register
from solvers.metrics import rre, rte
from solvers.mug_scene import AXIS, GRIP, HEIGHT, PAIRS, RADIUS, TRUTH, TUBE, mug, mug_pairs, mug_start


def upright(scene):
    """Both clouds in the mug's own coordinates."""
    return scene.truth.apply(scene.source), scene.target


def distances(points):
    """Each point's distance to the nearest of wall, floor and handle, in u."""
    x, y, z = points.T
    reach = np.hypot(x, y)
    wall = np.hypot(reach - RADIUS, np.maximum(np.abs(z) - HEIGHT / 2, 0.0))
    floor = np.hypot(np.maximum(reach - RADIUS, 0.0), z + HEIGHT / 2)
    turn = np.linspace(-np.pi / 2, np.pi / 2, 4001)
    arc = np.column_stack([RADIUS + GRIP[0] * np.cos(turn), 0.0 * turn, GRIP[1] * np.sin(turn)])
    grip = np.abs(np.linalg.norm(points[:, None] - arc, axis=2).min(axis=1) - TUBE)
    return np.min([wall, floor, grip], axis=0)


@pytest.mark.parametrize("handle", [True, False])
@pytest.mark.parametrize("overlap", [1.0, 0.5, 0.0])
def test_without_noise_every_point_lies_on_the_mug(handle, overlap):
    """Both clouds lie within 0.002 u of it: the handle's centre line is a polyline."""
    for cloud in upright(mug(noise=0.0, handle=handle, overlap=overlap)):
        assert len(cloud) > 100
        assert distances(cloud).max() < 2e-3
        assert (np.abs(cloud[:, 0]).max() > RADIUS + 0.5) == handle


def test_points_are_shared_out_by_area_and_evenly():
    """Of 320 points, each quarter of the wall and each quarter of its height gets its share, to within a few points."""
    for cloud in upright(mug(noise=0.0)):
        wall = cloud[(np.abs(np.hypot(cloud[:, 0], cloud[:, 1]) - RADIUS) < 1e-9) & (cloud[:, 2] > -HEIGHT / 2)]
        area = 2 * np.pi * RADIUS * HEIGHT
        whole = area + np.pi * RADIUS**2 + 2 * np.pi * TUBE * 2.13  # half the ellipse's circumference
        assert len(wall) == pytest.approx(320 * area / whole, abs=2)
        quarters = np.histogram(np.arctan2(wall[:, 1], wall[:, 0]), 4, (-np.pi, np.pi))[0]
        heights = np.histogram(wall[:, 2], 4, (-HEIGHT / 2, HEIGHT / 2))[0]
        assert np.ptp(quarters) <= 8
        assert np.ptp(heights) <= 2


def test_no_point_of_one_cloud_is_one_of_the_other():
    p, q = upright(mug(noise=0.0))
    assert np.linalg.norm(p[:, None] - q, axis=2).min() > 1e-4


@pytest.mark.parametrize("overlap", [0.0, 0.25, 0.5, 0.75, 1.0])
def test_the_overlap_is_the_share_of_the_turn_that_both_see(overlap):
    """On a fine sampling, both clouds see this share of the directions from the axis that either one sees."""
    masks = []
    for cloud in upright(mug(points=6000, noise=0.0, overlap=overlap, handle=False)):
        wall = cloud[np.hypot(cloud[:, 0], cloud[:, 1]) > RADIUS - 1e-9]
        masks.append(np.histogram(np.arctan2(wall[:, 1], wall[:, 0]), 240, (-np.pi, np.pi))[0] > 0)
    first, second = masks
    assert (first | second).all()
    assert (first & second).sum() / first.sum() == pytest.approx(overlap, abs=0.03)
    assert overlap == 0.0 or (first & second)[118:122].all(), "the handle's side"


def test_noise_stretches_one_draw_and_overlap_only_takes_points_away():
    clean, single, double = (np.concatenate(upright(mug(noise=s))) for s in (0.0, 0.05, 0.1))
    np.testing.assert_allclose(double - clean, 2.0 * (single - clean), atol=1e-12)
    assert (single - clean).std() == pytest.approx(0.05, rel=0.1)
    whole, half = mug(), mug(overlap=0.5)
    for more, less in ((whole.source, half.source), (whole.target, half.target)):
        assert len(less) < 0.8 * len(more)
        assert {tuple(p) for p in less.tolist()} <= {tuple(p) for p in more.tolist()}
    assert not np.array_equal(mug(seed=41).target, whole.target)


def test_the_truth_takes_the_outline_onto_the_mug():
    for line in mug().outline:
        places = TRUTH.apply(line)
        assert distances(places).max() < TUBE + 1e-6  # the handle's centre line is a tube's radius below its surface
    assert len(mug(handle=False).outline) == 2


@pytest.mark.parametrize("name", PAIRS)
def test_pairs_are_places_of_the_mug_with_their_partners(name):
    assert distances(PAIRS[name]).max() < 1e-9
    pairs = mug_pairs(name)
    np.testing.assert_allclose(TRUTH.apply(pairs.source), pairs.target, atol=1e-12)
    spread = np.linalg.svd(PAIRS[name] - PAIRS[name].mean(axis=0), compute_uv=False)
    assert (spread > 1e-3).sum() == {"line": 1, "four": 3}[name]
    noisy = mug_pairs(name, noise=0.1)
    assert np.abs(noisy.target - pairs.target).max() > 0.01
    np.testing.assert_array_equal(noisy.source, pairs.source)


def test_a_start_is_as_far_from_the_truth_as_it_says():
    start = mug_start(70.0, 0.6)
    assert np.degrees(rre(start, TRUTH)) == pytest.approx(70.0)
    middle = TRUTH.inverse().t[None]
    assert np.linalg.norm(start.apply(middle)) == pytest.approx(0.6)
    np.testing.assert_allclose(mug_start(0.0, 0.0).matrix, TRUTH.matrix, atol=1e-12)
    assert np.linalg.norm(AXIS) == pytest.approx(1.0)


@pytest.mark.parametrize(("method", "degrees"), [("icp", 20.0), ("point-to-plane", 2.0), ("gicp", 2.0)])
def test_methods_of_the_plane_run_on_it(method, degrees):
    """From 30° off, each converges near the truth, as near as the sampling lets it."""
    scene = mug()
    result = register(scene.source, scene.target, method, start=mug_start(30.0, 0.3))
    assert result.status is Status.CONVERGED
    assert np.degrees(rre(result.pose, scene.truth)) < degrees
    assert rte(result.pose, scene.truth) < 0.1


def test_four_pairs_fix_the_pose_and_three_in_a_line_do_not():
    four, line = mug_pairs("four"), mug_pairs("line")
    result = register(four.source, four.target, "kabsch")
    np.testing.assert_allclose(result.pose.matrix, TRUTH.matrix, atol=1e-12)
    assert register(line.source, line.target, "kabsch").status is Status.DEGENERATE


@pytest.mark.parametrize(
    "wrong",
    [
        *[{"seed": -1}, {"points": 19}, {"noise": -0.1}, {"overlap": 1.1}, {"overlap": float("nan")}],
        *[{"handle": float("nan")}, {"handle": -1}, {"handle": 3}, {"handle": 0.5}, {"handle": None}],
    ],
)
def test_bad_values_are_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        mug(**wrong)
