"""Thinning keeps a cloud's shape to within its cells, is deterministic, and never leaves more points than requested."""

import numpy as np
import pytest

from solvers.geometry.downsample import slab, spacing, thinned


@pytest.mark.parametrize("d", [2, 3])
def test_what_is_left_stands_for_all(rng, d):
    """It leaves at most the requested number and not far fewer; every point has one of those left within its cell."""
    p = rng.uniform(0.0, [4.0, 3.0, 2.0][:d], (5000, d)) + 5e5
    for most in (1, 7, 300, 4999):
        result = thinned(p, most)
        assert most / 4 < len(result) <= most
        gaps = np.linalg.norm(p[::50, None] - result[None], axis=2).min(axis=1)
        volume = np.prod([4.0, 3.0, 2.0][:d])
        assert gaps.max() <= np.sqrt(d) * 3.5 * (volume / len(result)) ** (1 / d)
        assert np.array_equal(result, thinned(p, most))
    assert np.array_equal(thinned(p, 5000), p)


def test_centroids_keep_the_mean_of_a_cell(rng):
    """Thinned to one point, a cloud becomes its centroid, even far from the origin."""
    p = rng.normal(size=(2000, 2)) + np.array([3e6, -4e6])
    np.testing.assert_allclose(thinned(p, 1)[0], p.mean(axis=0), rtol=0, atol=1e-8)


def test_equal_and_collinear_points():
    """A thousand points at one place become one; those on a line are thinned along it."""
    assert thinned(np.full((1000, 2), 7.0), 10).tolist() == [[7.0, 7.0]]
    line = np.stack([np.linspace(0, 1, 1000), np.zeros(1000)], axis=1)
    result = thinned(line, 100)
    assert 50 < len(result) <= 100
    assert (result[:, 1] == 0.0).all()


def test_a_slab_is_closed_and_seen_from_above():
    p = np.array([[0.0, 1.0, 0.0], [1.0, 2.0, 0.5], [2.0, 3.0, 1.0], [3.0, 4.0, 1.1]])
    assert slab(p, 0.5, 1.0).tolist() == [[1.0, 2.0], [2.0, 3.0]]
    assert slab(p, 5.0, 6.0).shape == (0, 2)
    with pytest.raises(ValueError, match="points: expected 3 coordinates"):
        slab(p[:, :2], 0.0, 1.0)


@pytest.mark.parametrize("wrong", ["a", None, float("nan")])
def test_a_limit_is_a_number(wrong):
    """A limit may be infinite; one that is not a number would leave the cloud empty."""
    p = np.array([[0.0, 1.0, 0.0], [1.0, 2.0, 0.5]])
    assert np.array_equal(slab(p, -np.inf, np.inf), p[:, :2])
    for name in ("low", "high"):
        with pytest.raises(ValueError, match=f"^{name}: expected a"):
            slab(p, **{"low": 0.0, "high": 1.0, name: wrong})


def test_bisection_finds_a_border_that_need_not_be_the_finest():
    """As `thinned` says: on this line 8 cells along the side are few enough, 9 are not, and 13 would be again."""
    x = np.array([0.0, 1.0, 0.61, 0.73, 0.54])
    counts = {n: len(np.unique(np.minimum(np.floor(x * n), n - 1))) for n in (8, 9, 13)}
    assert counts == {8: 4, 9: 5, 13: 4}
    result = thinned(np.stack([x, 0.0 * x], axis=1), 4)
    np.testing.assert_allclose(result[:, 0], [0.0, 0.575, 0.73, 1.0])


@pytest.mark.parametrize("function", [lambda p: slab(p, 0.0, 1.0), lambda p: thinned(p, 2), spacing])
def test_a_batch_is_refused(function):
    """Its leading axes would be mistaken for points."""
    with pytest.raises(ValueError, match=r"^points: expected one cloud of shape \(n, [d3]\), got \(2, 5, 3\)"):
        function(np.random.default_rng(3).standard_normal((2, 5, 3)))


def test_cells_of_four_dimensions_are_refused():
    """Their indices would exceed 63 bits."""
    with pytest.raises(ValueError, match=r"^points: expected 2 or 3 coordinates per point, got 4"):
        thinned(np.random.default_rng(3).standard_normal((9, 4)), 2)


def test_spacing_is_that_of_distinct_places():
    """A square lattice has its lattice constant, even if its points are doubled; a single place has spacing zero."""
    x, y = np.meshgrid(np.arange(6) * 0.25, np.arange(5) * 0.25)
    lattice = np.stack([x.ravel(), y.ravel()], axis=1)
    assert spacing(np.concatenate([lattice, lattice])) == pytest.approx(0.25)
    assert spacing([[1.0, 2.0]] * 3) == 0.0
