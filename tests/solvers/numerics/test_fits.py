"""Sizes of clouds, the lengths and volumes derived from them, and the fit that one step of a run uses."""

from itertools import product

import numpy as np
import pytest

from solvers import Pose, fit_planar, fit_rigid
from solvers.numerics.fits import (
    fit_pairs,
    lengths,
    pair_width,
    rms_motion,
    rms_radius,
    spread_volume,
    typical_radius,
    weighted_centroid,
    weighted_radius,
)

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.mark.parametrize("d", [2, 3, 5])
def test_the_volume_is_that_of_the_cube_that_evenly_spread_points_fill(d, rng):
    """Points at ±a/√12 along every axis have the moments of a uniform cube of side a, and so its volume. A turn or a
    shift does not change the volume, a scale s multiplies it by sᵈ, and points on a line have a volume of one."""
    corners = np.array(list(product((-1.0, 1.0), repeat=d))) / np.sqrt(12.0)
    sides = np.array([0.3, 1.0, 40.0])
    cubes = sides[:, None, None] * corners
    np.testing.assert_allclose(spread_volume(cubes), sides**d, rtol=1e-12)
    fill = rng.uniform(0.0, 7.0, (1, 200_000, d))
    np.testing.assert_allclose(spread_volume(fill), 7.0**d, rtol=0.02)
    cloud = rng.standard_normal((4, 30, d)) * np.arange(1.0, d + 1.0)
    plain = spread_volume(cloud)
    np.testing.assert_allclose(spread_volume(3.0 * cloud + 11.0), 3.0**d * plain, rtol=1e-9)
    turn = np.linalg.qr(rng.standard_normal((d, d)))[0]
    np.testing.assert_allclose(spread_volume(cloud @ turn), plain, rtol=1e-9)
    line = np.linspace(0.0, 1.0, 9)[None, :, None] * np.arange(1.0, d + 1.0)
    assert spread_volume(line)[0] > 0.0


@pytest.mark.parametrize("size", [1e-150, 1e-9, 1e9, 1e149])
def test_neither_leaves_the_range_of_numbers(size, rng):
    """However small or large the cloud, the volume and the squared length are positive and finite."""
    cloud = size * rng.standard_normal((1, 20, 3))
    assert 0.0 < spread_volume(cloud)[0] < np.inf
    assert 0.0 < np.square(lengths(None, 0.1, cloud)[0]) < np.inf


def test_a_length_is_the_one_given_or_a_share_of_the_radius(rng):
    cloud = rng.standard_normal((3, 20, 2)) * np.array([1.0, 5.0, 1e-4])[:, None, None]
    assert lengths(0.7, 0.1, cloud).tolist() == [0.7, 0.7, 0.7]
    np.testing.assert_allclose(lengths(None, 0.1, cloud), 0.1 * rms_radius(cloud), rtol=1e-15)


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e9])
def test_no_stray_decides_the_typical_radius(unit, rng):
    """A stray in forty, fifty or more median distances away, leaves the radius as that of the others. A cloud without
    strays, or with most of its points at one place, has its RMS radius, bit for bit."""
    cloud = unit * (rng.standard_normal((3, 40, 2)) + 7.0)
    assert np.array_equal(typical_radius(cloud), rms_radius(cloud))
    for distance in (50.0, 1e6):
        stray = np.concatenate([cloud, cloud[:, :1] + distance * unit], axis=1)
        np.testing.assert_allclose(typical_radius(stray), rms_radius(cloud), rtol=1e-12)
        assert (rms_radius(stray) > 3.0 * rms_radius(cloud)).all()
    heap = np.where(np.arange(40)[:, None] < 30, cloud[:, :1], cloud)
    assert np.array_equal(typical_radius(heap), rms_radius(heap))


@pytest.mark.parametrize("d", [2, 3])
def test_a_width_is_that_of_all_pairs_without_strays(d, rng):
    """Agrees with the RMS over all differences of two clouds, in any unit; neither a stray in either or both nor the
    rest of the batch changes it."""
    p, q = rng.standard_normal((1, 20, d)) + 3.0, rng.standard_normal((1, 30, d)) * np.arange(1.0, d + 1.0)
    width = np.sqrt(np.square(p[0][:, None] - q[0]).mean())
    with_strays = [np.concatenate([cloud, np.full((1, 1, d), 1e3)], axis=1) for cloud in (p, q)]
    for unit in (1e-140, 1.0, 1e140):
        np.testing.assert_allclose(pair_width(unit * p, unit * q), unit * width, rtol=1e-12)
        for moved, fixed in ((with_strays[0], q), (p, with_strays[1]), with_strays):
            np.testing.assert_allclose(pair_width(unit * moved, unit * fixed), unit * width, rtol=1e-12)
    np.testing.assert_allclose(spread_volume(with_strays[1]), spread_volume(q), rtol=1e-12)
    batch = np.concatenate([with_strays[1], np.concatenate([q, q[:, :1]], axis=1)])
    assert pair_width(batch[:, ::-1], batch)[1] == pair_width(batch[1:, ::-1], batch[1:])[0]


def test_weighted_sizes_are_the_weighted_means(rng):
    """Centroid, radius and motion agree with numpy's averages; with equal weights, whatever their value, they equal the
    unweighted sizes bit for bit, even beside a problem whose weights differ."""
    points, steps = rng.standard_normal((2, 3, 20, 2))
    w = rng.random((3, 20))
    centroid, radius, motion = weighted_centroid(points, w), weighted_radius(points, w), rms_motion(steps, w)
    for i in range(3):
        mean = np.average(points[i], axis=0, weights=w[i])
        np.testing.assert_allclose(centroid[i], mean, rtol=1e-12)
        squares = np.average(np.square(points[i] - mean).sum(axis=1), weights=w[i])
        np.testing.assert_allclose(radius[i], np.sqrt(squares), rtol=1e-12)
        squares = np.average(np.square(steps[i]).sum(axis=1), weights=w[i])
        np.testing.assert_allclose(motion[i], np.sqrt(squares), rtol=1e-12)
    w[:2] = 0.7
    assert np.array_equal(weighted_centroid(points, w)[:2], points.mean(axis=1)[:2])
    assert np.array_equal(weighted_radius(points, w)[:2], rms_radius(points)[:2])
    assert np.array_equal(rms_motion(steps, w)[:2], rms_motion(steps)[:2])


@pytest.mark.parametrize("distance", [1e3, 1e9, np.inf])
def test_a_row_counts_as_little_as_its_weight(distance, rng):
    """A row with zero weight may be anywhere; with a weight of 1e-30 it has no visible effect."""
    points = rng.standard_normal((1, 20, 2))
    cloud = np.concatenate([points, np.full((1, 1, 2), distance)], axis=1)
    for weight in (0.0, 1e-30) if np.isfinite(distance) else (0.0,):
        w = np.r_[np.ones(20), weight][None]
        np.testing.assert_allclose(weighted_centroid(cloud, w), points.mean(axis=1), rtol=1e-9)
        np.testing.assert_allclose(weighted_radius(cloud, w), rms_radius(points), rtol=1e-9)
        np.testing.assert_allclose(rms_motion(cloud, w), rms_motion(points), rtol=1e-9)
    nothing = np.zeros((1, 21))
    assert weighted_radius(cloud, nothing).tolist() == [1.0]
    assert rms_motion(cloud, nothing).tolist() == [0.0]


@pytest.mark.parametrize("d", [2, 3])
def test_a_steps_fit_is_the_public_one_bit_for_bit(d, rng, random_pose):
    """For ordinary, tiny, huge and barely weighted pairs, poses, conditions and reasons are those of `fit_planar` and
    `fit_rigid`, although the clouds are not validated again."""
    size = np.array([1.0, 1e-150, 1e148, 1.0, 1.0, 1.0])[:, None, None]
    p = rng.standard_normal((6, 20, d))
    p, q = size * p, size * (random_pose(rng, d, (6,)).apply(p) + 0.1 * p[:, ::-1])
    w = rng.random((6, 20)) * np.array([1.0, 1.0, 1.0, 1e-149, 1e149, 1.0])[:, None]
    w[5, 4:] = 0.0
    fit = (fit_planar if d == 2 else fit_rigid)(p, q, w)
    pose, reason, condition = fit_pairs(Pose.identity(d, (6,)), p, q, w)
    for name in ("R", "t", "scale"):
        assert np.array_equal(getattr(pose, name), getattr(fit.pose, name)), name
    assert np.array_equal(condition, fit.condition)
    assert reason.tolist() == fit.reason.tolist() == [""] * 6


def test_where_the_rotation_is_open_a_step_keeps_the_present_one(rng, random_pose):
    """Equal points align their centroids under the current rotation; pairs without weight leave the pose as it is;
    other problems in the batch get what they get alone."""
    p, q = rng.standard_normal((2, 3, 10, 2))
    w = rng.random((3, 10))
    p[1], w[2] = p[1, 0], 0.0
    before = random_pose(rng, 2, (3,))
    pose, reason, condition = fit_pairs(before, p, q, w)
    alone, _, _ = fit_pairs(before[:1], p[:1], q[:1], w[:1])
    assert np.array_equal(pose.R[:1], alone.R)
    assert np.array_equal(pose.t[:1], alone.t)
    assert np.array_equal(pose.R[1:], before.R[1:])
    assert reason[0] == ""
    assert "all source points with weight are equal" in reason[1]
    assert reason[2] == "all weights are zero"
    assert np.isinf(condition[1:]).all()
    mean_p, mean_q = (np.average(x[1], axis=0, weights=w[1]) for x in (p, q))
    np.testing.assert_allclose(pose[1].apply(mean_p[None])[0], mean_q, atol=1e-12)
    assert np.array_equal(pose.t[2], before.t[2])
