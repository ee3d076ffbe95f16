"""The claims of the chapters 'Start here' and 'Correspondences known', checked against the solvers."""

import numpy as np
import pytest

from solvers import Pose, Status, fit_planar, fit_rigid, metrics, register
from solvers.collinear import poses_about_line
from solvers.scenes.rooms import BIRD, KABSCH_TRUTH, MAST, kabsch_scene
from solvers.scenes.scans import two_scans
from solvers.studies.race import SEEDS


def rotation_3d(rng):
    """A random rotation in space."""
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q


def noisy_pairs(n, d, seed=7, noise=0.3):
    """Random pairs in d dimensions: a source, the same points moved by the truth and given noise, and the truth."""
    rng = np.random.default_rng(seed)
    source = rng.standard_normal((n, d)) * np.arange(1.0, d + 1.0)
    truth = Pose(rotation_3d(rng), (0.5, -2.0, 1.0)) if d == 3 else Pose.from_angle(2.0, (0.5, -2.0))
    return source, truth.apply(source) + noise * rng.standard_normal((n, d)), truth


def draws(points, truth, sigma, count, seed=11):
    """`count` targets: the points moved by the truth, with Gaussian noise of deviation sigma in each coordinate."""
    rng = np.random.default_rng(seed)
    return truth.apply(points) + sigma * rng.standard_normal((count, *points.shape))


def squares(pose, source, target):
    """The sum of squared residuals of a pose."""
    return float((metrics.residuals(pose, source, target) ** 2).sum())


# Start here


def test_transform_between_scans():
    """The transform from source to target coordinates is the source pose followed by the inverse of the target pose."""
    at_target, at_source = Pose.from_angle(0.4, (1.0, 2.0)), Pose.from_angle(1.3, (-0.5, 3.0))
    world = np.random.default_rng(1).standard_normal((20, 2))
    source_scan, target_scan = at_source.inverse().apply(world), at_target.inverse().apply(world)
    T = at_target.inverse().compose(at_source)
    np.testing.assert_allclose(T.apply(source_scan), target_scan, atol=1e-12)


def test_transform_is_the_robots_motion():
    """The same transform places the robot of the source scan in the coordinates of the target scan."""
    at_target, at_source = Pose.from_angle(0.4, (1.0, 2.0)), Pose.from_angle(1.3, (-0.5, 3.0))
    T = at_target.inverse().compose(at_source)
    robot = at_source.apply([(0.0, 0.0), (1.0, 0.0)])  # where it stands in the world, and one unit ahead of it
    np.testing.assert_allclose(T.apply([(0.0, 0.0), (1.0, 0.0)]), at_target.inverse().apply(robot), atol=1e-12)


def test_translation_error_depends_on_the_origin():
    """For the same estimate, the translation error depends on the choice of origin; the rotation error does not."""
    truth, estimate = Pose.from_angle(0.5, (1.0, 0.0)), Pose.from_angle(0.6, (1.0, 0.0))
    shift = Pose.from_angle(0.0, (30.0, 0.0))
    moved = [shift.compose(pose).compose(shift.inverse()) for pose in (estimate, truth)]
    assert metrics.rre(estimate, truth) == pytest.approx(0.1)
    assert metrics.rre(*moved) == pytest.approx(0.1)
    assert metrics.rte(estimate, truth) == pytest.approx(0.0, abs=1e-12)
    assert metrics.rte(*moved) == pytest.approx(2.0 * np.sin(0.05) * 30.0)


def nearest_distance(pose, source, target):
    """The RMS distance from the moved source points to their nearest target points, as ICP finds it before a step."""
    return register(source, target, "icp", start=pose, max_steps=0).detail("pairing").rms


def test_nearest_distance_is_not_the_error():
    """Even without noise, in each of ten draws, the distance to the nearest points is above zero at the true pose, and
    smaller, by at most a tenth, at some pose within 0.06 u of it in x and y."""
    for seed in SEEDS[:10]:
        scans = two_scans(seed=seed, noise=0.0)
        at_truth = nearest_distance(scans.truth, scans.source, scans.target)
        beside = [
            nearest_distance(Pose(scans.truth.R, scans.truth.t + np.array((x, y))), scans.source, scans.target)
            for x in np.linspace(-0.06, 0.06, 13)
            for y in np.linspace(-0.06, 0.06, 13)
        ]
        assert at_truth > 0.05
        assert 0.9 * at_truth < min(beside) < at_truth


# The derivation


@pytest.mark.parametrize("d", [2, 3])
def test_centroids_coincide(d):
    """At the optimum the moved source's weighted centroid coincides with the target's, even with noise and weights."""
    source, target, _ = noisy_pairs(20, d)
    w = np.random.default_rng(3).uniform(0.0, 2.0, 20)
    pose = fit_rigid(source, target, w).pose
    np.testing.assert_allclose(w @ pose.apply(source) / w.sum(), w @ target / w.sum(), atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_only_sums_matter(d):
    """The fit depends on the pairs and their weights only through sums that one pass over them can collect."""
    source, target, _ = noisy_pairs(300, d)
    weights = np.random.default_rng(3).uniform(0.0, 2.0, 300)
    n, sum_p, sum_q, sum_pq = 0, np.zeros(d), np.zeros(d), np.zeros((d, d))
    for w, p, q in zip(weights, source, target, strict=True):
        n, sum_p, sum_q, sum_pq = n + w, sum_p + w * p, sum_q + w * q, sum_pq + w * np.outer(p, q)
    H = sum_pq - np.outer(sum_p, sum_q) / n
    U, _, Vt = np.linalg.svd(H)
    D = np.diag([1.0] * (d - 1) + [np.linalg.det(Vt.T @ U.T)])
    R = Vt.T @ D @ U.T
    pose = fit_rigid(source, target, weights).pose
    np.testing.assert_allclose(pose.R, R, atol=1e-10)
    np.testing.assert_allclose(pose.t, (sum_q - R @ sum_p) / n, atol=1e-9)


def test_one_valley_over_the_angle():
    """With the translation eliminated, the planar objective is a single cosine of the angle, with a single minimum."""
    source, target, _ = noisy_pairs(9, 2, noise=1.5)
    fit = fit_planar(source, target)
    p, q = source - source.mean(axis=0), target - target.mean(axis=0)
    S, C = (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum()
    for offset in np.linspace(-np.pi, np.pi, 73):
        rotations = Pose.from_angle(fit.pose.angle + offset)
        cost = squares(rotations, p, q)
        assert cost == pytest.approx(fit.cost + 4.0 * np.hypot(S, C) * np.sin(offset / 2.0) ** 2)


# The determinant


@pytest.mark.parametrize("d", [2, 3])
def test_price_of_staying_a_rotation(d):
    """When the best orthogonal matrix is a reflection, the best rotation costs 4 λ_d more, and the fit finds it."""
    source, target, _ = noisy_pairs(10, d, noise=0.1)
    target[:, 0] *= -1.0
    proper, free = fit_rigid(source, target), fit_rigid(source, target, proper=False)
    assert proper.determinant == -1
    assert np.linalg.det(free.pose.R) == pytest.approx(-1.0)
    assert np.linalg.det(proper.pose.R) == pytest.approx(1.0)
    assert proper.cost - free.cost == pytest.approx(4.0 * proper.singular_values[-1])
    rng = np.random.default_rng(2)
    for _ in range(300):
        R = rotation_3d(rng) if d == 3 else Pose.from_angle(rng.uniform(-np.pi, np.pi)).R
        pose = Pose(R, target.mean(axis=0) - R @ source.mean(axis=0))
        assert squares(pose, source, target) >= proper.cost


def test_noise_alone_can_ask_for_a_reflection():
    """For a cloud far thinner than its noise, a reflection fits best in nearly half of all draws, for the bird in
    none."""
    thin = fit_rigid(MAST, draws(MAST, KABSCH_TRUTH, 0.12, 4000))
    bird = fit_rigid(BIRD, draws(BIRD, KABSCH_TRUTH, 0.12, 4000))
    assert 0.42 < np.mean(thin.determinant == -1) < 0.5
    assert np.mean(bird.determinant == -1) == 0.0


def test_the_scene_shows_the_draw_that_leans_towards_the_reflection():
    """In more than nine in ten of the scene's 1,000 draws, but not in all, a reflection fits best; in their mirror
    images across the mast it never does."""
    scenes = [kabsch_scene("would-reflect", seed=seed) for seed in range(1000)]
    noise = np.stack([s.target for s in scenes]) - KABSCH_TRUTH.apply(MAST)
    across = KABSCH_TRUTH.R[:, 0]
    mirror = noise - 2.0 * (noise @ across)[..., None] * across
    signs, mirror_signs = (fit_rigid(MAST, KABSCH_TRUTH.apply(MAST) + draw).determinant for draw in (noise, mirror))
    assert 0.9 < np.mean(signs == -1) < 1.0
    assert (mirror_signs == 1).all()


def test_rotation_is_good_where_the_reflection_wins():
    """In the scene 'would-reflect', the rotation is less than 5° off and costs under a tenth more than the
    reflection."""
    scene = kabsch_scene("would-reflect")
    proper, free = (fit_rigid(scene.source, scene.target, proper=flag) for flag in (True, False))
    assert np.linalg.det(free.pose.R) < 0.0
    assert np.degrees(metrics.rre(proper.pose, scene.truth)) < 5.0
    assert free.cost < proper.cost < 1.1 * free.cost


# Start, and what determines the pose


@pytest.mark.parametrize("d", [2, 3])
def test_start_plays_no_part(d):
    """However the source is moved beforehand, the fit brings it to the same final place."""
    source, target, _ = noisy_pairs(13, d)
    rng = np.random.default_rng(8)
    expected = fit_rigid(source, target).pose.apply(source)
    for _ in range(20):
        R = rotation_3d(rng) if d == 3 else Pose.from_angle(rng.uniform(-np.pi, np.pi)).R
        start = Pose(R, 10.0 * rng.standard_normal(d)).apply(source)
        np.testing.assert_allclose(fit_rigid(start, target).pose.apply(start), expected, atol=1e-11)


def test_two_points_are_enough_in_the_plane():
    """Two pairs of distinct points determine a planar pose; one pair, or two equal points, only determine where that
    one point goes."""
    truth = Pose.from_angle(2.5, (1.0, 1.0))
    two = np.array([(0.0, 0.0), (1.0, 0.5)])
    np.testing.assert_allclose(fit_rigid(two, truth.apply(two)).pose.matrix, truth.matrix, atol=1e-12)
    for cloud in (two[:1], two[[0, 0]]):
        fit = fit_rigid(cloud, truth.apply(cloud))
        assert fit.status == Status.DEGENERATE
        assert fit.reason
        np.testing.assert_allclose(fit.pose.apply(cloud), truth.apply(cloud), atol=1e-12)


def test_three_noncollinear_points_are_enough_in_space():
    """Three noncollinear pairs determine a pose in space; collinear pairs, however many, do not."""
    rng = np.random.default_rng(4)
    truth = Pose(rotation_3d(rng), (1.0, 2.0, 3.0))
    three = rng.standard_normal((3, 3))
    np.testing.assert_allclose(fit_rigid(three, truth.apply(three)).pose.matrix, truth.matrix, atol=1e-10)
    line = np.linspace(-1.0, 1.0, 9)[:, None] * np.array([1.0, 2.0, -1.0])
    fit = fit_rigid(line, truth.apply(line))
    assert fit.status == Status.DEGENERATE
    assert "collinear" in fit.reason


def test_collinear_points_leave_one_rotation_free():
    """For collinear points in space, with and without noise, turning the solver's pose about their line by any angle
    leaves all residuals unchanged, and the fit reports that this rotation is free."""
    rng = np.random.default_rng(4)
    truth = Pose(rotation_3d(rng), (1.0, 2.0, 3.0))
    axis = np.array([1.0, 2.0, -1.0]) / np.sqrt(6.0)
    line = np.linspace(-1.0, 1.0, 9)[:, None] * axis
    for noise in (0.0, 0.1):
        target = truth.apply(line) + noise * rng.standard_normal((9, 3))
        assert "rotation about their line is free" in fit_rigid(line, target).reason
        first, *poses = (poses_about_line(line, target, angle) for angle in (0.0, 0.7, 2.0, 3.0))
        residuals = metrics.residuals(first, line, target)
        assert (residuals.max() < 1e-12) == (noise == 0.0)
        for pose, angle in zip(poses, (0.7, 2.0, 3.0), strict=True):
            np.testing.assert_allclose(metrics.residuals(pose, line, target), residuals, atol=1e-12)
            assert metrics.rre(pose, first) == pytest.approx(angle)


# Residual and error


def test_residual_at_the_optimum_is_below_that_at_the_truth():
    """With noise or wrong pairs the minimum is not at the truth, and its residual is smaller than the truth's."""
    for name in ("noisy", "outliers", "would-reflect"):
        for seed in SEEDS:
            scene = kabsch_scene(name, seed=seed)
            pose = fit_rigid(scene.source, scene.target).pose
            assert metrics.rms(pose, scene.source, scene.target) < metrics.rms(scene.truth, scene.source, scene.target)
            assert metrics.point_error(pose, scene.truth, scene.source) > 1e-3


@pytest.mark.parametrize(("d", "free"), [(2, 3), (3, 6)])
def test_expected_residual(d, free):
    """With small isotropic noise on n true pairs, the mean sum of squares at the optimum is σ² (d n − parameters)."""
    rng = np.random.default_rng(6)
    points, sigma, n = 2.0 * rng.standard_normal((13, d)), 0.05, 13
    truth = KABSCH_TRUTH if d == 2 else Pose(rotation_3d(rng), (1.0, 2.0, 3.0))
    costs = fit_rigid(points, draws(points, truth, sigma, 20_000)).cost
    standard_error = costs.std() / np.sqrt(len(costs))
    assert costs.mean() == pytest.approx(sigma**2 * (d * n - free), abs=4.0 * standard_error)


def test_noise_of_both_clouds_adds():
    """Isotropic noise on both clouds leaves the same residual as noise on one with the sum of their variances."""
    rng = np.random.default_rng(9)
    target = draws(BIRD, KABSCH_TRUTH, 0.04, 20_000)
    source = BIRD + 0.03 * rng.standard_normal(target.shape)
    costs = fit_rigid(source, target).cost
    standard_error = costs.std() / np.sqrt(len(costs))
    assert costs.mean() == pytest.approx(0.05**2 * (2 * 13 - 3), abs=4.0 * standard_error)


def test_fitted_scale_takes_one_more_square():
    """Fitting the scale as well lowers the expected sum of squares by another σ²."""
    target = draws(BIRD, KABSCH_TRUTH, 0.05, 20_000)
    costs = fit_rigid(BIRD, target, scale=True).cost
    standard_error = costs.std() / np.sqrt(len(costs))
    assert costs.mean() == pytest.approx(0.05**2 * (2 * 13 - 4), abs=4.0 * standard_error)


def test_two_pairs_leave_one_square():
    """Two pairs leave the residual one degree of freedom: each pair keeps half the difference of the two lengths."""
    source, target = np.array([(0.0, 0.0), (2.0, 0.0)]), np.array([(1.0, 1.0), (1.0, 3.4)])
    pose = fit_rigid(source, target).pose
    np.testing.assert_allclose(metrics.residuals(pose, source, target), 0.2, atol=1e-12)
    sigma = 0.01  # of 20,000 draws about an exact copy: the expected sum of squares
    targets = draws(source, KABSCH_TRUTH, sigma, 20_000)
    residuals = metrics.residuals(fit_rigid(source, targets).pose, source, targets)
    assert (residuals**2).sum(axis=-1).mean() == pytest.approx(sigma**2, rel=0.04)


def test_spread_of_the_angle():
    """The fitted angle has a standard deviation of σ / √Σ‖p̃‖², the centroid one of σ / √n per coordinate."""
    sigma, n = 0.05, len(BIRD)
    pose = fit_rigid(BIRD, draws(BIRD, KABSCH_TRUTH, sigma, 20_000)).pose
    p = BIRD - BIRD.mean(axis=0)
    assert (pose.angle - KABSCH_TRUTH.angle).std() == pytest.approx(sigma / np.sqrt((p**2).sum()), rel=0.03)
    centroid = pose.apply(BIRD).mean(axis=-2)
    np.testing.assert_allclose(centroid.std(axis=0), sigma / np.sqrt(n), rtol=0.03)


def test_residual_does_not_predict_the_error():
    """Over many draws of one scene with small isotropic noise, the RMS of a fit and its error are uncorrelated."""
    target = draws(BIRD, KABSCH_TRUTH, 0.05, 20_000)
    pose = fit_rigid(BIRD, target).pose
    rms = metrics.rms(pose, BIRD, target)
    for error in (metrics.rre(pose, KABSCH_TRUTH), metrics.point_error(pose, KABSCH_TRUTH, BIRD)):
        assert abs(np.corrcoef(rms, error)[0, 1]) < 4.0 / np.sqrt(20_000)


# Wrong pairs


def test_a_wrong_pair_pulls_in_proportion():
    """A partner displaced by δ moves the fitted cloud's centroid by δ/n exactly, however large δ is."""
    target = KABSCH_TRUTH.apply(BIRD)
    for delta in (0.1, 10.0, 1e4, 1e8):
        moved = target.copy()
        moved[4] += (delta, 0.0)
        centroid = fit_rigid(BIRD, moved).pose.apply(BIRD).mean(axis=0)
        assert centroid[0] - target.mean(axis=0)[0] == pytest.approx(delta / 13, rel=1e-6)


def test_one_wrong_pair_among_many_is_bounded_by_its_distance():
    """Of a thousand pairs, each in turn has its partner displaced by 1 u in a random direction: each time the fit moves
    the points by one to two thousandths of a unit (RMS)."""
    rng = np.random.default_rng(10)
    source = rng.uniform(-3.0, 3.0, (1000, 2))
    target, moved = KABSCH_TRUTH.apply(source), []
    for k, angle in enumerate(rng.uniform(0.0, 2 * np.pi, 1000)):
        copy = target.copy()
        copy[k] += (np.cos(angle), np.sin(angle))
        pose = fit_rigid(source, copy).pose
        moved.append(float(metrics.point_error(pose, KABSCH_TRUTH, source)))
    assert 0.001 <= min(moved) < 0.0011
    assert 0.0019 < max(moved) < 0.002


def test_partners_wrong_alike_hide_one_another():
    """With noise and six of thirteen partners shifted alike, the fit leaves some right pair with a larger residual than
    some wrong one in more than 90 % of draws."""
    wrong = np.arange(13) % 2 == 1
    target = draws(BIRD, KABSCH_TRUTH, 0.12, 200)
    target[:, wrong] += (1.5, 0.0)
    residuals = metrics.residuals(fit_rigid(BIRD, target).pose, BIRD, target)
    assert np.mean(residuals[:, ~wrong].max(axis=1) > residuals[:, wrong].min(axis=1)) > 0.9


def test_far_wrong_partners_show_in_the_largest_residual():
    """In all 25 draws with one to three far, unrelated wrong partners, the largest residual belongs to one of them; the
    one, two or three largest are exactly theirs in 25, 21 and 19 draws."""
    counts = dict.fromkeys((1, 2, 3), 0)
    for wrong in counts:
        for seed in SEEDS:
            scene = kabsch_scene("outliers", seed=seed, outliers=wrong)
            residuals = metrics.residuals(fit_rigid(scene.source, scene.target).pose, scene.source, scene.target)
            assert scene.target_outlier.sum() == wrong
            assert scene.target_outlier[residuals.argmax()]
            counts[wrong] += bool(scene.target_outlier[np.argsort(residuals)[-wrong:]].all())
    assert counts == {1: 25, 2: 21, 3: 19}


def test_enough_wrong_pairs_reflect_a_bird():
    """Wrong pairs alone, without noise, can make a reflection the best orthogonal matrix of the bird's pairs."""
    scene = kabsch_scene("outliers", outliers=6)
    assert fit_rigid(scene.source, scene.target).determinant == -1


# Scale


def test_rotation_is_the_same_with_scale():
    """Fitting a scale as well leaves the rotation unchanged, and the centroids still coincide."""
    source, target, _ = noisy_pairs(15, 3)
    rigid, similar = fit_rigid(source, 1.7 * target), fit_rigid(source, 1.7 * target, scale=True)
    np.testing.assert_allclose(rigid.pose.R, similar.pose.R, atol=1e-12)
    np.testing.assert_allclose(similar.pose.apply(source).mean(axis=0), 1.7 * target.mean(axis=0), atol=1e-12)


def test_scale_of_the_swapped_problem_is_not_the_inverse():
    """Swapping noisy clouds inverts the fitted rotation but not the scale: the two scales multiply to less than 1."""
    source, target, _ = noisy_pairs(15, 2)
    forward, backward = fit_rigid(source, target, scale=True), fit_rigid(target, source, scale=True)
    np.testing.assert_allclose(forward.pose.R @ backward.pose.R, np.eye(2), atol=1e-12)
    assert forward.pose.scale * backward.pose.scale < 0.99
