"""Frequencies and the kernels that they produce: closed forms against means over many waves."""

import numpy as np
import pytest

from solvers.numerics.fourier_features import exact_squared_mmd, mean_features, mean_kernel, unit_frequencies

SEED = np.array([7])
FORMS = {
    "gaussian": lambda x: np.exp(-0.5 * x @ x),
    "laplace": lambda x: np.exp(-np.sqrt(x @ x)),
    "cauchy": lambda x: np.prod(1.0 / (1.0 + 0.5 * x * x)),
}


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("kernel", list(FORMS))
def test_the_mean_of_many_waves_is_the_kernel(kernel, d, rng):
    """The mean of cos ωᵀx over 400,000 frequencies is k(x) to 0.006, five of its standard errors, in any direction."""
    w = unit_frequencies(SEED, 400_000, d, kernel)[0]
    for r in (0.0, 0.1, 0.5, 1.0, 2.0, 4.0):
        for _ in range(3):
            x = rng.standard_normal(d)
            x *= r / np.linalg.norm(x)
            assert np.cos(w @ x).mean() == pytest.approx(FORMS[kernel](x), abs=0.006)
    a, b = rng.standard_normal((1, d)), rng.standard_normal((2, d))
    for ell in (0.3, 1.0, 5.0):
        forms = [FORMS[kernel]((a[0] - y) / ell) for y in b]
        assert mean_kernel(a, b, ell, kernel) == pytest.approx(np.mean(forms), rel=1e-13)


def test_laplace_frequencies_are_cauchy_in_every_direction():
    """Any coordinate of a multivariate Cauchy vector is Cauchy distributed, in the plane and in space: quartiles at −1
    and 1, no variance. With independent Cauchy coordinates, the diagonals would be √2 or √3 times as wide."""
    for d in (2, 3):
        w = unit_frequencies(SEED, 100_000, d, "laplace")[0]
        for along in (np.eye(d)[0], np.ones(d) / np.sqrt(d)):
            assert np.allclose(np.quantile(w @ along, (0.25, 0.5, 0.75)), (-1.0, 0.0, 1.0), atol=0.03)
        assert np.linalg.norm(w, axis=1).max() > 1e4


def test_the_shortest_laplace_wave_is_far_shorter_than_a_gaussian_one():
    """Of 32 waves in the plane, in the median of 400 draws, the shortest is a seventh of ℓ long for Laplace's kernel,
    and more than 2 ℓ for the Gaussian."""
    seeds = np.arange(400)
    shortest = {
        kernel: np.median(2.0 * np.pi / np.linalg.norm(unit_frequencies(seeds, 32, 2, kernel), axis=2).max(axis=1))
        for kernel in ("laplace", "gaussian")
    }
    assert 1 / 8 < shortest["laplace"] < 1 / 6
    assert 2.0 < shortest["gaussian"] < 2.5


def test_cauchy_waves_at_a_length_smaller_by_root_two_have_laplace_components_of_scale_one():
    """Frequencies for the product of Cauchy kernels at ℓ = 1/√2: of each coordinate's size, the mean is 1 and the
    median log 2, as of Laplace numbers of scale 1."""
    size = np.sqrt(2.0) * np.abs(unit_frequencies(SEED, 100_000, 3, "cauchy")[0])
    assert np.allclose(size.mean(axis=0), 1.0, atol=0.01)
    assert np.allclose(np.median(size, axis=0), np.log(2.0), atol=0.01)


def test_draws_of_one_seed():
    """Different draws differ, the same draw repeats, and Laplace frequencies have the Gaussian ones' directions."""
    seeds = np.array([3, 4])
    z = unit_frequencies(seeds, 20, 2)
    assert np.array_equal(z[1], np.random.default_rng(4).standard_normal((20, 2)))
    for kernel in FORMS:
        draws = [unit_frequencies(seeds, 20, 2, kernel, k) for k in range(3)]
        assert all(np.array_equal(a, unit_frequencies(seeds, 20, 2, kernel, k)) for k, a in enumerate(draws))
        assert min(np.abs(a - b).max() for a in draws for b in draws if a is not b) > 0.1
        assert np.abs(draws[1][0] - draws[1][1]).max() > 0.1
    w = unit_frequencies(seeds, 20, 2, "laplace")
    assert np.allclose(z[..., 0] * w[..., 1], z[..., 1] * w[..., 0])
    with pytest.raises(ValueError, match="kernel"):
        unit_frequencies(seeds, 20, 2, "box")
    with pytest.raises(ValueError, match="kernel"):
        mean_kernel(np.zeros((1, 2)), np.zeros((1, 2)), 1.0, "box")


@pytest.mark.parametrize("d", [2, 3])
def test_the_laplace_estimate_tends_to_its_v_statistic(rng, d):
    """As for the Gaussian, the squared distance of mean features approaches the exact pairwise value as 1/√D."""
    x, y = rng.standard_normal((30, d)), 1.3 * rng.standard_normal((45, d)) + 0.5
    exact = exact_squared_mmd(x, y, 0.8, "laplace")
    gaps = np.linalg.norm(x[:, None] - y[None], axis=2)
    own = [np.linalg.norm(c[:, None] - c[None], axis=2) for c in (x, y)]
    means = [np.exp(-g / 0.8).mean() for g in (own[0], gaps, own[1])]
    assert exact == pytest.approx(means[0] - 2.0 * means[1] + means[2], rel=1e-12)
    assert exact != pytest.approx(exact_squared_mmd(x, y, 0.8), rel=0.1)
    errors = []
    for D in (16, 256, 4096):
        z = unit_frequencies(np.arange(20), D, d, "laplace") / 0.8
        clouds = [mean_features(np.broadcast_to(c, (20, *c.shape)), z) for c in (x, y)]
        errors.append(np.sqrt(np.mean((np.square(clouds[0] - clouds[1]).sum(axis=1) - exact) ** 2)))
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1]
    assert errors[2] < 0.05 * exact


@pytest.mark.parametrize("length", [-0.5, 0.0, np.nan, np.inf, "a"])
def test_a_kernel_has_a_positive_length(length):
    cloud = np.zeros((3, 2))
    with pytest.raises(ValueError, match=r"^length: expected a"):
        mean_kernel(cloud, cloud, length)


@pytest.mark.parametrize("length", [0.0, np.nan, "a", [1.0, -1.0]])
def test_an_exact_discrepancy_has_positive_lengths(length):
    cloud = np.zeros((3, 2))
    with pytest.raises(ValueError, match=r"^length: expected "):
        exact_squared_mmd(cloud, cloud, length)


@pytest.mark.parametrize(
    ("x", "y", "name"),
    [((4, 2), (4, 3), "y"), ((1, 4, 2), (4, 2), "x"), ((4, 2), (1, 4, 2), "y"), ((4,), (4, 2), "x")],
)
def test_a_mean_kernel_is_of_two_clouds_of_one_dimension(x, y, name):
    with pytest.raises(ValueError, match=f"^{name}: expected "):
        mean_kernel(np.zeros(x), np.zeros(y), 1.0)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("seed", 1), ("seed", [-1]), ("seed", [0.5]), ("count", 0), ("count", 2.5), ("dim", 0), ("draw", -1)],
)
def test_what_draws_no_frequencies_is_refused_by_name(name, wrong):
    with pytest.raises(ValueError, match=f"^{name}: "):
        unit_frequencies(**{"seed": SEED, "count": 4, "dim": 2, name: wrong})
