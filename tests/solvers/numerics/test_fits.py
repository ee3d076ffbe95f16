"""Sizes of clouds, the lengths and volumes that follow from them, and the fit that a step of a run takes."""

from itertools import product

import numpy as np
import pytest

from solvers import Pose, fit_planar, fit_rigid
from solvers.numerics.fits import fit_pairs, lengths, rms_radius, spread_volume

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.mark.parametrize("d", [2, 3, 5])
def test_the_volume_is_that_of_the_cube_that_evenly_spread_points_fill(d, rng, random_pose):
    """Points at ±a/√12 along every axis have the moments of a uniform cube of side a: its volume is theirs. A turn or a
    shift does not change it, a scale s does by sᵈ, and points on a line have one."""
    corners = np.array(list(product((-1.0, 1.0), repeat=d))) / np.sqrt(12.0)
    sides = np.array([0.3, 1.0, 40.0])
    cubes = sides[:, None, None] * corners
    np.testing.assert_allclose(spread_volume(cubes), sides**d, rtol=1e-12)
    even = rng.uniform(0.0, 7.0, (1, 200_000, d))
    np.testing.assert_allclose(spread_volume(even), 7.0**d, rtol=0.02)
    cloud = rng.standard_normal((4, 30, d)) * np.arange(1.0, d + 1.0)
    plain = spread_volume(cloud)
    np.testing.assert_allclose(spread_volume(3.0 * cloud + 11.0), 3.0**d * plain, rtol=1e-9)
    turn = np.linalg.qr(rng.standard_normal((d, d)))[0]
    np.testing.assert_allclose(spread_volume(cloud @ turn), plain, rtol=1e-9)
    line = np.linspace(0.0, 1.0, 9)[None, :, None] * np.arange(1.0, d + 1.0)
    assert spread_volume(line)[0] > 0.0


@pytest.mark.parametrize("size", [1e-150, 1e-9, 1e9, 1e149])
def test_neither_leaves_the_range_of_numbers(size, rng):
    """However small or large the cloud is, the volume and the square of the length can be divided by."""
    cloud = size * rng.standard_normal((1, 20, 3))
    assert 0.0 < spread_volume(cloud)[0] < np.inf
    assert 0.0 < np.square(lengths(None, 0.1, cloud)[0]) < np.inf


def test_a_length_is_the_one_given_or_a_share_of_the_radius(rng):
    cloud = rng.standard_normal((3, 20, 2)) * np.array([1.0, 5.0, 1e-4])[:, None, None]
    assert lengths(0.7, 0.1, cloud).tolist() == [0.7, 0.7, 0.7]
    np.testing.assert_allclose(lengths(None, 0.1, cloud), 0.1 * rms_radius(cloud), rtol=1e-15)


@pytest.mark.parametrize("d", [2, 3])
def test_a_steps_fit_is_the_public_one_bit_for_bit(d, rng, random_pose):
    """Without looking at the clouds again: poses, conditions and reasons of ordinary, tiny, huge and hardly weighted
    pairs are those of `fit_planar` and `fit_rigid`."""
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
    """Equal points bring their centroids together under the present rotation; pairs without weight leave the pose as it
    is; the pairs beside them get what they get alone."""
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
