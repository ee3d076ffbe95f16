"""Sizes of clouds, and the lengths and volumes that follow from them."""

from itertools import product

import numpy as np
import pytest

from solvers.numerics.fits import lengths, rms_radius, spread_volume

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
