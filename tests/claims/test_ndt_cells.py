"""Chapter 4a: what a cell's Gaussian keeps of a scan, and what it loses."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.methods.ndt.floor import FLOOR
from solvers.methods.ndt.ndt_map import NdtMap, build
from solvers.methods.ndt.score import score_map
from solvers.scenes.walls import ndt_room
from solvers.studies.race import SEEDS


def single_cell(points: np.ndarray, size: float = 10.0) -> NdtMap:
    """The map of points that all lie in one cell, with its corner at (−size/2, −size/2)."""
    return build(points[None], size, offset=np.full(2, -size / 2))


def eigenvalues(points: np.ndarray) -> np.ndarray:
    cells = single_cell(points)
    assert cells.kept[0].tolist() == [True]
    return np.linalg.eigvalsh(cells.covariance[0, 0])


def evenly(length: float, n: int) -> np.ndarray:
    """The midpoints of n equal parts of a length that starts at 0."""
    return (np.arange(n) + 0.5) * length / n


def corner(arm: float, n: int) -> np.ndarray:
    """Two walls of length `arm` that meet at the origin, n points on each."""
    along, zero = evenly(arm, n), np.zeros(n)
    return np.vstack([np.column_stack([along, zero]), np.column_stack([zero, along])])


@pytest.mark.parametrize("length", [0.4, 1.0, 3.0])
def test_the_long_axis_of_a_wall_says_how_much_of_it_the_cell_holds(length):
    """For an evenly sampled straight wall of length L without noise, λ₁ = L²/12 (1 − 1/n²) and λ₂ = 0."""
    n, turn = 60, np.array([np.cos(0.7), np.sin(0.7)])
    low, high = eigenvalues((evenly(length, n) - length / 2)[:, None] * turn)
    assert high == pytest.approx(length**2 / 12 * (1 - 1 / n**2), rel=1e-9)
    assert abs(low) < 1e-12 * high


def test_the_short_axis_of_a_wall_is_its_noise():
    """Over 5,000 draws, the variance of n points across a straight wall is σ² (n − 1)/n on average, and along the short
    axis, which is fitted to the same points, σ² (n − 2)/n: for four points, half of σ²."""
    rng, sigma = np.random.default_rng(40), 0.05
    for n in (4, 8):
        along = np.broadcast_to(evenly(2.0, n) - 1.0, (5000, n))
        clouds = np.stack([along, np.zeros((5000, n))], axis=2) + sigma * rng.standard_normal((5000, n, 2))
        covariance = build(clouds, 10.0, offset=np.full(2, -5.0)).covariance[:, 0]
        assert covariance[:, 1, 1].mean() == pytest.approx(sigma**2 * (n - 1) / n, rel=0.03)
        assert np.linalg.eigvalsh(covariance)[:, 0].mean() == pytest.approx(sigma**2 * (n - 2) / n, rel=0.03)


@pytest.mark.parametrize("arm", [0.5, 1.0])
def test_a_corner_has_a_width_without_any_noise(arm):
    """Two arms of length a, without noise: λ₁ = a²/6 along the line joining their ends, λ₂ = a²/24 across it."""
    low, high = eigenvalues(corner(arm, 400))
    assert [low, high] == pytest.approx([arm**2 / 24, arm**2 / 6], rel=1e-4)


def test_the_best_place_in_a_corner_is_on_neither_wall():
    """A single point scores highest at the mean, a/4 from both walls; in the corner itself it scores e^(−3/2), less
    than a quarter of that."""
    arm = 1.0
    cells = single_cell(corner(arm, 400))
    at = np.linspace(-0.5, 1.5, 401)
    values = score_map(cells, np.zeros((1, 2)), at, at)
    row, column = np.unravel_index(values.argmax(), values.shape)
    assert [at[column], at[row]] == pytest.approx([arm / 4, arm / 4], abs=0.003)
    assert values.max() == pytest.approx(1.0, abs=1e-3)
    assert score_map(cells, np.zeros((1, 2)), np.zeros(1), np.zeros(1))[0, 0] == pytest.approx(np.exp(-1.5), rel=0.02)


def test_two_walls_in_a_cell_become_one_between_them():
    """Parallel walls d apart: the variance across them is d²/4, and a point in the empty middle scores one."""
    d, along = 0.8, evenly(1.0, 50) - 0.5
    walls = np.vstack([np.column_stack([along, np.full(50, side * d / 2)]) for side in (-1, 1)])
    cells = single_cell(walls)
    assert cells.covariance[0, 0, 1, 1] == pytest.approx(d**2 / 4)
    scores = score_map(cells, np.zeros((1, 2)), np.zeros(1), np.array([0.0, d / 2]))[:, 0]
    assert scores == pytest.approx([1.0, np.exp(-0.5)])


def test_equal_moments_are_one_map():
    """The outline of a square and a cross of four heaps with the same mean and covariance give the same Gaussian."""
    side = evenly(1.0, 25) - 0.5
    low, high = np.full(25, -0.5), np.full(25, 0.5)
    square = np.vstack([np.column_stack(p) for p in ((side, low), (side, high), (low, side), (high, side))])
    reach = np.sqrt(2 * square[:, 0].var())
    heaps = np.repeat(reach * np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]), 25, axis=0)
    first, second = single_cell(square), single_cell(heaps)
    np.testing.assert_allclose(first.mean, second.mean, atol=1e-12)
    np.testing.assert_allclose(first.precision, second.precision, rtol=1e-9, atol=1e-9)
    assert first.count[0, 0] == second.count[0, 0]


def test_small_cells_lose_points():
    """25 draws of the room: cells of 1 u cover more than 99 % of its points, cells of 0.4 u less than 90 %, cells of
    0.3 u less than half."""

    def coverage(size: float) -> float:
        parts = []
        for seed in SEEDS:
            target = ndt_room(seed=seed).target
            cells = build(target[None], size)
            parts.append(cells.count[0][cells.kept[0]].sum() / len(target))
        return float(np.mean(parts))

    assert coverage(1.0) > 0.99
    assert coverage(0.4) < 0.9
    assert coverage(0.3) < 0.5


def test_a_larger_cell_adds_the_scatter_of_the_means():
    """The covariance of merged cells is the weighted mean of theirs plus the covariance of their means."""
    target = ndt_room(noise=0.2).target
    small, large = build(target[None], 0.9), build(target[None], 1.8)
    count = 0
    for k in np.flatnonzero(large.kept[0]):
        inside = np.floor((small.corner[0] + 0.45) / 1.8) == np.round(large.corner[0, k] / 1.8)
        parts = np.flatnonzero(inside.all(axis=1) & (small.count[0] > 0))
        n, means = small.count[0, parts], small.mean[0, parts]
        assert n.sum() == large.count[0, k]
        offsets = means - large.mean[0, k]
        within = np.einsum("k,kij->ij", n, small.covariance[0, parts])
        between = np.einsum("k,ki,kj->ij", n, offsets, offsets)
        np.testing.assert_allclose(large.covariance[0, k], (within + between) / n.sum(), atol=1e-12)
        count += len(parts) > 1
    assert count >= 8


def test_a_nudge_by_a_whole_cell_changes_nothing_and_by_half_a_cell_the_map():
    """Shifting the grid by h gives the same cells; by h/2, the same points make different Gaussians: along x, along y
    and along both, in five draws."""
    for seed in SEEDS[:5]:
        target = ndt_room(seed=seed).target
        for way in np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]):
            at_rest, whole, half = (build(target[None], 1.0, offset=shift * way) for shift in (0.0, 1.0, 0.5))
            order = [np.lexsort(cells.mean[0].T) for cells in (at_rest, whole)]
            np.testing.assert_allclose(at_rest.mean[0][order[0]], whole.mean[0][order[1]], atol=1e-12)
            np.testing.assert_allclose(at_rest.covariance[0][order[0]], whole.covariance[0][order[1]], atol=1e-12)
            gaps = np.linalg.norm(half.mean[0][:, None] - at_rest.mean[0], axis=2).min(axis=1)
            assert (gaps > 0.05).mean() > 0.5


def test_without_noise_the_floor_decides_how_sharp_a_wall_is():
    """For exactly measured straight walls, λ₂ is raised to λ₁/1000, so the ellipse is √1000 times as long as wide."""
    cells = build(ndt_room(noise=0.0).target[None], 1.0)
    kept = cells.kept[0]
    low, _ = np.linalg.eigvalsh(cells.covariance[0][kept]).T
    straight = low < 1e-12
    assert straight.sum() >= 15
    least, most = np.linalg.eigvalsh(cells.precision[0][kept][straight]).T
    np.testing.assert_allclose(most / least, 1 / FLOOR, rtol=1e-6)
