"""Graduated non-convexity: the surrogate and its weights, many wrong pairs, invariance, hopeless scenes."""

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, fit_rigid, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.pairs.graduated import surrogate, tls_weights
from solvers.metrics import rre, rte
from tests.solvers.methods.pairs.matches import many, matches

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
METHOD = "graduated-nonconvexity"


@pytest.mark.parametrize("mu", [1e-6, 0.01, 0.3, 1.0, 7.0, 1e4])
def test_the_weights_minimise_the_surrogate(mu):
    """Over v from 0 to 1, v r² + c² μ (1 − v)/(μ + v) is lowest at the closed form, where it equals the surrogate."""
    v = np.concatenate([np.linspace(0.0, 1.0, 20_001), np.geomspace(1e-10, 1.0, 20_000)])
    ratio = np.concatenate([np.linspace(0.0, 3.0, 61), [10.0, 50.0, 1e3]])
    cost = v * np.square(ratio)[:, None] + mu * (1.0 - v) / (mu + v)
    own = tls_weights(ratio, np.array(mu))
    at_own = own * np.square(ratio) + mu * (1.0 - own) / (mu + own)
    assert (at_own <= cost.min(axis=1) + 1e-12).all()
    assert (cost.min(axis=1) - at_own < 1e-3).all()
    np.testing.assert_allclose(surrogate(ratio, np.array(mu)), at_own, atol=1e-9)


def test_the_surrogate_goes_from_the_square_to_the_truncated_square():
    ratio = np.linspace(0.0, 3.0, 61)
    assert np.abs(surrogate(ratio, np.array(1e8)) - np.minimum(ratio**2, 1.0)).max() < 1e-8
    # For small μ it is √μ times the distance, up to a remainder of the order of μ: convex.
    small = surrogate(ratio, np.array(1e-6))
    assert np.abs(small - 2e-3 * ratio).max() < 2e-5
    assert (surrogate(ratio, np.array(0.3)) <= np.minimum(ratio**2, 1.0) + 1e-15).all()
    hard = tls_weights(ratio, np.array(np.inf))
    assert np.array_equal(hard, (ratio <= 1.0).astype(float))


@pytest.mark.parametrize("d", [2, 3])
def test_without_wrong_pairs_it_is_kabsch(d, rng, random_pose):
    """With no pair beyond the bound, it is the least-squares fit of all pairs, in one step if none was in doubt."""
    source, target, _ = many(rng, random_pose, 0, d=d)
    for inlier, steps in ((10.0, 1), (0.45, None)):
        result = register(source, target, METHOD, inlier=inlier)
        assert np.all(result.status == Status.CONVERGED)
        assert np.all(result.detail("shares") == 1.0)
        if steps:
            assert np.all(result.steps == steps)
        assert np.allclose(result.matrix, fit_rigid(source, target).pose.matrix, atol=1e-12)


@pytest.mark.parametrize(("d", "wrong"), [(2, 4), (2, 20), (3, 20)])
def test_wrong_pairs_are_let_go(d, wrong, rng, random_pose):
    """With up to half of the pairs wrong and scattered, all 20 scenes find the truth, whatever the start; least squares
    misses it."""
    source, target, truth = many(rng, random_pose, wrong, d=d)
    result = register(source, target, METHOD, inlier=0.3)
    assert np.all(result.status == Status.CONVERGED)
    assert np.all(rre(result.pose, truth) < np.radians(3.0))
    assert np.all(rte(result.pose, truth) < 0.15)
    everyone = fit_rigid(source, target).pose
    assert np.median(rte(everyone, truth)) > 3.0 * np.median(rte(result.pose, truth))
    second = register(source, target, METHOD, inlier=0.3, start=random_pose(rng, d))
    assert np.array_equal(second.matrix, result.matrix)


def test_the_end_is_all_in_or_all_out_and_its_own_fit(rng, random_pose):
    """The final weights are 0 and 1, with 1 exactly within the bound; the pose is the fit of those pairs, and the
    objective the truncated sum."""
    source, target, _ = many(rng, random_pose, 16)
    result = register(source, target, METHOD, inlier=0.25)
    shares, gaps = result.detail("shares"), np.linalg.norm(result.transform(source) - target, axis=2)
    assert set(np.unique(shares)) == {0.0, 1.0}
    assert np.array_equal(shares == 1.0, gaps <= 0.25)
    assert np.array_equal(result.detail("count"), (gaps <= 0.25).sum(axis=1))
    assert np.allclose(result.detail("residuals"), gaps, atol=1e-12)
    assert np.allclose(result.matrix, fit_rigid(source, target, shares).pose.matrix, atol=1e-12)
    assert np.allclose(result.objective, np.square(np.minimum(gaps, 0.25)).sum(axis=1))


def test_mu_begins_and_grows_as_in_the_paper(rng, random_pose):
    """It starts at c²/(2 r² − c²) for the largest least-squares residual r, and grows by a factor of 1.4 per step; no
    fit raises the surrogate that its weights belong to."""
    source, target, _ = many(rng, random_pose, 16, count=1)
    method = METHODS[METHOD]
    problem = Problem(source, target, np.ones((1, 40)), Pose.identity(2, (1,)), np.array([0]))
    before = advance(begin(method, problem, method.options(inlier=0.3))).state()
    worst = np.linalg.norm(fit_rigid(source, target).pose.apply(source) - target, axis=2).max()
    assert before.mu[0] == pytest.approx(0.09 / (2.0 * worst**2 - 0.09), rel=1e-9)
    batch = begin(method, problem, method.options(inlier=0.3))
    batch = advance(batch)
    while not batch.done:
        batch = advance(batch)
        after = batch.state()
        assert after.mu[0] == pytest.approx(1.4 * before.mu[0])
        value = [surrogate(s.residuals / 0.3, before.mu).sum() for s in (before, after)]
        assert value[1] <= value[0] * (1.0 + 1e-12)
        before = after


def test_weights_count_and_a_weight_of_zero_takes_a_pair_out(rng, random_pose):
    """A pair of weight two counts as that pair twice, one of weight zero not at all, wherever its partner is."""
    source, target, _ = many(rng, random_pose, 12, count=5)
    weights = np.where(np.arange(40) % 3 == 0, 2.0, 1.0)
    clouds = [np.concatenate([cloud, cloud[:, ::3]], axis=1) for cloud in (source, target)]
    a = register(source, target, METHOD, inlier=0.3, weights=weights)
    b = register(*clouds, METHOD, inlier=0.3)
    assert np.allclose(a.matrix, b.matrix, atol=1e-12)
    assert np.allclose(a.objective, b.objective)
    zeros = np.where(np.arange(40) < 5, 0.0, 1.0)
    strays = target.copy()
    strays[:, :5] = 1e9
    c = register(source, strays, METHOD, weights=zeros)
    d = register(source[:, 5:], target[:, 5:], METHOD)
    assert np.allclose(c.matrix, d.matrix, atol=1e-12)
    assert np.array_equal(c.steps, d.steps)
    assert (c.correspondences[:, :5] == -1).all()
    assert np.allclose(c.rmse, d.rmse)


@pytest.mark.parametrize("inlier", [0.3, None])
def test_rows_frames_and_units_change_nothing(inlier, rng, random_pose):
    """With permuted pairs, moved clouds or another unit, the same pairs are kept, and the pose moves along."""
    source, target, _ = many(rng, random_pose, 18, count=6)
    plain = register(source, target, METHOD, inlier=inlier)
    order = rng.permutation(40)
    permuted = register(source[:, order], target[:, order], METHOD, inlier=inlier)
    assert np.array_equal(permuted.detail("shares"), plain.detail("shares")[:, order])
    assert np.allclose(permuted.matrix, plain.matrix, atol=1e-10)
    A, B = random_pose(rng, 2), random_pose(rng, 2)
    moved = register(A.apply(source), B.apply(target), METHOD, inlier=inlier)
    assert np.array_equal(moved.detail("shares"), plain.detail("shares"))
    assert np.allclose(moved.pose.compose(A).matrix, B.compose(plain.pose).matrix, atol=1e-9)
    for unit in (1e-3, 1e6):
        result = register(unit * source, unit * target, METHOD, inlier=inlier and unit * inlier)
        assert np.array_equal(result.status, plain.status)
        assert np.array_equal(result.detail("shares"), plain.detail("shares"))
        assert np.allclose(result.pose.t / unit, plain.pose.t, atol=1e-9)
    without = register(source, target, METHOD)
    radius = np.sqrt(np.square(source - source.mean(axis=1, keepdims=True)).sum(axis=2).mean(axis=1))
    assert np.allclose(without.detail("bound"), 0.05 * radius, rtol=1e-12)


def test_a_batch_gives_what_each_problem_gives_alone(rng, random_pose):
    source, target, _ = many(rng, random_pose, 18, count=8)
    source[3] = 1.0  # a hopeless problem among them
    batch = register(source, target, METHOD, inlier=0.3)
    for i in range(8):
        alone = register(source[i], target[i], METHOD, inlier=0.3)
        assert alone.status == batch.status[i]
        assert alone.steps == batch.steps[i]
        assert np.allclose(alone.matrix, batch.matrix[i], rtol=1e-12, atol=1e-12)
    assert batch.status[3] == Status.DEGENERATE


def test_pairs_that_agree_on_nothing_are_said(rng):
    """With random partners and a bound far below the scatter, what is left determines no pose: this is reported."""
    source, target = rng.uniform(-4.0, 4.0, (10, 30, 2)), rng.uniform(-4.0, 4.0, (10, 30, 2))
    result = register(source, target, METHOD, inlier=1e-3)
    assert np.all(result.status == Status.DEGENERATE)
    assert all("the pairs left within 0.001 u do not determine a pose" in words for words in result.reason)
    single = register([[0.0, 1.0]], [[2.0, 1.0]], METHOD)
    assert single.status is Status.DEGENERATE
    nothing = register(source[0], target[0], METHOD, weights=np.zeros(30))
    assert nothing.status is Status.DEGENERATE
    assert "all weights are zero" in nothing.reason


def test_one_partner_very_far_away_is_let_go(rng, random_pose):
    """A partner at 10⁶ u adds steps, but does not drag the answer along."""
    source, target, truth = many(rng, random_pose, 0, count=4)
    target[:, 0] = 1e6
    result = register(source, target, METHOD, inlier=0.3)
    assert np.all(result.status == Status.CONVERGED)
    assert np.all(result.detail("shares")[:, 0] == 0.0)
    assert np.all(rte(result.pose, truth) < 0.1)


@pytest.mark.parametrize("weightless", [0, 100])
def test_a_stray_in_a_wrong_pair_does_not_set_the_default_bound(weightless, rng, random_pose):
    """Of 60 pairs 15 are wrong. With one source point of a wrong pair 1000 u off the others are kept, though
    rows of zero weight lie close together elsewhere."""
    truth = random_pose(rng, 2)
    source, target = matches(rng, truth, 15, n=60, noise=0.02)
    plain = register(source, target, METHOD)
    assert rte(plain.pose, truth) < 0.05
    source[0] = (1000.0, 0.0)
    far = np.array([300.0, 300.0]) + rng.uniform(-0.1, 0.1, (weightless, 2))
    source, target = np.concatenate([source, far]), np.concatenate([target, far])
    stray = register(source, target, METHOD, weights=np.repeat([1.0, 0.0], [60, weightless]))
    assert stray.detail("bound") == pytest.approx(plain.detail("bound"), rel=0.05)
    assert rte(stray.pose, truth) < 0.05
    assert rre(stray.pose, truth) < np.radians(1.0)


@pytest.mark.parametrize(("option", "value"), [("inlier", 0.0), ("inlier", -1.0), ("factor", 1.0), ("factor", 11.0)])
def test_wrong_options_are_named(option, value):
    with pytest.raises(ValueError, match=rf"^{option}: "):
        register(np.eye(3)[:, :2], np.eye(3)[:, :2], METHOD, **{option: value})
