"""Distances by look-up: never above the exact ones, and close to them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.methods.search.distance_grid import MOST, ROUNDING, build


def exact(points, cloud):
    return np.sqrt(np.square(points[:, None] - cloud[None]).sum(axis=-1).min(axis=1))


def floor(grid, points):
    """A lower bound of the distance, as `bounds.coarse` takes it: too low by at most twice the error in the grid."""
    cells = ((points - grid.low) / grid.cell).astype(np.float32)
    error = grid.error + ROUNDING * grid.cell * np.abs(cells).max(initial=1.0)
    return np.maximum(grid.look_up(cells[..., 0], cells[..., 1]) - error, 0.0)


@settings(max_examples=40, deadline=None, derandomize=True, database=None)
@given(st.integers(0, 2**32), st.integers(1, 60), st.floats(0.02, 0.4), st.floats(0.0, 1e3))
def test_the_floor_is_never_above_the_distance(seed, n, cell, away):
    """Inside the grid, beside it and far from it; inside, it is too low by at most a cell's diagonal."""
    rng = np.random.default_rng(seed)
    cloud = rng.uniform(-2.0, 2.0, (n, 2)) * rng.uniform(0.01, 1.0, 2)
    grid = build(cloud, cell, margin=0.5)
    inside = rng.uniform(cloud.min(axis=0) - 0.5, cloud.max(axis=0) + 0.5, (300, 2))
    everywhere = rng.normal(0.0, 1.0 + away, (300, 2))
    distances = exact(inside, cloud)
    assert (floor(grid, inside) <= distances).all()
    assert (floor(grid, everywhere) <= exact(everywhere, cloud)).all()
    assert (distances - floor(grid, inside)).max() <= 2.001 * grid.error + 1e-4


def test_a_dense_cloud_is_told_to_within_a_cell(rng):
    """If a cell lists too few points to decide which is nearest, the whole cloud is searched."""
    along = np.linspace(0.0, 9.0, 300)
    cloud = np.stack([along, np.sin(along)], axis=1) + 0.1 * rng.standard_normal((300, 2))
    grid = build(cloud, 0.02, margin=0.8)
    points = cloud[rng.integers(0, 300, 2000)] + rng.uniform(-0.3, 0.3, (2000, 2))
    errors = exact(points, cloud) - floor(grid, points)
    assert errors.min() >= 0.0
    assert errors.max() <= 2.001 * grid.error


def test_what_is_not_listed_is_no_nearer_than_said(rng):
    cloud = rng.uniform(-1.0, 1.0, (50, 2))
    grid = build(cloud, 0.05, margin=0.3)
    points = rng.uniform(-3.0, 3.0, (500, 2))
    candidates, floors = grid.candidates(points)
    distances = np.sqrt(np.square(points[:, None] - cloud[None]).sum(axis=-1))
    for i in range(500):
        unlisted = ~(cloud[:, None] == candidates[i][None]).all(axis=-1).any(axis=1)
        assert distances[i, unlisted].min() >= floors[i] - 1e-12


@pytest.mark.parametrize("stretch", [1.0, 1e4])
def test_a_grid_has_a_bounded_size(stretch):
    """A long cloud gets larger cells rather than more of them."""
    grid = build(np.array([[0.0, 0.0], [stretch, 1.0]]), 0.05, margin=1.0)
    assert max(grid.shape) <= MOST + 10
    assert floor(grid, np.array([[0.5 * stretch, 0.5]]))[0] <= np.hypot(0.5 * stretch, 0.5)
