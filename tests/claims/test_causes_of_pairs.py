"""The causes that 'Start here', 'Correspondences known' and '… corrupted' name: each test changes that one factor."""

import numpy as np
import pytest

from solvers import Pose, fit_rigid, register
from solvers.metrics import rre, rte
from solvers.scenes.facade import FACADE, FACADE_TRUTH, facade_scene
from solvers.scenes.rooms import KABSCH_TRUTH, MAST, kabsch_scene
from solvers.scenes.scans import WALLS, ranges, two_scans
from solvers.studies.seeds import seeds

SEEDS = seeds(10)
FRONTS = seeds(25)
WALLS_FROM, WALLS_TO = (np.concatenate(ends) for ends in ([w[:-1] for w in WALLS], [w[1:] for w in WALLS]))


def nearest_distance(pose, source, target):
    """The RMS distance from the moved source points to their nearest target points."""
    gaps = np.linalg.norm(pose.apply(source)[:, None] - target, axis=2).min(axis=1)
    return float(np.sqrt((gaps**2).mean()))


def towards_the_source(scans):
    """The rays from the target's robot to each source point: their directions, the distance along each to the first
    wall, and the distance to the point."""
    way = scans.source_pose.apply(scans.source) - scans.target_pose.t
    distance = np.linalg.norm(way, axis=1)
    rays = way / distance[:, None]
    return rays, ranges(scans.target_pose.t, rays, WALLS_FROM, WALLS_TO), distance


def in_both_views(scans):
    """Which points of the source scan the target scan's robot can see as well."""
    _, wall, distance = towards_the_source(scans)
    return wall > distance - 1e-6


def measured_at_the_same_spots(scans):
    """The target robot's measurements at the spots that the source scan measured and both robots see."""
    rays, wall, _ = towards_the_source(scans)
    return scans.target_pose.inverse().apply(scans.target_pose.t + (rays * wall[:, None])[in_both_views(scans)])


def test_hidden_walls_are_part_of_the_distance(why):
    """Ten rooms without noise, at the true pose: leaving out the source points that the other robot cannot see lowers
    the RMS distance to the nearest points in every room, in the median by more than a quarter."""
    whole, part = [], []
    for seed in SEEDS:
        scans = two_scans(seed=seed, noise=0.0)
        whole.append(nearest_distance(scans.truth, scans.source, scans.target))
        part.append(nearest_distance(scans.truth, scans.source[in_both_views(scans)], scans.target))
    why(
        "which source points are counted",
        {
            "all of them": f"{np.median(whole):.2f} u in the median of ten rooms",
            "those that both robots see": f"{np.median(part):.2f} u",
        },
    )
    assert all(less < more for less, more in zip(part, whole, strict=True))
    assert np.median(part) < 0.75 * np.median(whole)
    assert min(part) > 0.05


def test_different_spots_are_the_rest_of_the_distance(why):
    """In the same ten rooms, on the walls that both robots see: if the target's rays are cast at the spots that the
    source measured, only rounding error remains of the distance at the true pose."""
    own, shared = [], []
    for seed in SEEDS:
        scans = two_scans(seed=seed, noise=0.0)
        points = scans.source[in_both_views(scans)]
        own.append(nearest_distance(scans.truth, points, scans.target))
        shared.append(nearest_distance(scans.truth, points, measured_at_the_same_spots(scans)))
    why(
        "where the target's rays hit the walls that both see",
        {
            "at spots of their own": f"{np.median(own):.2f} u in the median of ten rooms",
            "at the source's spots": f"{np.median(shared):.2f} u",
        },
    )
    assert min(own) > 0.05
    assert max(shared) < 1e-12


def test_a_thin_cloud_asks_for_reflections(why):
    """In nearly half of 4,000 draws of the noise the mast's best orthogonal fit is a reflection; for a mast bowed a
    hundred times as far it never is."""
    shares = {}
    for bow in (1.0, 100.0):
        mast = MAST * [bow, 1.0]
        noise = 0.12 * np.random.default_rng(11).standard_normal((4000, *mast.shape))
        shares[bow] = float((fit_rigid(mast, KABSCH_TRUTH.apply(mast) + noise).determinant == -1).mean())
    why(
        "how far the mast is bowed",
        {f"{0.008 * bow:g} u": f"{100 * share:.0f} % ask for a reflection" for bow, share in shares.items()},
    )
    assert 0.42 < shares[1.0] < 0.5
    assert shares[100.0] == 0.0


def test_guessed_pairs_break_the_valley(why):
    """The clean bird's sum of squares over the angle, centroids aligned, in steps of a quarter of a degree: one minimum
    with its own pairs, more than twenty with the nearest points paired anew at each angle."""
    scene = kabsch_scene("clean")
    p, q = scene.source - scene.source.mean(axis=0), scene.target - scene.target.mean(axis=0)
    rotations = Pose.from_angle(np.radians(np.arange(0.0, 360.0, 0.25)), np.zeros((1440, 2)))
    nearest, paired = (register(p, q, method, start=rotations, max_steps=0).objective for method in ("icp", "kabsch"))
    valleys = [int(((v < np.roll(v, 1)) & (v <= np.roll(v, -1))).sum()) for v in (nearest, paired)]
    why("the pairs", {"nearest points": f"{valleys[0]} minima over the circle", "those given": f"{valleys[1]} minimum"})
    assert valleys[0] > 20
    assert valleys[1] == 1


def test_the_sixth_partner_pulls_the_other_way(why):
    """With five and with six wrong partners the bird's fit is 35° and 3° off to the same side. The sixth alone turns it
    15° to the other side; placed equally far on its opposite side, it makes the error 45°."""
    five, six = kabsch_scene("outliers", outliers=5), kabsch_scene("outliers", outliers=6)
    (new,) = np.flatnonzero(six.source_outlier & ~five.source_outlier)
    right = five.truth.apply(five.source)
    alone, opposite = right.copy(), six.target.copy()
    alone[new], opposite[new] = six.target[new], 2.0 * right[new] - six.target[new]
    errors = {
        name: float(np.degrees(fit_rigid(five.source, target).pose.angle - five.truth.angle))
        for name, target in {"five": five.target, "six": six.target, "alone": alone, "opposite": opposite}.items()
    }
    why(
        "where the sixth wrong partner lies",
        {
            "where it was drawn": f"{abs(errors['six']):.0f}° off, after {abs(errors['five']):.0f}° with five",
            "as far on the opposite side": f"{abs(errors['opposite']):.0f}° off",
        },
    )
    assert -36.0 < errors["five"] < -34.0
    assert -4.0 < errors["six"] < -2.0
    assert 14.0 < errors["alone"] < 16.0
    assert -46.0 < errors["opposite"] < -44.0


def test_taking_the_source_for_exact_makes_the_scales_disagree(why):
    """Least-squares scales of noisy clouds, fitted in both directions, multiply to less than 0.96. In the mean of 4,000
    draws, the fitted scale is right if only the target is noisy, and too small if only the source is. The ratio of the
    two clouds' spreads treats neither as exact: its values in both directions multiply to one."""
    rng = np.random.default_rng(7)
    source = rng.standard_normal((15, 2)) * [1.0, 2.0]
    exact = Pose.from_angle(2.0, (0.5, -2.0)).apply(source)
    target = exact + 0.3 * rng.standard_normal((15, 2))
    noisy = exact + 0.3 * rng.standard_normal((4000, 15, 2))
    onto, back = (float(fit_rigid(a, b, scale=True).pose.scale.mean()) for a, b in ((source, noisy), (noisy, source)))
    least = [fit_rigid(a, b, scale=True).pose.scale for a, b in ((source, target), (target, source))]
    spread = [np.sqrt(np.square(cloud - cloud.mean(axis=0)).sum()) for cloud in (source, target)]
    ratios = [spread[1] / spread[0], spread[0] / spread[1]]
    why(
        "which cloud a fit takes for exact",
        {
            "its own source": f"the scales multiply to {float(np.prod(least)):.2f}",
            "an exact source, onto noise": f"a scale of {onto:.3f} in the mean",
            "a noisy source, onto exact points": f"a scale of {back:.3f} in the mean",
            "neither: the ratio of the spreads": f"to {np.prod(ratios):.2f}",
        },
    )
    assert np.prod(least) < 0.96
    assert abs(onto - 1.0) < 0.004
    assert back < 0.96
    assert abs(np.prod(ratios) - 1.0) < 1e-12


def test_wrong_pairs_alone_move_the_optimum(why):
    """On the bird without noise, three wrong partners put the fit more than 5° and 0.3 u off; with none it is exact."""
    errors = []
    for wrong in (3, 0):
        scene = kabsch_scene("outliers", outliers=wrong)
        pose = fit_rigid(scene.source, scene.target).pose
        errors.append((float(np.degrees(rre(pose, scene.truth))), float(rte(pose, scene.truth))))
    why(
        "how many partners are wrong",
        {name: f"{a:.1f}° and {t:.2f} u off" for name, (a, t) in zip(("three", "none"), errors, strict=True)},
    )
    assert errors[0][0] > 5.0
    assert errors[0][1] > 0.3
    assert max(errors[1]) < 1e-6


# Corrupted pairs


def squares_miss(moved):
    """The median errors of least squares, in u and degrees, over 25 draws with offsets `moved(scene, offsets, rng)`.

    offsets: each partner's offset from its right place, (40, 2).
    """
    errors = []
    for seed in FRONTS:
        scene = facade_scene(seed=seed)
        home = FACADE_TRUTH.apply(FACADE)
        target = home + moved(scene, scene.target - home, np.random.default_rng(seed))
        pose = fit_rigid(scene.source, target).pose
        errors.append((rte(pose, scene.truth), np.degrees(rre(pose, scene.truth))))
    return np.median(errors, axis=0)


def scatter(scene, offsets, rng):
    """The offsets with each wrong partner as far off as before, but in a random direction of its own."""
    ways = rng.uniform(0.0, 2.0 * np.pi, len(offsets))
    shifts = np.linalg.norm(offsets, axis=1)[:, None] * np.column_stack([np.cos(ways), np.sin(ways)])
    return np.where(scene.target_outlier[:, None], shifts, offsets)


def test_partners_that_lean_to_one_side_move_the_fit(why):
    """18 of 40 wrong, 25 draws: least squares misses by 1.4 u in the median, but by less than 0.4 u if the wrong
    partners lie as far off in random directions. The angle improves by less than a third."""
    leaning, spread = squares_miss(lambda scene, offsets, rng: offsets), squares_miss(scatter)
    why(
        "in which directions the 18 wrong partners lie",
        {
            "all to the right": f"{leaning[0]:.1f} u and {leaning[1]:.0f}° off in the median",
            "each its own": f"{spread[0]:.1f} u and {spread[1]:.0f}° off",
        },
    )
    assert leaning[0] == pytest.approx(1.38, abs=0.02)
    assert spread[0] < 0.4
    assert spread[1] > 0.67 * leaning[1]


def test_many_wrong_partners_move_the_fit(why):
    """25 draws of the scene: least squares misses by 1.4 u in the median with 18 of 40 wrong, and by 0.4 u with
    four."""
    misses = []
    for wrong in (18, 4):
        scenes = [facade_scene(seed=seed, outliers=wrong / 40) for seed in FRONTS]
        misses.append(np.median([rte(fit_rigid(s.source, s.target).pose, s.truth) for s in scenes]))
    why(
        "how many partners are wrong",
        {f"{n} of 40": f"{error:.1f} u off in the median" for n, error in zip((18, 4), misses, strict=True)},
    )
    assert misses[0] == pytest.approx(1.38, abs=0.02)
    assert misses[1] == pytest.approx(0.39, abs=0.02)
