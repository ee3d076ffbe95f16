"""Robust weights against their definitions: slopes of the losses, units, efficiency, the median about zero."""

import numpy as np
import pytest

from solvers import register
from solvers.numerics import robust
from solvers.numerics.robust import KERNELS, TUNING
from solvers.scenes.rooms import ROOM_SETTINGS, room

ROBUST = [k for k in KERNELS if k != "none"]
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.mark.parametrize("kernel", KERNELS)
def test_the_weight_is_the_slope_of_the_loss_over_the_distance(kernel):
    """w(r) = ρ'(r)/r, by central differences, at thresholds from 0.03 to 40."""
    for k in (0.03, 1.0, 40.0):
        r = k * np.linspace(0.05, 4.0, 80)
        r = r[np.abs(r / k - 1.0) > 1e-3]  # Tukey's and Huber's second derivatives jump there
        h = 1e-6 * k
        slope = (robust.loss(kernel, r + h, k) - robust.loss(kernel, r - h, k)) / (2.0 * h)
        assert np.allclose(slope, robust.weights(kernel, r, k) * r, rtol=1e-6, atol=1e-7 * k)


@pytest.mark.parametrize("kernel", KERNELS)
def test_distance_and_threshold_are_in_one_unit(kernel, rng):
    """w(λr; λk) = w(r; k) and ρ(λr; λk) = λ² ρ(r; k): metres or millimetres give the same weights."""
    r = rng.exponential(1.0, (4, 50))
    k = np.array([0.1, 0.5, 1.0, 3.0])
    for scale in (1e-3, 7.0, 1e4):
        assert np.allclose(robust.weights(kernel, scale * r, scale * k), robust.weights(kernel, r, k), rtol=1e-12)
        assert np.allclose(robust.loss(kernel, scale * r, scale * k), scale**2 * robust.loss(kernel, r, k), rtol=1e-12)


@pytest.mark.parametrize("kernel", KERNELS)
def test_weights_fall_from_one_and_losses_rise_from_zero(kernel):
    r = np.linspace(0.0, 10.0, 400)
    w, rho = robust.weights(kernel, r, 1.3), robust.loss(kernel, r, 1.3)
    assert w[0] == 1.0
    assert rho[0] == 0.0
    assert np.all(np.diff(w) <= 0.0)
    assert np.all(np.diff(rho) >= 0.0)
    assert np.all((w >= 0.0) & (w <= 1.0))


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_threshold_far_above_the_distances_gives_the_plain_squares(kernel):
    """ρ(r; k) → r²/2 up to rounding as k grows: no digits are lost in a difference from 1."""
    r = np.array([0.0, 1e-3, 0.2, 1.0, 7.0])
    for k in (1e6, 1e9, 1e14, 1e90):
        assert np.allclose(robust.loss(kernel, r, k), 0.5 * r**2, rtol=1e-9, atol=0.0)
    scene = room("clean")
    plain, wide = (
        register(scene.source, scene.target, "icp", start=scene.start, weight=name, scale=1e9)
        for name in ("none", kernel)
    )
    assert np.isclose(wide.objective, plain.objective, rtol=1e-9)


def test_what_each_kernel_does_far_away():
    """Huber's influence w r is bounded, but its loss is not; Tukey's weight is zero beyond k; the other weights only
    approach zero, and the losses of all three are bounded."""
    residuals = np.array([1e3, 1e6])
    assert np.allclose(robust.weights("huber", residuals, 2.0) * residuals, 2.0)
    assert robust.loss("huber", residuals, 2.0)[1] > 1e6
    assert robust.weights("tukey", residuals, 2.0).tolist() == [0.0, 0.0]
    assert np.allclose(robust.loss("tukey", residuals, 2.0), 4.0 / 6.0)
    assert np.allclose(robust.loss("welsch", residuals, 2.0), 4.0)
    assert robust.weights("geman-mcclure", residuals, 2.0)[0] > 0.0
    assert np.allclose(robust.loss("geman-mcclure", residuals, 2.0), 2.0, rtol=1e-4)
    for kernel in ROBUST:
        assert robust.weights(kernel, np.array([0.0, np.inf]), 1e-3).tolist() == [1.0, 0.0]
    for kernel, most in (("tukey", 4.0 / 6.0), ("welsch", 4.0), ("geman-mcclure", 2.0)):
        assert robust.loss(kernel, np.array([0.0, 1e200, np.inf]), 2.0).tolist() == [0.0, most, most]


@pytest.mark.parametrize("kernel", ROBUST)
def test_the_usual_constants_are_95_percent_efficient(kernel):
    """For Gaussian residuals the estimate's variance is 1/0.95 of the mean's: (E ψ')² / E ψ² by quadrature."""
    x = np.linspace(-12.0, 12.0, 120001)
    step, density = x[1] - x[0], np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi)
    psi = robust.weights(kernel, np.abs(x), TUNING[kernel]) * x
    slope = (np.gradient(psi, step) * density).sum() * step
    assert slope**2 / ((psi**2 * density).sum() * step) == pytest.approx(0.95, abs=1e-4)


def test_the_scale_is_the_median_about_zero(rng):
    """1.4826 median(r): the standard deviation of centred Gaussian residuals, and not zero for equal distances."""
    r = np.abs(rng.standard_normal((1, 100001)))
    assert robust.mad_scale(r)[0] == pytest.approx(1.0, abs=0.02)
    alike = np.full((1, 9), 5.0)
    assert robust.mad_scale(alike)[0] == pytest.approx(1.4826 * 5.0)
    assert np.all(robust.weights("tukey", alike, robust.threshold("tukey", alike)) > 0.5)


def test_the_scale_takes_only_the_pairs_it_is_told(rng):
    r, among = rng.random((5, 12)), rng.random((5, 12)) < 0.6
    among[3] = False
    among[4] = np.arange(12) == 7
    result = robust.mad_scale(r, among, floor=1e-9)
    for i in range(5):
        own = r[i, among[i]]
        assert result[i] == pytest.approx(1.4826 * np.median(own) if own.size else 1e-9)
    assert robust.mad_scale(np.zeros((2, 3)), None, np.array([0.1, 0.2])).tolist() == [0.1, 0.2]
    assert robust.threshold("huber", r, scale=0.2).tolist() == [1.345 * 0.2] * 5
    assert robust.threshold("huber", r, tuning=2.0, scale=np.arange(1.0, 6.0)).tolist() == [2.0, 4.0, 6.0, 8.0, 10.0]
    assert np.all(robust.threshold("none", r, scale=0.2) == np.inf)


def test_the_least_scale_is_a_fraction_of_the_clouds_size_and_a_thousandth_in_the_rooms(rng):
    """FLOOR times the RMS radius, in any unit and place; 0.001 u in every room of the race, to within a tenth."""
    clouds = rng.standard_normal((3, 40, 2)) * np.array([1.0, 5.0, 0.1])[:, None, None]
    radius = np.sqrt(clouds.var(axis=1).sum(axis=1))
    for unit in (1e-9, 1.0, 1e6):
        assert np.allclose(robust.least_scale(unit * (clouds + 7.0)), unit * robust.FLOOR * radius, rtol=1e-9)
    rooms = [room(setting, seed=40).target for setting in ROOM_SETTINGS]
    assert np.allclose([robust.least_scale(q[None])[0] for q in rooms], 1e-3, rtol=0.1)


def test_perfect_pairs_without_a_floor_are_no_division_by_zero():
    """Even zero distances get a positive threshold and full weight."""
    r = np.array([[0.0, 0.0, 0.0, 1.0]])
    for kernel in ROBUST:
        k = robust.threshold(kernel, r)
        assert k[0] > 0.0
        assert robust.weights(kernel, r, k)[0].round(6).tolist() == [1.0, 1.0, 1.0, 0.0]


def test_reweighting_finds_the_loss_minimum_of_a_line(rng):
    """IRLS with these weights descends on Σ ρ, for the mean of points of which a third are far off."""
    x = np.concatenate([rng.normal(2.0, 0.1, 40), rng.uniform(5.0, 9.0, 20)])
    for kernel in ROBUST:
        mu, last = np.median(x), np.inf
        for _ in range(200):
            r = np.abs(x - mu)
            total = robust.loss(kernel, r, 0.3).sum()
            assert total <= last * (1.0 + 1e-12)
            last = total
            w = robust.weights(kernel, r, 0.3)
            mu = (w * x).sum() / w.sum()
        neighbours = mu + np.array([-1e-4, 1e-4])
        assert np.all(robust.loss(kernel, np.abs(x - neighbours[:, None]), 0.3).sum(axis=1) >= last)
        if kernel != "huber":
            assert abs(mu - 2.0) < 0.05


@pytest.mark.parametrize(
    ("weight", "tuning", "scale", "name"),
    [
        ("hubert", None, None, "weight"),
        (3, None, None, "weight"),
        ("huber", 0.0, None, "tuning"),
        ("huber", None, -1.0, "scale"),
    ],
)
def test_wrong_options_are_named(weight, tuning, scale, name):
    with pytest.raises(ValueError, match=rf"^{name}: "):
        robust.check_options(weight, tuning, scale)


@pytest.mark.parametrize("call", [robust.weights, robust.loss, lambda kernel, r, k: robust.threshold(kernel, r)])
@pytest.mark.parametrize(
    ("kernel", "hint"), [("Tukey", ", did you mean 'tukey'"), ("hubber", ", did you mean 'huber'"), (None, "; known")]
)
def test_what_is_no_kernel_is_refused(call, kernel, hint):
    """It would otherwise be treated as Welsch's."""
    with pytest.raises(ValueError, match=f"^kernel: {kernel!r} is unknown{hint}"):
        call(kernel, np.array([[0.5, 1.0]]), 1.0)


@pytest.mark.parametrize("kernel", ROBUST)
@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf, np.array([1.0, 0.0]), np.array([1.0, np.nan]), "a"])
def test_a_threshold_is_positive(kernel, wrong):
    for call in (robust.weights, robust.loss):
        with pytest.raises(ValueError, match=r"^threshold: expected "):
            call(kernel, np.array([[0.0, 1.0], [2.0, 3.0]]), wrong)


@pytest.mark.parametrize(
    "arguments", [{"scale": -1.0}, {"scale": np.array([0.0])}, {"scale": np.nan}, {"tuning": 0.0}, {"tuning": "a"}]
)
def test_a_threshold_is_made_of_positive_numbers(arguments):
    (name,) = arguments
    with pytest.raises(ValueError, match=f"^{name}: expected a "):
        robust.threshold("tukey", np.array([[0.1, 0.2]]), **arguments)


def test_distances_may_be_a_list():
    """A list of rows of numbers works; anything else is refused by name."""
    rows = [[0.1, 0.1, 0.2, 9.0]]
    assert robust.mad_scale(rows) == robust.mad_scale(np.array(rows))
    assert robust.threshold("huber", rows) == robust.threshold("huber", np.array(rows))
    for call in (robust.mad_scale, lambda r: robust.threshold("huber", r)):
        for wrong in ("far", 1.0, np.zeros((2, 0))):
            with pytest.raises(ValueError, match=r"^distances: expected "):
                call(wrong)
