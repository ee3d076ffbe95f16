"""The claims of the chapter 'Correspondences corrupted', checked against the solvers."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from solvers import Pose, Status, fit_planar, fit_rigid, register
from solvers.methods.pairs.consensus import capped_sum, trials
from solvers.metrics import rre, rte
from solvers.scenes.facade import FACADE, FACADE_TRUTH, PERIOD, facade_scene
from solvers.studies.race import SEEDS

FALSE_POSE = FACADE_TRUTH.compose(Pose.from_angle(0.0, (PERIOD, 0.0)))


def solve(scene, **options):
    """The figure's run on a scene."""
    usual = {"inlier": 0.25, "separation": 0.7, "most": 300, "per_step": 300, "max_steps": 400}
    return register(scene.source, scene.target, method="ransac", seed=scene.seed, **usual | options)


def every_trial(scene, separation):
    """All possible trials: their rows (k, 2), poses, squared residuals (k, 40), and whether both pairs are right."""
    rows = np.array(list(combinations(range(len(scene.source)), 2)))
    gaps = [np.linalg.norm(cloud[rows[:, 0]] - cloud[rows[:, 1]], axis=1) for cloud in (scene.source, scene.target)]
    rows = rows[np.minimum(*gaps) >= separation]
    pose = fit_planar(scene.source[rows], scene.target[rows]).pose
    squares = ((pose.apply(scene.source) - scene.target) ** 2).sum(axis=-1)
    return rows, pose, squares, ~scene.target_outlier[rows].any(axis=1)


def test_a_wrong_pose_seldom_keeps_its_own_two_pairs():
    """Of trials with a wrong pair, 75 to 80 % leave both pairs beyond ε, the rest neither; right trials keep both."""
    rows, _, squares, right = every_trial(facade_scene(), 0.7)
    own = np.take_along_axis(squares, rows, axis=1) <= 0.25**2
    assert 0.75 < 1 - own[~right].all(axis=1).mean() < 0.8
    assert (own[:, 0] == own[:, 1]).all()
    assert own[right].all()


def test_most_trials_gather_three_pairs_at_most():
    """Of the 650 possible trials in the figure's scene, more than 60 % have at most three pairs within ε, and 25 to
    30 % at least 20, where 22 pairs are right."""
    scene = facade_scene()
    _, _, squares, _ = every_trial(scene, 0.7)
    count = (squares <= 0.25**2).sum(axis=1)
    assert len(count) == 650
    assert (~scene.target_outlier).sum() == 22
    assert (count <= 3).mean() > 0.6
    assert 0.25 < (count >= 20).mean() < 0.3


# Least squares


def test_least_squares_translation_has_no_bound():
    """With one of forty partners moved by 10, 10⁴ or 10⁷ u, the fitted centroid moves by a fortieth of that."""
    for distance in (10.0, 1e4, 1e7):
        scene = facade_scene(outliers=0.0)
        target = scene.target.copy()
        target[7] += (distance, 0.0)
        poses = [fit_rigid(scene.source, q).pose for q in (scene.target, target)]
        before, after = (pose.apply(scene.source).mean(axis=0) for pose in poses)
        np.testing.assert_allclose(after - before, (distance / 40, 0.0), rtol=1e-9, atol=1e-9)


def test_a_far_partner_turns_the_fit():
    """The fitted rotation turns the direction from the centroid to a point onto the direction to its far partner."""
    scene = facade_scene(outliers=0.0)
    for direction in ((1.0, 0.0), (-0.6, 0.8), (0.0, -1.0)):
        target = scene.target.copy()
        target[7] += 1e7 * np.array(direction)
        faces = fit_rigid(scene.source, target).pose.R @ (scene.source[7] - scene.source.mean(axis=0))
        np.testing.assert_allclose(faces / np.linalg.norm(faces), direction, atol=1e-4)


def test_one_wrong_pair_of_forty_does_not_ruin_the_fit():
    """Without noise, one corner matched to a window across the front costs below 2° and 0.15 u in each of 25 draws."""
    for seed in SEEDS:
        scene = facade_scene(seed=seed, noise=0.0, outliers=1 / 40)
        pose = fit_rigid(scene.source, scene.target).pose
        assert 0.0 < np.degrees(rre(pose, scene.truth)) < 2.0
        assert 0.0 < rte(pose, scene.truth) < 0.15


@pytest.mark.parametrize(("wrong", "degrees", "units"), [(0.45, 2.0, 0.1), (0.8, 3.0, 0.15)])
def test_consensus_finds_what_least_squares_misses(wrong, degrees, units):
    """In each of 25 draws, the consensus is within 2° and 0.1 u with 18 of 40 wrong, and within 3° and 0.15 u with 32;
    least squares is more than 0.8 u off."""
    for seed in SEEDS:
        scene = facade_scene(seed=seed, outliers=wrong)
        result = solve(scene)
        assert result.status is Status.CONVERGED
        assert np.degrees(rre(result.pose, scene.truth)) < degrees
        assert rte(result.pose, scene.truth) < units
        assert rte(fit_rigid(scene.source, scene.target).pose, scene.truth) > 0.8


# Proposing and judging


def test_two_pairs_share_their_disagreement():
    """The fit of two pairs leaves each of them a residual of half the difference of their two lengths."""
    rng = np.random.default_rng(5)
    p, q = rng.standard_normal((200, 2, 2)), rng.standard_normal((200, 2, 2))
    residuals = np.linalg.norm(fit_planar(p, q).pose.apply(p) - q, axis=-1)
    lengths = [np.linalg.norm(cloud[:, 1] - cloud[:, 0], axis=1) for cloud in (p, q)]
    np.testing.assert_allclose(residuals, np.abs(lengths[0] - lengths[1])[:, None] / 2 * np.ones(2), atol=1e-12)


# The budget


def test_budget_keeps_its_promise_under_its_assumptions():
    """With independent draws, N trials miss with probability at most 1 − p, and one trial fewer misses more often:
    exactly by the formula, and in 400,000 draws."""
    rng = np.random.default_rng(2)
    for w, p in ((0.55, 0.9), (0.3, 0.9), (0.7, 0.99)):
        n = int(trials(w, p, 2))
        assert (1 - w * w) ** n <= 1 - p < (1 - w * w) ** (n - 1)
        clean = (rng.random((400_000, n, 2)) < w).all(axis=2)
        missed, missed_sooner = (~clean.any(axis=1)).mean(), (~clean[:, :-1].any(axis=1)).mean()
        error = 4.0 * np.sqrt(p * (1 - p) / 400_000)
        assert missed == pytest.approx((1 - w * w) ** n, abs=error)
        assert missed <= 1 - p < missed_sooner


def test_limits_of_the_budget():
    """If all pairs are right, one trial is enough; as the fraction goes to zero, the budget grows without bound."""
    assert trials(1.0, 0.999999, 2) == 1.0
    assert trials(0.0, 0.5, 2) == np.inf
    counts = [trials(w, 0.99, 2) for w in (0.1, 0.01, 0.001)]
    assert counts[2] > counts[1] > counts[0] > 400


def test_halving_the_fraction_takes_four_times_the_trials():
    """For small w, half of it takes four times as many trials of two pairs, and eight times as many of three."""
    for s in (2, 3):
        for w in (0.1, 0.05, 0.02):
            assert trials(w / 2, 0.99, s) / trials(w, 0.99, s) == pytest.approx(2**s, rel=0.02)


def test_every_nine_costs_the_same():
    """Each extra nine of the confidence adds the same number of trials, apart from rounding up."""
    for w in (0.1, 0.3, 0.55):
        counts = [trials(w, 1 - 0.1**k, 2) for k in range(1, 7)]
        assert np.ptp(np.diff(counts)) <= 1.0
        assert counts[1] <= 2 * counts[0]


def test_two_distinct_pairs_are_right_a_little_less_often():
    """Counted over all draws, both pairs are right in k(k−1)/n(n−1) of them, which is w² − w(1−w)/(n−1). RANSAC's
    draws, two different rows each, match that share to a thousandth; w² is six thousandths more."""
    for n, k in ((40, 22), (40, 8), (40, 2), (10, 5)):
        right = np.arange(n) < k
        odds = np.mean([right[i] and right[j] for i, j in combinations(range(n), 2)])
        w = k / n
        assert odds == pytest.approx(k * (k - 1) / (n * (n - 1)))
        assert odds == pytest.approx(w * w - w * (1 - w) / (n - 1))
    scene = facade_scene()
    draws = register(scene.source, scene.target, "ransac", max_steps=0, most=1_000_000).detail("draws")
    assert (draws[:, 0] != draws[:, 1]).all()
    clean = (~scene.target_outlier[draws]).all(axis=1).mean()
    assert clean == pytest.approx(22 * 21 / (40 * 39), abs=1e-3)
    assert clean < 0.55**2 - 5e-3
    exact = np.ceil(np.log(0.01) / np.log1p(-22 * 21 / (40 * 39)))
    assert (trials(22 / 40, 0.99, 2), exact) == (13, 14)


def on_corners(scene):
    """The scene with its wrong partners on distinct corners, drawn from the whole front."""
    target, wrong = scene.target.copy(), np.flatnonzero(scene.target_outlier)
    corners = np.random.default_rng(scene.seed).permutation(len(FACADE))[: len(wrong)]
    target[wrong] = FACADE_TRUTH.apply(FACADE)[corners]
    return replace(scene, target=target)


def odds_of_draws(scenes, separation):
    """The share of draws with two right pairs, among RANSAC's 10,000 on each scene; all keep the minimum separation."""
    shares = []
    for scene in scenes:
        options = {"seed": scene.seed, "separation": separation, "most": 10_000, "max_steps": 0}
        rows = register(scene.source, scene.target, "ransac", **options).detail("draws")
        for cloud in (scene.source, scene.target):
            assert np.linalg.norm(np.diff(cloud[rows], axis=1), axis=2).min() >= separation
        shares.append((~scene.target_outlier[rows]).all(axis=1).mean())
    return np.mean(shares)


def test_separation_changes_the_odds(why):
    """Over 25 draws, requiring 0.7 u between the points raises the mean chance of two right pairs from 0.30 to 0.32,
    both counted and among RANSAC's own draws. If no two wrong partners share a corner, it stays at 0.30."""
    scenes = [facade_scene(seed=seed) for seed in SEEDS]
    free, piled = (np.mean([every_trial(scene, gap)[3].mean() for scene in scenes]) for gap in (0.0, 0.7))
    alone = np.mean([every_trial(on_corners(scene), 0.7)[3].mean() for scene in scenes])
    why(
        "where the wrong partners lie",
        {
            "piled up on the corners at the right": f"the odds go from {free:.2f} to {piled:.2f}",
            "on corners all different": f"from {free:.2f} to {alone:.2f}",
        },
    )
    assert free == pytest.approx(22 * 21 / (40 * 39))
    assert 0.315 < piled < 0.325
    assert 0.295 < alone < 0.305
    assert odds_of_draws(scenes, 0.0) == pytest.approx(free, abs=0.003)
    assert odds_of_draws(scenes, 0.7) == pytest.approx(piled, abs=0.003)


def test_a_clean_draw_need_not_be_a_good_one():
    """Over 25 draws, 4 of 5 trials with two right pairs gather 20 of the 22 right ones; at 1.5 u apart, 19 of 20 do."""

    def good(separation):
        shares = []
        for seed in SEEDS:
            _, _, squares, right = every_trial(facade_scene(seed=seed), separation)
            shares.append(((squares[right] <= 0.25**2).sum(axis=1) >= 20).mean())
        return np.mean(shares)

    assert 0.77 < good(0.0) < 0.86
    assert good(0.0) < good(0.7) < good(1.5)
    assert 0.93 < good(1.5) < 0.98


def successes(scenes, **options):
    """The number of scenes in which a run ends within 2° and 0.15 u of the truth."""
    poses = [(solve(scene, **options).pose, scene.truth) for scene in scenes]
    return sum(bool(rte(*pair) < 0.15 and np.degrees(rre(*pair)) < 2.0) for pair in poses)


def test_a_low_confidence_may_do_better_than_it_says(why):
    """25 draws at 50 % confidence: if the share of right pairs is estimated along the way, all find the truth; given
    the true share, a run makes two trials, and 16 find it."""
    scenes, report = [facade_scene(seed=seed) for seed in SEEDS], int(trials(0.55, 0.5, 2))
    guessed = successes(scenes, confidence=0.5)
    known = successes(scenes, confidence=1 - 1e-12, most=report, per_step=report)
    why(
        "how the share of right pairs is known",
        {
            "estimated from the best trial so far": f"{guessed} of 25 find the truth",
            f"told, which makes {report} trials": f"{known} of 25",
        },
    )
    assert report == 2
    assert guessed == 25
    assert known == 16


def test_contradicting_pairs_let_a_low_confidence_do(why):
    """18 of 40 wrong, 25 draws at 50 % confidence: if the wrong pairs contradict one another, all end at the truth; if
    they agree, 21 do."""
    contradict = successes([facade_scene(seed=seed) for seed in SEEDS], confidence=0.5)
    alike, _ = outcomes(0.45, 0.5)
    why(
        "whether the 18 wrong pairs agree",
        {"they contradict one another": f"{contradict} of 25 find the truth", "all one window off": f"{alike} of 25"},
    )
    assert contradict == 25
    assert alike == 21


# The refit


def test_a_refit_lowers_the_capped_sum_and_sometimes_the_count():
    """Over 25 draws at ε = 0.1 u, the plain least-squares fit of each possible trial's consensus, before any acceptance
    rule, never raises the capped sum, and nearly two hundred of these fits lose a pair or more."""
    fell = 0
    for seed in SEEDS:
        scene = facade_scene(seed=seed)
        rows, _, squares, _ = every_trial(scene, 0.7)
        inliers = squares <= 0.1**2
        clouds = (np.broadcast_to(cloud, (len(rows), 40, 2)) for cloud in (scene.source, scene.target))
        pose = fit_planar(*clouds, inliers.astype(float)).pose
        refit_squares = ((pose.apply(scene.source) - scene.target) ** 2).sum(axis=-1)
        fitted = inliers.sum(axis=1) >= 2  # fewer do not determine a fit
        before, after = (np.minimum(s, 0.1**2).sum(axis=1)[fitted] for s in (squares, refit_squares))
        assert (after <= before * (1 + 1e-12)).all()
        fell += ((refit_squares <= 0.1**2).sum(axis=1) < inliers.sum(axis=1))[fitted].sum()
    assert 180 < fell < 200


def test_the_stable_consensus_is_its_own_fit():
    """At the end, the pose is the least-squares fit of the pairs within ε, and exactly these are within ε of it."""
    for seed in SEEDS:
        scene = facade_scene(seed=seed)
        result = solve(scene)
        inliers = result.detail("inliers")
        refit = fit_rigid(scene.source, scene.target, inliers.astype(float)).pose
        np.testing.assert_allclose(refit.matrix, result.pose.matrix, atol=1e-10)
        distances = np.linalg.norm(refit.apply(scene.source) - scene.target, axis=1)
        np.testing.assert_array_equal(distances <= 0.25, inliers)


# The threshold


def test_how_many_right_pairs_lie_within_the_threshold():
    """At the true pose, RANSAC counts a share 1 − exp(−ε²/2σ²) of the right pairs as inliers, to 0.015 over the 8,800
    of 400 draws: 39 % at ε = σ and 95 % at 2.45 σ."""
    scenes = [facade_scene(seed=seed) for seed in range(2000, 2400)]
    source, target = (np.stack([getattr(scene, name) for scene in scenes]) for name in ("source", "target"))
    wrong = np.stack([scene.target_outlier for scene in scenes])
    share = {}
    for epsilon in (0.03, 0.06, 0.12, 0.147, 0.25):
        result = register(source, target, "ransac", start=FACADE_TRUTH, max_steps=0, most=1, inlier=epsilon)
        share[epsilon] = result.detail("inliers")[~wrong].mean()
        assert share[epsilon] == pytest.approx(1 - np.exp(-(epsilon**2) / (2 * 0.06**2)), abs=0.015)
    assert share[0.06] == pytest.approx(0.39, abs=0.015)
    assert share[0.147] == pytest.approx(0.95, abs=0.015)


def test_a_tight_threshold_rejects_right_pairs(why):
    """ε = 0.04 u at σ = 0.06 u, 25 draws: half of the 22 right pairs or more are lost, and trials grow over tenfold."""
    losses, counts, usual = [], [], []
    for seed in SEEDS:
        scene = facade_scene(seed=seed)
        tight = solve(scene, inlier=0.04)
        losses.append((~tight.detail("inliers") & ~scene.target_outlier).sum())
        counts.append(tight.detail("trials"))
        usual.append(solve(scene).detail("trials"))
    why(
        "the threshold, with noise of 0.06 u",
        {
            "0.04 u": f"{np.median(counts):.0f} trials in the median, {min(losses)} to {max(losses)} right pairs lost",
            "0.25 u": f"{np.median(usual):.0f} trials",
        },
    )
    assert min(losses) >= 11
    assert np.median(counts) > 10 * np.median(usual)


def test_a_wide_threshold_admits_wrong_pairs(why):
    """ε = 1.25 u, a quarter of the pairs wrong by one window: in each of 25 draws all pairs are counted, the pose is a
    quarter of a window off, and the RMS over the forty is about half a unit."""
    runs = []
    for seed in SEEDS:
        scene = facade_scene("repeated", seed=seed, outliers=0.25)
        runs.append((scene, solve(scene, inlier=1.25), solve(scene)))
    errors = [np.median([rte(run[k].pose, run[0].truth) for run in runs]) for k in (1, 2)]
    why("the threshold", {"1.25 u": f"{errors[0]:.2f} u off in the median", "0.25 u": f"{errors[1]:.2f} u off"})
    for scene, wide, usual in runs:
        assert wide.detail("count") == 40
        assert wide.detail("trials") <= 2
        assert rte(wide.pose, scene.truth) == pytest.approx(PERIOD / 4, abs=0.05)
        assert np.sqrt(wide.objective / 40) == pytest.approx(0.5, abs=0.05)
        assert rte(usual.pose, scene.truth) < 0.05


# What confidence cannot buy


def outcomes(wrong, confidence):
    """The numbers of draws, of 25, in which the repeated scene ends at the truth and at the false pose."""
    true = false = 0
    for seed in SEEDS:
        scene = facade_scene("repeated", seed=seed, outliers=wrong)
        pose = solve(scene, confidence=confidence).pose
        true, false = true + int(rte(pose, scene.truth) < 0.2), false + int(rte(pose, FALSE_POSE) < 0.2)
    assert true + false == 25
    return true, false


def test_confidence_repairs_a_false_minority(why):
    """With 18 of 40 wrong alike, 50 % confidence takes the false pose in at least two of 25 draws, 99 % in none."""
    low, high = outcomes(0.45, 0.5), outcomes(0.45, 0.99)
    why("the confidence", {"99 %": f"{high[1]} of 25 end at the false pose", "50 %": f"{low[1]} of 25"})
    assert low[1] >= 2
    assert high == (25, 0)


def test_a_wide_threshold_lets_neighbours_support_one_another(why):
    """32 of 40 wrong, 25 draws: none ends within 0.15 u of the truth with ε = 1.6 u, all do with 0.25 u."""
    scenes = [facade_scene(seed=seed, outliers=0.8) for seed in SEEDS]
    hits = {
        epsilon: [rte(solve(scene, inlier=epsilon).pose, scene.truth) < 0.15 for scene in scenes]
        for epsilon in (1.6, 0.25)
    }
    why("the threshold", {f"{e:g} u": f"{sum(result)} of 25 within 0.15 u of the truth" for e, result in hits.items()})
    assert not any(hits[1.6])
    assert all(hits[0.25])


def test_confidence_confirms_a_false_majority():
    """With 24 of 40 wrong alike, 50 % finds the truth in at least two of 25 draws; 90, 99 and 99.99 % never do."""
    assert outcomes(0.6, 0.5)[0] >= 2
    for confidence in (0.9, 0.99, 0.9999):
        assert outcomes(0.6, confidence) == (0, 25)


def test_the_false_pose_is_the_better_optimum():
    """With 24 of 40 wrong alike, the lowest capped sum of all possible trials lies at the false pose."""
    for seed in SEEDS:
        scene = facade_scene("repeated", seed=seed, outliers=0.6)
        _, pose, squares, _ = every_trial(scene, 0.7)
        best = int(np.argmin(capped_sum(squares, 0.25)))
        assert np.linalg.norm(pose[best].apply(FACADE) - FALSE_POSE.apply(FACADE), axis=1).max() < 0.3
