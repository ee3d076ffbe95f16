"""RANSAC on proposed pairs and on congruent segments: trials, consensus, refits, screening, degenerate scenes."""

from itertools import combinations
from math import comb

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, fit_planar, fit_rigid, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.pairs.capped_grid import CappedGrid
from solvers.methods.pairs.congruent import CongruentOptions, _hypotheses
from solvers.methods.pairs.consensus import trials
from solvers.metrics import rre, rte
from solvers.scenes.rooms import ROOM_SETTINGS, room, room_start
from solvers.studies.race import SEEDS
from tests.solvers.methods.pairs.matches import many

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def spread(clouds):
    """The RMS radius of each of the clouds (b, n, d)."""
    offsets = clouds - clouds.mean(axis=1, keepdims=True)
    return np.sqrt(np.square(offsets).sum(axis=2).mean(axis=1))


def test_the_trials_formula():
    """N = ⌈log(1 − p)/log(1 − wˢ)⌉: that many independent trials miss at most 1 − p of the time, one fewer more
    often."""
    for w in (0.05, 0.3, 0.55, 0.9, 0.999):
        for p in (0.5, 0.9, 0.99, 0.999999):
            for s in (1, 2, 3):
                n = trials(w, p, s)
                assert n == int(n)
                assert n >= 1
                assert (1.0 - w**s) ** n <= (1.0 - p) * (1.0 + 1e-9)
                assert n == 1 or (1.0 - w**s) ** (n - 1) > (1.0 - p) * (1.0 - 1e-9)
    assert trials(0.5, 0.75, 1) == 2.0  # an integer quotient is not rounded up


def test_the_limits_of_the_trials_formula():
    """All pairs right: one trial. None right: no number suffices. A tiny share needs a finite number, not infinity."""
    assert trials(1.0, 0.99, 2) == 1.0
    assert trials(0.0, 0.99, 2) == np.inf
    assert trials(1e-6, 0.99, 2) == pytest.approx(np.log(100.0) * 1e12, rel=1e-6)
    assert trials([0.0, 0.5, 1.0], 0.99, 2).tolist() == [np.inf, 17.0, 1.0]
    assert isinstance(trials(0.5, 0.99, 2), float)
    for arguments, name in (
        ((1.1, 0.9, 2), "share"), ((-0.1, 0.9, 2), "share"), ((float("nan"), 0.9, 2), "share"),
        (("a", 0.9, 2), "share"), ((None, 0.9, 2), "share"), ((0.5, "a", 2), "confidence"), ((0.5, 0.9, 2.0), "sample"),
        ((0.5, 1.0, 2), "confidence"), ((0.5, 0.0, 2), "confidence"), ((0.5, 0.9, 0), "sample"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=rf"^{name}: "):
            trials(*arguments)


def test_distinct_draws_are_a_little_less_often_all_right_than_the_formula_assumes():
    """Of k right pairs among n, two distinct ones are both right with k(k−1)/(n(n−1)) < (k/n)²: by enumeration."""
    n, k = 40, 22
    share = sum(b < k for _, b in combinations(range(n), 2)) / comb(n, 2)
    assert share == pytest.approx(k * (k - 1) / (n * (n - 1)))
    assert share < (k / n) ** 2
    # The method's own draws have that share too: 20000 draws, within four standard deviations.
    rng = np.random.default_rng(0)
    clouds = rng.random((2, 1, n, 2))
    problem = Problem(clouds[0], clouds[1], np.ones((1, n)), Pose.identity(2, (1,)), np.array([3]))
    draws = METHODS["ransac"].start(problem, METHODS["ransac"].options(most=20000)).draws[0]
    assert np.all(draws[:, 0] != draws[:, 1])
    assert np.bincount(draws.ravel(), minlength=n).min() > 800
    fraction = (draws < k).all(axis=1).mean()
    assert abs(fraction - share) < 4.0 * np.sqrt(share * (1.0 - share) / 20000)


@pytest.mark.parametrize("d", [2, 3])
def test_a_large_motion_is_found_among_wrong_pairs(d, rng, random_pose):
    """With 45 % of the pairs wrong, the pose is found from any start, while the least-squares ghost is far off."""
    source, target, truth = many(rng, random_pose, 18, d=d)
    result = register(source, target, "ransac", seed=np.arange(20), separation=0.7)
    assert np.all(result.status == Status.CONVERGED)
    assert np.all(rre(result.pose, truth) < np.radians(4.0))
    assert np.all(rte(result.pose, truth) < 0.15)
    ghost = result.detail("ghost")
    assert np.allclose(ghost.matrix, fit_rigid(source, target).pose.matrix)
    assert np.median(rre(ghost, truth)) > 5.0 * np.median(rre(result.pose, truth))
    second = register(source, target, "ransac", seed=np.arange(20), separation=0.7, start=random_pose(rng, d))
    assert np.array_equal(second.pose.matrix, result.pose.matrix)


def test_the_end_is_a_stable_consensus(rng, random_pose):
    """At the end, the pose is the least-squares fit of the pairs within ε of it, and those are its inliers."""
    source, target, _ = many(rng, random_pose, 18)
    for inlier in (0.25, None):
        result = register(source, target, "ransac", seed=np.arange(20), inlier=inlier)
        inliers = result.detail("inliers")
        gaps = np.linalg.norm(result.transform(source) - target, axis=2)
        radius = np.full((20, 1), 0.25) if inlier else 0.1 * spread(target)[:, None]
        assert np.array_equal(inliers, gaps <= radius)
        assert np.array_equal(result.detail("count"), inliers.sum(axis=1))
        assert np.allclose(result.objective, (np.minimum(gaps, radius) ** 2).sum(axis=1))
        refit = fit_rigid(source, target, inliers.astype(float)).pose
        assert np.allclose(refit.matrix, result.pose.matrix, atol=1e-12)


def test_the_objective_of_the_best_never_rises_and_refits_may_lose_inliers(rng, random_pose):
    """From the first consensus on, trials and refits only lower the capped sum; the count sometimes falls too."""
    source, target, _ = many(rng, random_pose, 20, count=60)
    fewer = 0
    batch = begin(
        METHODS["ransac"],
        Problem(source, target, np.ones((60, 40)), Pose.identity(2, (60,)), np.arange(60)),
        METHODS["ransac"].options(per_step=4, inlier=0.12),
    )
    before = batch.state()
    while not batch.done:
        batch = advance(batch)
        after = batch.state()
        assert np.all(after.objective[before.found] <= before.objective[before.found])
        fewer += int((after.count[before.found] < before.count[before.found]).sum())
        assert np.all(after.trials <= 1000)
        before = after
    assert fewer > 0


@pytest.mark.parametrize("wrong", [0, 18, 32])
def test_the_size_of_a_step_changes_nothing(wrong, rng, random_pose):
    """One trial per step or hundreds give the same trials, the same budget and the same pose."""
    source, target, _ = many(rng, random_pose, wrong, count=6)
    runs = [
        register(source, target, "ransac", seed=np.arange(6), per_step=k, max_steps=2000) for k in (1, 7, 32, 500)
    ]
    for run in runs[1:]:
        assert np.array_equal(run.detail("trials"), runs[0].detail("trials"))
        assert np.array_equal(run.detail("budget"), runs[0].detail("budget"))
        assert np.array_equal(run.pose.matrix, runs[0].pose.matrix)


def test_the_budget_follows_the_consensus_and_the_cap_is_said(rng, random_pose):
    """Fewer right pairs, more trials; if the formula requires more than the cap, the run reports that it was capped."""
    used = []
    for wrong in (0, 12, 24, 30):
        source, target, _ = many(rng, random_pose, wrong)
        result = register(source, target, "ransac", seed=np.arange(20))
        used.append(np.median(result.detail("trials")))
        done = result.status == Status.CONVERGED
        enough = result.detail("trials") >= result.detail("budget")
        assert np.array_equal(done, enough)
    assert used == sorted(used)
    assert used[0] < 5 < used[-1]
    source, target, _ = many(rng, random_pose, 38)
    result = register(source, target, "ransac", seed=np.arange(20), most=50)
    assert np.all(result.detail("trials") == 50)
    assert np.all(result.status == Status.CAPPED)
    assert "trials ended before 99 % confidence" in result.reason[0]


def test_draws_keep_their_distance_and_close_ones_are_no_trials(rng):
    source = rng.uniform(-3.0, 3.0, (1, 40, 2))
    problem = Problem(source, source[:, ::-1].copy(), np.ones((1, 40)), Pose.identity(2, (1,)), np.array([5]))
    state = METHODS["ransac"].start(problem, METHODS["ransac"].options(separation=1.5))
    assert state.drawn.tolist() == [1000]
    for cloud in (problem.source[0], problem.target[0]):
        assert np.all(np.linalg.norm(cloud[state.draws[0, :, 0]] - cloud[state.draws[0, :, 1]], axis=1) >= 1.5)


@pytest.mark.parametrize("method", ["ransac", "ransac-congruent"])
def test_a_batch_gives_what_each_problem_gives_alone(method, rng, random_pose):
    source, target, _ = many(rng, random_pose, 18, count=12)
    batch = register(source, target, method, seed=np.arange(12) + 7)
    for i in range(12):
        alone = register(source[i], target[i], method, seed=i + 7)
        assert alone.steps == batch.steps[i]
        assert alone.status == batch.status[i]
        assert np.allclose(alone.matrix, batch.matrix[i], rtol=1e-12, atol=1e-12)
    second = register(source, target, method, seed=np.arange(12) + 1000)
    assert not np.array_equal(second.history.objective, batch.history.objective)


def test_pairs_that_agree_on_nothing(rng):
    """With all partners random, no pose has a meaningful consensus, and confidence is never claimed."""
    source, target = rng.uniform(-4.0, 4.0, (10, 30, 2)), rng.uniform(-4.0, 4.0, (10, 30, 2))
    result = register(source, target, "ransac", seed=np.arange(10), most=200)
    assert np.all(result.status == Status.CAPPED)
    assert np.all(result.detail("count") < 10)
    # Lengths never agree, so no trial leaves even its own two pairs within ε.
    stretched = register(source[0], 50.0 * source[0], "ransac", inlier=0.01)
    assert stretched.status is Status.DEGENERATE
    assert "no trial found 2 pairs within 0.01 u that determine a pose" in stretched.reason


def test_too_few_pairs_and_pairs_too_close():
    single = register([[0.0, 1.0]], [[2.0, 1.0]], "ransac")
    assert single.status is Status.DEGENERATE
    assert "a trial needs 2 pairs, got 1" in single.reason
    close = register([[0.0, 0.0], [0.1, 0.0], [0.2, 0.1]], np.eye(3)[:, :2], "ransac", separation=0.7)
    assert close.status is Status.DEGENERATE
    assert "no 2 pairs are 0.7 u apart" in close.reason
    equal = register(np.ones((5, 3)), np.arange(15.0).reshape(5, 3), "ransac")
    assert equal.status is Status.DEGENERATE
    two = register([[0.0, 0.0], [1.0, 0.0]], [[2.0, 1.0], [2.0, 2.0]], "ransac")
    assert np.allclose(two.matrix, Pose.from_angle(np.pi / 2, (2.0, 1.0)).matrix)


# Congruent segments.


RACE = {"separation": 2.0, "tolerance": 0.28, "inlier": 0.32}  # the race's options, u


def rooms(setting, seeds=SEEDS):
    scenes = [room(setting, seed=s) for s in seeds]
    return np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])


@pytest.mark.parametrize("setting", ROOM_SETTINGS)
def test_the_room_is_found_without_pairs_and_without_a_start(setting):
    """All 25 seeds end within 5°, at least 22 of them also within 0.2 u; the start pose changes nothing."""
    source, target = rooms(setting)
    truth = Pose.identity(2, (25,))
    result = register(source, target, "ransac-congruent", seed=SEEDS)
    assert np.all(rre(result.pose, truth) < np.radians(5.0))
    assert (rte(result.pose, truth) < 0.2).sum() >= 22
    second = register(source[:3], target[:3], "ransac-congruent", seed=SEEDS[:3], start=room_start(170.0, 3.0))
    assert np.array_equal(second.pose.matrix, result.pose[:3].matrix)


def test_hypotheses_lay_the_drawn_segments_on_each_other():
    """Each hypothesis maps the middle and the direction of its source segment to those of its target segment; source
    segments are long enough, and lengths agree to within the tolerance."""
    source, target = rooms("combo", SEEDS[:4])
    problem = Problem(source, target, np.ones(source.shape[:2]), Pose.identity(2, (4,)), np.array(SEEDS[:4]))
    state = METHODS["ransac-congruent"].start(problem, CongruentOptions(**RACE))
    R, t, exist, pairs, ends = _hypotheses(state)
    assert exist.mean() > 0.9
    for i in range(4):
        p, q = source[i][pairs[i]], target[i][ends[i]]
        dp, dq = p[:, 1] - p[:, 0], q[:, 1] - q[:, 0]
        own = exist[i]
        assert np.all(np.linalg.norm(dp, axis=1) >= 2.0)
        assert np.all(np.abs(np.linalg.norm(dp, axis=1) - np.linalg.norm(dq, axis=1))[own] <= 0.28)
        moved = np.einsum("kij,knj->kni", R[i], p) + t[i][:, None]
        assert np.allclose(moved.mean(axis=1)[own], q.mean(axis=1)[own], atol=1e-12)
        segment = moved[:, 1] - moved[:, 0]
        assert np.allclose((segment[:, 0] * dq[:, 1] - segment[:, 1] * dq[:, 0])[own], 0.0, atol=1e-12)
        assert np.all((segment * dq).sum(axis=1)[own] > 0.0)
        # Every draw gives both directions.
        assert np.array_equal(ends[i][:16], ends[i][16:, ::-1])


def test_the_look_up_bounds_the_score_from_below(rng, random_pose):
    """The grid's sum is at most the exact capped sum for any pose, and close to it for good poses."""
    source, target = rooms("combo", SEEDS[:5])
    reach = 0.32
    grid = CappedGrid.of(target, np.full(5, reach))
    poses = Pose(random_pose(rng, 2, (5, 40)).R, rng.uniform(-2.0, 2.0, (5, 40, 2)))
    close_poses = Pose.from_angle(rng.normal(0.0, 0.02, (5, 40)), rng.normal(0.0, 0.1, (5, 40, 2)))
    for pose in (poses, close_poses):
        bound = grid.total(pose.R, pose.t, source) * reach**2
        moved = pose.apply(source[:, None])
        exact = np.empty((5, 40))
        for i in range(5):
            gaps = np.linalg.norm(moved[i][:, :, None] - target[i][None, None], axis=3).min(axis=2)
            exact[i] = (np.minimum(gaps, reach) ** 2).sum(axis=1)
        assert np.all(bound <= exact * (1.0 + 1e-12))
        assert np.median(bound / exact) > 0.6
    # One point moved to 300 places exactly on cell corners and just beside them.
    single = CappedGrid.of(target[:1], np.array([reach]))
    corners = single.origin + single.cell[0] * rng.integers(0, 60, (300, 2))
    for shift in (-1e-9, 0.0, 1e-9):
        places = corners + shift
        result = single.total(np.broadcast_to(np.eye(2), (1, 300, 2, 2)), places[None], np.zeros((1, 1, 2)))[0]
        gaps = np.linalg.norm(places[:, None] - target[0], axis=2).min(axis=1)
        assert np.all(result <= np.minimum(gaps / reach, 1.0) ** 2 + 1e-7)
        assert result.min() < 0.5


def test_a_run_at_rest_ends_where_no_refit_helps():
    """At the last pose, the closed-form fit to the pairs within ε does not lower the capped sum; after the first step,
    when there are few refits, it does on most seeds."""
    source, target = rooms("combo")
    lowered = []
    for steps in (1, 1000):
        result = register(source, target, "ransac-congruent", seed=SEEDS, max_steps=steps, **RACE)
        state = result.states[0]
        fit = fit_planar(source, np.take_along_axis(target, state.rows[..., None], axis=1), state.used.astype(float))
        gaps = np.linalg.norm(fit.pose.apply(source)[:, :, None] - target[:, None], axis=3).min(axis=2)
        lowered.append(np.square(np.minimum(gaps, RACE["inlier"])).sum(axis=1) < state.objective * (1.0 - 1e-9))
    assert np.all(result.converged)
    assert lowered[0].sum() > 12
    assert not lowered[1].any()


def test_what_is_kept_is_scored_exactly_and_little_else_is():
    """Pairs, inliers and objective of the kept pose are those of exact neighbours; fewer than a tenth of the hypotheses
    had to be scored to find it."""
    source, target = rooms("combo", SEEDS[:3])
    result = register(source, target, "ransac-congruent", seed=SEEDS[:3], **RACE)
    state = result.states[0]
    used = state.used
    gaps = np.linalg.norm(result.transform(source)[:, :, None] - target[:, None], axis=3)
    assert np.array_equal(state.rows, gaps.argmin(axis=2))
    assert np.array_equal(used, gaps.min(axis=2) <= 0.32)
    assert np.allclose(state.objective, (np.minimum(gaps.min(axis=2), 0.32) ** 2).sum(axis=1))
    assert np.all(state.objective <= state.best)
    assert np.all(state.scored < 0.1 * state.tried)


def test_congruent_scenes_without_an_answer(rng):
    cloud = rng.uniform(-0.5, 0.5, (20, 2))
    small = register(cloud, cloud, "ransac-congruent", separation=2.0)
    assert small.status is Status.DEGENERATE
    assert "no two source points were found 2 u apart" in small.reason
    single = register(cloud[:1], cloud, "ransac-congruent")
    assert single.status is Status.DEGENERATE
    assert single.reason == "all source points are equal: the rotation is undefined"
    # Two points far from many equal ones: no drawn pair is as far apart as the radius requires.
    heap = np.concatenate([np.zeros((60000, 2)), [[1.0, 0.0], [-1.0, 0.0]]])
    rare = register(heap, cloud, "ransac-congruent", separation=None, most=1)
    assert rare.status is Status.DEGENERATE
    assert rare.reason == "no two source points were found 0.6 of their RMS radius apart"
    for options, up_to in (({}, "0.1 of the target's RMS radius"), ({"tolerance": 0.28}, "0.28 u")):
        failure = register(20.0 * cloud, cloud, "ransac-congruent", **options)
        assert failure.status is Status.DEGENERATE
        assert failure.reason == f"no two target points were found as far apart as two source points, up to {up_to}"
    equal = register(10.0 * cloud, np.ones((4, 2)), "ransac-congruent")
    assert equal.status is Status.DEGENERATE
    wide = np.concatenate([10.0 * cloud, [[1e7, -1e7]]])
    result = register(10.0 * cloud, wide, "ransac-congruent", patience=40, **RACE)
    assert np.abs(result.matrix - np.eye(3)).max() < 1e-6


def test_lengths_that_are_not_given_are_those_of_each_problem():
    """Rooms of three sizes in one batch: each uses a tenth of its own target's radius and ends as its own run does."""
    source, target = (c[0] * np.array([1.0, 1e-2, 30.0])[:, None, None] for c in rooms("clean", SEEDS[:1]))
    batch = register(source, target, "ransac-congruent", seed=40)
    state = batch.states[0]
    for length, share, cloud in ((state.inlier, 0.1, target), (state.tolerance, 0.1, target),
                                 (state.separation, 0.6, source)):  # fmt: skip
        np.testing.assert_allclose(length, share * spread(cloud), rtol=1e-12)
    for k in range(3):
        assert np.array_equal(register(source[k], target[k], "ransac-congruent", seed=40).matrix, batch.matrix[k])
    pair_state = register(target[:, :40], target[:, :40], "ransac").states[0]
    np.testing.assert_allclose(pair_state.inlier, 0.1 * spread(target[:, :40]), rtol=1e-12)


@pytest.mark.parametrize(
    ("method", "option", "value"),
    [
        ("ransac", "inlier", 0.0), ("ransac", "confidence", 1.0), ("ransac", "most", 0), ("ransac", "per_step", 0),
        ("ransac", "separation", -1.0), ("ransac-congruent", "per_step", 3), ("ransac-congruent", "patience", 0),
        ("ransac-congruent", "tolerance", -0.1), ("ransac-congruent", "screen", 0),
    ],
)  # fmt: skip
def test_wrong_options_are_named(method, option, value):
    with pytest.raises(ValueError, match=rf"^{option}: "):
        register(np.eye(3)[:, :2], np.eye(3)[:, :2], method, **{option: value})


def test_a_grid_finer_than_the_coordinates_rounding_holds_every_point():
    """Far from the origin a target point's cell may be computed as outside the grid; it then counts at the rim."""
    rng = np.random.default_rng(560475)
    size = 2.0 ** int(rng.integers(30, 60))
    last = np.spacing(size)
    source = rng.standard_normal((4, 2))
    target = size * rng.uniform(1, 2, (1, 2)) + last * rng.integers(-3, 4, (4, 2))
    inlier = float(rng.uniform(0.1, 8) * last)
    result = register(source, target, "ransac-congruent", inlier=inlier, tolerance=inlier, separation=0.1, most=1)
    assert result.status == Status.DEGENERATE


def test_a_tolerance_beyond_the_separation_tries_pairs_all_the_same():
    """The ring of possible partners then has no inner edge."""
    source = np.random.default_rng(1).uniform(-1.0, 1.0, (30, 2))
    target = Pose.from_angle(0.4, (0.2, 0.1)).apply(source)
    result = register(source, target, "ransac-congruent", separation=0.5, tolerance=10.0, inlier=0.1)
    assert result.detail("tried") > 0
    assert result.status != Status.DEGENERATE
