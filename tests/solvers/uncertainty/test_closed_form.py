"""Covariances in closed form: checked against simulation and finite differences of the minimiser, or refused."""

import re

import numpy as np
import pytest

from solvers import Pose, register
from solvers.scenes.rooms import BIRD, KABSCH_TRUTH, kabsch_scene, room
from solvers.scenes.walls import corridor, ndt_room
from solvers.uncertainty import CENSI, HESSIAN, covariance, from_matrix, log, range_bearing
from solvers.verify import evidence

SIGMA = 0.05


def redraw(count, weights=None, seed=1):
    """Known pairs with the target redrawn with noise of σ/√w, registered as one batch."""
    rng = np.random.default_rng(seed)
    w = np.ones(len(BIRD)) if weights is None else weights
    noise = SIGMA / np.sqrt(w)[:, None] * rng.standard_normal((count, *BIRD.shape))
    return register(BIRD, KABSCH_TRUTH.apply(BIRD) + noise, "kabsch", weights=w)


@pytest.mark.parametrize("weights", [None, np.linspace(0.2, 3.0, len(BIRD))], ids=["equal", "weighted"])
def test_for_known_pairs_it_is_the_spread_of_redrawn_noise(weights):
    """The whitened sample covariance of 4,000 draws is the identity to within five of its standard errors."""
    count = 4000
    result = redraw(count, weights)
    w = np.ones(len(BIRD)) if weights is None else weights
    clean = covariance(register(BIRD, KABSCH_TRUTH.apply(BIRD), "kabsch", weights=w), sigma=SIGMA)
    z = clean.along(result.pose) / clean.deviations
    excess = z.T @ z / count - np.eye(3)
    assert np.abs(excess).max() < 5.0 * np.sqrt(2.0 / count)


def test_its_region_for_known_pairs_holds_the_truth_as_often_as_it_says():
    """It does so in 95 % of 4,000 draws, to within four standard errors, with σ known."""
    result = redraw(4000)
    share = covariance(result, sigma=SIGMA).covers(KABSCH_TRUTH).mean()
    assert share == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / 4000))


@pytest.mark.parametrize(("pairs", "held"), [(3, 0.77), (5, 0.87), (8, 0.90), (15, 0.93), (40, 0.94)])
def test_with_the_noise_estimated_from_few_pairs_regions_hold_the_truth_less_often(pairs, held, rng):
    """As the docstring says, to within 2 in 100 of 4,000 draws: 95 % regions count on a known σ."""
    source = rng.uniform(-3.0, 3.0, (4000, pairs, 2))
    target = KABSCH_TRUTH.apply(source) + 0.01 * rng.standard_normal(source.shape)
    assert register(source, target, "kabsch").covariance.covers(KABSCH_TRUTH).mean() == pytest.approx(held, abs=0.02)


def test_the_noise_is_estimated_from_the_residuals_without_bias():
    """With σ estimated from 23 spare residuals, the RMS ratio of deviations to those with σ known is 1, to 2 %."""
    result = redraw(2000)
    ratio = covariance(result).deviations / covariance(result, sigma=SIGMA).deviations
    assert np.sqrt(np.square(ratio).mean()) == pytest.approx(1.0, abs=0.02)


def test_censi_and_the_hessian_agree_on_known_pairs_of_small_noise():
    """If residuals are small, H is JᵀJ and both are σ² (JᵀJ)⁻¹."""
    scene = kabsch_scene("noisy", noise=0.01)
    result = register(scene.source, scene.target, "kabsch")
    first, second = covariance(result, sigma=0.01), covariance(result, "censi", target_noise=0.01)
    np.testing.assert_allclose(second.matrix, first.matrix, rtol=0.05, atol=1e-9)


def differences(source, target, method, start, **options):
    """The result, and how its end pose changes with each coordinate of both clouds, (3, 2m + 2n), by central
    differences."""
    options = {"tolerance": 1e-13, "rms_tolerance": 0.0, "max_steps": 400, **options}
    end = register(source, target, method, start=start, **options).pose
    m, n, h = source.size, target.size, 1e-6
    steps = np.concatenate([h * np.eye(m + n), -h * np.eye(m + n)])
    p = source + steps[:, :m].reshape(-1, *source.shape)
    q = target + steps[:, m:].reshape(-1, *target.shape)
    ends = register(p, q, method, start=end, **options).pose
    centre = Pose(np.eye(2), end.apply(source).mean(axis=0))
    twists = log(centre.inverse().compose(ends.compose(end.inverse())).compose(centre))
    return register(source, target, method, start=start, **options), (twists[: m + n] - twists[m + n :]).T / (2.0 * h)


@pytest.mark.parametrize("method", ["icp", "point-to-plane"])
def test_censi_is_what_finite_differences_of_the_minimiser_say(method):
    """Each coordinate of both scans is moved by 1e-6 u and registered again: shared partners and normals included."""
    scene = room("noise", seed=53)
    source, target = scene.source[::4], scene.target[::3]
    result, D = differences(source, target, method, Pose.from_angle(0.05, (0.1, 0.0)), gate=1.0)
    noise = range_bearing(source, 0.03, 0.02), range_bearing(target, 0.05, 0.01, (1.0, 0.5))
    S = np.zeros((D.shape[1], D.shape[1]))
    for i, block in enumerate(np.concatenate(noise)):
        S[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = block
    estimate = covariance(result, "censi", source_noise=noise[0], target_noise=noise[1])
    centre = result.pose.apply(source).mean(axis=0)
    shift = np.array([[1.0, 0.0, 0.0], [-centre[1], 1.0, 0.0], [centre[0], 0.0, 1.0]])
    np.testing.assert_allclose(shift @ estimate.matrix @ shift.T, D @ S @ D.T, rtol=2e-4, atol=1e-9)


def test_a_partner_of_several_points_counts_as_one_measurement():
    """Four copies of the source average out the target's noise for the Hessian's form, but not for Censi's."""
    scene = room("clean")
    target = scene.target
    once = register(scene.source, target, "icp", gate=0.5)
    often = register(np.tile(scene.source, (4, 1)), target, "icp", gate=0.5)
    for form, ratio in (("hessian", 0.5), ("censi", 1.0)):
        more = {"sigma": 0.02} if form == "hessian" else {"target_noise": 0.02}
        first, second = covariance(once, form, **more), covariance(often, form, **more)
        np.testing.assert_allclose(second.deviations, ratio * first.deviations, rtol=1e-3)


@pytest.mark.parametrize("form", ["hessian", "censi"])
@pytest.mark.parametrize("method", ["icp", "point-to-plane"])
def test_units_and_origin_change_lengths_alone(form, method):
    scene, motion = room("noise"), Pose.from_angle(1.0, (40.0, -30.0))
    estimates = []
    for size, move in ((1.0, Pose.identity()), (1e3, motion)):
        p, q = size * scene.source, size * move.apply(scene.target)
        start = Pose(move.R, size * move.t)
        result = register(p, q, method, start=start, gate=0.5 * size)
        more = {} if form == "hessian" else {"source_noise": 0.11 * size, "target_noise": 0.11 * size}
        estimates.append(covariance(result, form, **more))
    np.testing.assert_allclose(estimates[1].deviations, 1e3 * estimates[0].deviations, rtol=1e-4)


def test_a_corridor_without_noise_is_free_and_the_room_is_not():
    for scene, count in ((corridor(noise=0.0), 1), (ndt_room(noise=0.0), 0)):
        result = register(scene.source, scene.target, "point-to-plane", start=scene.truth, gate=0.4)
        for form, more in (("hessian", {"sigma": 0.02}), ("censi", {"source_noise": 0.02})):
            estimate = covariance(result, form, **more)
            assert estimate.free.sum() == count
            assert not np.isnan(estimate.matrix).any()
            if count:
                assert estimate.words() == "the slide along (0.94, 0.33) is free"


def test_one_place_leaves_the_turn_about_it_free():
    result = register([[1.0, 1.0]] * 4, [[2.0, 3.0]] * 4, "kabsch")
    estimate = covariance(result, sigma=0.1)
    assert estimate.words() == "the turn about (2.00, 3.00) is free"


@pytest.mark.parametrize(("method", "factors"), [("kabsch", (1.0, -1.0)), ("kabsch", (0.0, 0.0)), ("icp", (0.0, 0.0))])
def test_partners_that_leave_the_turn_undefined_leave_it_free(method, factors):
    """Mirrored partners cost the same at every angle, and so do partners at one place; the source's lever arms, which
    the Hessian is made of, show neither."""
    square = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    estimate = covariance(register(square, square * factors, method), sigma=0.1)
    np.testing.assert_allclose(estimate.deviations, [np.inf, 0.05, 0.05])
    assert estimate.words() == "the turn about (0.00, 0.00) is free"
    upright = covariance(register(square, square, method), sigma=0.1)
    assert upright.deviations.max() < 0.1
    both = covariance(register(np.stack([square, square]), np.stack([square, square * factors]), method), sigma=0.1)
    np.testing.assert_allclose(both.deviations, [upright.deviations, estimate.deviations])


@pytest.mark.parametrize(("method", "weights"), [("kabsch", [9, 1, 1, 1]), ("icp", [9, 1, 1, 1]), ("gicp", None)])
def test_any_angle_about_the_centroid_of_the_weights_is_free(method, weights):
    """With all partners at one place, the cost is flat about the weighted centroid and nowhere else."""
    square = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    estimate = covariance(register(square, 0.0 * square, method, weights=weights), sigma=0.1)
    assert np.isinf(estimate.deviations).tolist() == [True, False, False]
    assert estimate.words() == "the turn about (0.00, 0.00) is free"


@pytest.mark.parametrize("method", ["point-to-plane", "gicp"])
def test_a_run_that_calls_more_free_than_the_covariance_does_names_no_turn(method):
    scene = corridor(noise=0.02)
    result = register(scene.source, scene.target, method, start=scene.start, free_below=0.05)
    assert "slide" in str(result.reason)
    assert "slide" in covariance(result, sigma=0.1).words()


def test_a_turn_is_told_in_degrees_and_none_as_none():
    """A pose that mainly turns, by 0.01 rad, one that mainly slides, and one without any spread."""
    turning = from_matrix(np.diag([0.01, 1e-4, 1e-4]) ** 2, Pose.identity(), radius=3.0)
    assert turning.words() == "widest: the turn about (0.00, 0.00), σ = 0.57°"
    sliding = from_matrix(np.diag([1e-4, 0.02, 0.01]) ** 2, Pose.identity(), radius=3.0)
    assert sliding.words() == "widest: the slide along (1.00, 0.00), σ = 0.02 u"
    assert from_matrix(np.zeros((3, 3)), Pose.identity(), radius=3.0).words() == "no spread"


def test_of_equally_wide_directions_none_is_named(rng):
    """The Hessian of point pairs is alike in all directions, up to rounding, which must not pick one."""
    source = rng.uniform(-3.0, 3.0, (40, 2))
    for k in range(5):
        found = register(source, source + 0.05 * rng.standard_normal((40, 2)) + 1.7 * k, "kabsch")
        spread = covariance(found, sigma=0.05)
        centre = ", ".join(f"{x:.2f}" for x in spread.centre)
        sigma, turn = 0.05 / np.sqrt(40), np.degrees(0.05 / np.sqrt(40) / spread.radius)
        told = f"equal in all directions, σ = {sigma:.2g} u; {turn:.2g}° for the turn about ({centre})"
        assert spread.words() == told
    slides = from_matrix(np.diag([1e-4, 0.02, 0.02]) ** 2, Pose.identity(), radius=3.0)
    assert slides.words() == "two directions are equally wide, σ = 0.02 u"


def test_one_place_leaves_the_deviations_of_its_four_points():
    result = register([[1.0, 1.0]] * 4, [[2.0, 3.0]] * 4, "kabsch")
    estimate = covariance(result, sigma=0.1)
    np.testing.assert_allclose(estimate.deviations[1:], 0.1 / 2.0)


def test_one_spare_residual_is_enough_to_estimate_the_noise():
    """Two pairs δ further apart than their points have a residual of δ/2 each: σ² is δ²/2, and half of it remains."""
    estimate = covariance(register([[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.1], [0.0, 1.1]], "kabsch"))
    np.testing.assert_allclose(estimate.deviations, 0.1, rtol=1e-9)


def test_as_many_unknowns_as_residuals_say_nothing_of_the_noise():
    result = register([[1.0, 1.0]], [[2.0, 3.0]], "kabsch")
    assert covariance(result).free.all()
    assert covariance(result).covers(Pose.identity())


def test_a_range_and_a_bearing_are_noise_along_and_across_the_ray():
    rng = np.random.default_rng(2)
    point, origin = np.array([3.0, 2.0]), np.array([0.5, -1.0])
    ray = point - origin
    distance, angle = np.hypot(*ray), np.arctan2(ray[1], ray[0])
    r, a = distance + 0.05 * rng.standard_normal(40_000), angle + 0.01 * rng.standard_normal(40_000)
    sample = np.cov(np.stack([r * np.cos(a), r * np.sin(a)]))
    np.testing.assert_allclose(range_bearing([point], 0.05, 0.01, origin)[0], sample, atol=6e-5)
    assert np.isfinite(range_bearing([[0.0, 0.0]], 0.1, 0.1)).all()


@pytest.mark.parametrize("method", HESSIAN)
def test_there_is_one_for_each_that_is_named(method):
    scene = room("clean")
    q = scene.target[: len(scene.source)] if method == "kabsch" else scene.target
    result = register(scene.source, q, method)
    assert np.isfinite(covariance(result).deviations).all()
    if method in CENSI:
        assert np.isfinite(covariance(result, "censi", source_noise=0.02, target_noise=0.02).deviations).all()


def test_what_has_none_says_so():
    """NDT with either formula, GICP with Censi's, unknown formulas, invalid noises, space, and lists: a ValueError that
    names the argument."""
    scene = room("clean")
    with pytest.raises(ValueError, match="'hessian' has no covariance for 'ndt'; it has one for: kabsch"):
        covariance(register(scene.source, scene.target, "ndt"))
    result = register(scene.source, scene.target, "gicp")
    with pytest.raises(ValueError, match="'censi' has no covariance for 'gicp'"):
        covariance(result, "censi")
    for wrong in (result.pose, None):
        with pytest.raises(ValueError, match=f"^result: expected a Result, got {type(wrong).__name__}"):
            covariance(wrong)
    with pytest.raises(ValueError, match="how"):
        covariance(result, "bootstrap")
    result = register(scene.source, scene.target, "icp")
    for name, wrong in (
        *[("range_sigma", {"range_sigma": -1.0}), ("bearing_sigma", {"bearing_sigma": -1.0})],
        *[("origin", {"origin": (0.0, 0.0, 0.0)}), ("origin", {"origin": (0.0, np.nan)})],
    ):
        with pytest.raises(ValueError, match=f"^{name}: "):
            range_bearing(scene.source, **{"range_sigma": 0.1, **wrong})
    for wrong in (-1.0, np.nan, [0.1, 0.2], "0.1"):
        with pytest.raises(ValueError, match=r"^sigma: "):
            covariance(result, sigma=wrong)
    for wrong in (-1.0, np.inf, np.ones(7), "0.1", [0.02], [0.02, 0.02], [[0.02]], 0.02 * np.eye(2)):
        with pytest.raises(ValueError, match=r"^source_noise: "):
            covariance(result, "censi", source_noise=wrong)
    for wrong in (-np.eye(2), np.array([[1.0, 0.5], [0.0, 1.0]])):
        with pytest.raises(ValueError, match=r"^source_noise: a covariance is not symmetric and positive semidefinite"):
            covariance(result, "censi", source_noise=np.stack([wrong] * len(scene.source)))
    space = np.random.default_rng(1).standard_normal((9, 3))
    with pytest.raises(ValueError, match="plane"):
        covariance(register(space, space, "kabsch"))


@pytest.mark.parametrize(
    ("form", "arguments", "message"),
    [
        ("hessian", {"source_noise": 0.1}, "source_noise: 'hessian' takes sigma instead; how='censi' takes the"),
        ("hessian", {"sigma": 0.1, "target_noise": 0.1}, "target_noise: 'hessian' takes sigma instead"),
        ("censi", {"sigma": 0.1, "source_noise": 0.1}, "sigma: 'censi' takes the points' noise instead"),
        ("censi", {}, "source_noise: 'censi' needs it, or target_noise, or both"),
    ],
)
def test_a_noise_that_the_form_would_pass_over_is_refused(form, arguments, message):
    """So is a form that would claim certainty because no noise was given."""
    scene = room("clean")
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        covariance(register(scene.source, scene.target, "point-to-plane", gate=0.5), form, **arguments)


def test_a_large_noise_hides_no_wrong_one_beside_it():
    scene = room("clean")
    result = register(scene.source, scene.target, "point-to-plane", gate=0.5)
    for wrong in ([[1.0, 2.0], [2.0, 1.0]], [[1.0, 0.5], [0.0, 1.0]]):
        noise = np.tile(np.eye(2), (len(scene.source), 1, 1))
        noise[0], noise[1] = wrong, 1e12 * np.eye(2)
        with pytest.raises(ValueError, match=r"^source_noise: a covariance is not symmetric and positive"):
            covariance(result, "censi", source_noise=noise)


def test_rounding_makes_no_covariance_a_wrong_one():
    """Up to 1e-9 of its largest entry: in the symmetry, and below zero."""
    scene = room("clean")
    result = register(scene.source, scene.target, "point-to-plane", gate=0.5)
    for off, fits in ((1e-10, True), (1e-8, False)):
        for matrix in ([[1.0, off], [0.0, 1.0]], [[1.0, 0.0], [0.0, -off]]):
            noise = np.tile(matrix, (len(scene.source), 1, 1))
            if fits:
                assert np.isfinite(covariance(result, "censi", source_noise=noise).matrix).all()
                continue
            with pytest.raises(ValueError, match=r"^source_noise: a covariance is not symmetric and positive"):
                covariance(result, "censi", source_noise=noise)


def test_the_noisier_the_normals_the_less_the_hessian_holds():
    """Of 100 draws of each room, started at the truth: with σ = 0.02 u, more than 90 of its regions and of Censi's hold
    the truth; with 0.11 u, fewer than 50 of its own do, but more than 85 of Censi's."""
    counts = {}
    for setting, noise in (("clean", 0.02), ("noise", 0.11)):
        scenes = [room(setting, seed=seed) for seed in range(100)]
        clouds = [np.stack([getattr(scene, name) for scene in scenes]) for name in ("source", "target")]
        result = register(*clouds, "point-to-plane", gate=0.5)
        estimates = covariance(result), covariance(result, "censi", source_noise=noise, target_noise=noise)
        counts[setting] = [int(estimate.covers(scenes[0].truth).sum()) for estimate in estimates]
    assert min(counts["clean"]) > 90
    assert counts["noise"][0] < 50
    assert counts["noise"][1] > 85


@pytest.mark.native
def test_importing_the_solvers_does_not_import_it():
    import subprocess
    import sys

    code = "import sys, solvers; print('solvers.uncertainty' in sys.modules)"
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "False"


def test_noise_in_the_normals_seems_to_hold_a_wall_s_slide(rng):
    """Nothing does: without noise in the scans it is free. `weakest` of the evidence shows how little holds it."""
    source, target = (np.stack([np.linspace(-x, x, n), np.zeros(n)], axis=1) for x, n in ((5.0, 60), (8.0, 200)))
    noisy = [cloud + 0.01 * rng.standard_normal(cloud.shape) for cloud in (source, target)]
    assert covariance(register(source, target, "point-to-plane")).free.any()
    result = register(*noisy, "point-to-plane")
    seen = covariance(result)
    assert not seen.free.any()
    assert seen.deviations[0] < 0.2
    assert evidence(*noisy, result.pose).weakest < 0.003


@pytest.mark.parametrize("shift", [0.05, 0.1, 0.3])
@pytest.mark.parametrize("degrees", [0.0, 12.0, 30.0, 45.0, 71.0])
def test_a_wall_without_noise_has_a_covariance(degrees, shift):
    """The sum of squared residuals may round to just below zero; the slide is free and the rest is certain."""
    wall = np.linspace([0.0, 0.0], [1.0, 1.0], 25) @ Pose.from_angle(np.radians(degrees)).R.T
    spread = register(wall, wall + shift, "point-to-plane").covariance
    assert spread.free.sum() == 1
    np.testing.assert_allclose(spread.deviations[~spread.free], 0.0, atol=1e-6)


def test_weights_next_to_nothing_leave_all_free():
    source = np.random.default_rng(0).normal(size=(30, 2))
    for method in ("kabsch", "icp", "point-to-plane"):
        spread = register(source, source + 0.1, method, weights=np.full(30, 5e-324)).covariance
        assert spread.free.all()


def test_of_a_list_of_one_cloud_a_noise_is_an_entry_for_it():
    scene = kabsch_scene("noisy")
    batch = covariance(register([scene.source], [scene.target], "icp"), "censi", source_noise=[0.1])
    alone = covariance(register(scene.source, scene.target, "icp"), "censi", source_noise=0.1)
    np.testing.assert_allclose(batch.deviations, alone.deviations[None])
