"""Blocked kernel sums against the whole matrix, and against the definition where floats over- or underflow."""

import tracemalloc

import numpy as np
import pytest

from solvers.numerics import gaussians

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def clouds(rng, b=3, n=37, m=23, d=2):
    return rng.standard_normal((b, n, d)), rng.standard_normal((b, m, d)) + 0.3, rng.uniform(0.1, 1.0, b)


def kernel(rows, columns, sigma):
    squares = np.square(rows[:, :, None] - columns[:, None]).sum(axis=-1)
    return np.exp(-squares / (2.0 * sigma[:, None, None] ** 2))


@pytest.mark.parametrize("d", [2, 3])
def test_sums_are_those_of_the_whole_matrix(rng, d):
    rows, columns, sigma = clouds(rng, d=d)
    result = gaussians.sums(rows, columns, sigma, gaussians.powers(columns, 2))
    K = kernel(rows, columns, sigma)
    np.testing.assert_allclose(result[..., 0], K.sum(axis=2), rtol=1e-12)
    np.testing.assert_allclose(result[..., 1 : d + 1], K @ columns, rtol=1e-11, atol=1e-14)
    second = np.einsum("bij,bjk,bjl->bikl", K, columns, columns)
    np.testing.assert_allclose(result[..., d + 1 :].reshape(second.shape), second, rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("limit", [1, 23, 100, 400, 10**6])
@pytest.mark.parametrize("sigma", [1.0, 0.1, 1e-3])
def test_blocks_of_any_size_give_the_same(rng, limit, sigma):
    """Blocked sums over the fixed points equal those of the whole matrix to 1e-12 relative, even for a narrow kernel
    far from the origin, where products of coordinates would lose six digits."""
    rows, columns, _ = clouds(rng)
    rows, columns, width = rows + 100.0, columns + 100.0, np.full(3, sigma)
    c = np.array([0.0, 0.3, 2.0])
    whole = gaussians.shares(rows, columns, width, c, limit=10**9)
    parts = gaussians.shares(rows, columns, width, c, limit=limit)
    for name in ("row", "moments", "scatter", "log_sum"):
        a, b = getattr(whole, name), getattr(parts, name)
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-12 * np.abs(a).max(), err_msg=name)


def test_shares_are_the_sums_of_the_whole_matrix(rng):
    rows, columns, sigma = clouds(rng)
    c = np.array([0.0, 0.3, 5.0])
    result = gaussians.shares(rows, columns, sigma, c)
    K = kernel(rows, columns, sigma)
    whole = K.sum(axis=2) + c[:, None]
    P = K / whole[..., None]
    squares = np.square(rows[:, :, None] - columns[:, None]).sum(axis=-1)
    np.testing.assert_allclose(result.row, P.sum(axis=2), rtol=1e-12)
    np.testing.assert_allclose(result.moments[:, 0], P.sum(axis=1), rtol=1e-12)
    np.testing.assert_allclose(result.moments[:, 1:], rows.swapaxes(1, 2) @ P, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(result.scatter, (P * squares).sum(axis=(1, 2)), rtol=1e-12)
    np.testing.assert_allclose(result.log_sum, np.log(whole).sum(axis=1), rtol=1e-12)
    for i in range(3):
        matrix = gaussians.share_matrix(rows[i], columns[i], float(sigma[i]), float(c[i]))
        np.testing.assert_allclose(matrix, P[i], rtol=1e-12, atol=1e-300)


def test_memory_is_that_of_a_block():
    """The sums of 4000 × 4000 responsibilities take only a few blocks of memory, not 128 MB."""
    rng = np.random.default_rng(1)
    rows, columns = rng.standard_normal((1, 4000, 2)), rng.standard_normal((1, 4000, 2))
    tracemalloc.start()
    gaussians.shares(rows, columns, np.array([0.5]), np.array([0.1]))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 3e6


def test_blocks_cover_everything_once_within_the_limit():
    for b, rows, columns, limit in ((3, 5, 7, 20), (3, 5, 7, 40), (4, 5, 7, 80), (1, 1, 100, 10), (2, 9, 3, 10**6)):
        counts = np.zeros((b, rows), dtype=int)
        for problems, part in gaussians.blocks(b, rows, columns, limit):
            counts[problems, part] += 1
            entries = (problems.stop - problems.start) * (part.stop - part.start) * columns
            assert entries <= max(limit, columns)
        assert (counts == 1).all()


def test_rows_beyond_the_range_of_exponents_go_to_the_nearest():
    """Without clutter, a point so far away that all its kernels underflow still belongs to the nearest column, and the
    logarithm of its sum is right."""
    rows = np.array([[[0.0, 0.0], [1000.0, 0.0], [0.0, 1e6]]])
    columns = np.array([[[0.0, 0.5], [10.0, 0.0]]])
    sigma = np.array([0.5])
    result = gaussians.shares(rows, columns, sigma, np.zeros(1))
    np.testing.assert_allclose(result.row, 1.0, rtol=1e-12)
    np.testing.assert_allclose(result.moments[:, 0], [[2.0, 1.0]], rtol=1e-12)
    nearest = np.array([0.25, 990.0**2, (1e6 - 0.5) ** 2])
    np.testing.assert_allclose(result.log_sum, -2.0 * nearest.sum(), rtol=1e-12)
    P = gaussians.share_matrix(rows[0], columns[0], 0.5, 0.0)
    np.testing.assert_allclose(P, [[1.0, 0.0], [0.0, 1.0], [1.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("c", [1e-300, 1e-250, 1e-100, 1.0])
def test_far_rows_with_clutter_are_clutter(c):
    rows, columns = np.array([[[0.0, 0.0], [1000.0, 0.0]]]), np.array([[[0.1, 0.0]]])
    result = gaussians.shares(rows, columns, np.array([0.5]), np.array([c]))
    expected = np.exp(-0.02) / (np.exp(-0.02) + c)
    np.testing.assert_allclose(result.row, [[expected, 0.0]], atol=1e-12)
    np.testing.assert_allclose(result.log_sum, np.log(np.exp(-0.02) + c) + np.log(c), rtol=1e-12)


def test_as_sigma_vanishes_the_nearest_takes_everything():
    """As σ goes to zero, each point's responsibility goes to its nearest neighbour; with clutter, only exact matches
    keep any."""
    rng = np.random.default_rng(5)
    rows, columns = rng.standard_normal((20, 2)), rng.standard_normal((15, 2))
    rows[0] = columns[4]
    nearest = np.square(rows[:, None] - columns).sum(axis=2).argmin(axis=1)
    sharp = gaussians.share_matrix(rows, columns, 1e-4, 0.0)
    np.testing.assert_allclose(sharp, np.eye(15)[nearest], atol=1e-6)
    with_clutter = gaussians.share_matrix(rows, columns, 1e-4, 1e-8)
    np.testing.assert_allclose(with_clutter.sum(axis=1), np.arange(20) == 0, atol=1e-6)
