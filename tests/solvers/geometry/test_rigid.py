"""The closed-form fits against identities, without any stored reference values."""

import numpy as np
import pytest

from solvers import Pose, Status, fit_planar, fit_rigid
from solvers.geometry.rigid import best_rotation, pair_cost
from solvers.metrics import rre, rte, scale_error

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def fits(d):
    return [fit_rigid, fit_planar] if d == 2 else [fit_rigid]


def noisy_pairs(rng, random_pose, d, batch=(), n=12, sigma=0.3):
    source = 2.0 * rng.standard_normal((*batch, n, d))
    truth = random_pose(rng, d, batch)
    target = truth.apply(source) + sigma * rng.standard_normal((*batch, n, d))
    return source, target, rng.uniform(0.1, 2.0, (*batch, n)), truth


def proper(pose):
    d = pose.dim
    orthogonal = np.abs(pose.R @ pose.R.swapaxes(-1, -2) - np.eye(d)).max() < 1e-13
    return orthogonal and bool(np.all(np.abs(np.linalg.det(pose.R) - 1.0) < 1e-13))


@pytest.mark.parametrize("scale", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_a_known_motion_is_found_to_rounding(d, scale, rng, random_pose):
    """Exact pairs return the exact rotation, translation and scale, for 200 random motions of any size."""
    truth = random_pose(rng, d, (200,), scaled=scale)
    source = rng.standard_normal((200, 8, d))
    for fit in fits(d):
        result = fit(source, truth.apply(source), scale=scale)
        assert np.all(result.status == Status.CONVERGED)
        assert np.max(rre(result.pose, truth)) < 1e-13
        assert np.max(rte(result.pose, truth)) < 1e-13 * 10
        assert np.max(scale_error(result.pose, truth)) < 1e-14 * 10
        assert np.max(result.cost) < 1e-26


@pytest.mark.parametrize("d", [2, 3, 5])
def test_the_answer_is_always_a_proper_rotation(d, rng):
    """Even for target points that have nothing to do with the source, det R = +1."""
    fit = fit_rigid(rng.standard_normal((300, 6, d)), rng.standard_normal((300, 6, d)))
    assert proper(fit.pose)
    assert {-1, 1} <= set(fit.determinant.tolist())


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("scale", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_no_nearby_pose_fits_better(d, scale, mirrored, rng, random_pose):
    """Random small changes of the pose, from 10⁻⁷ to 1 in size, never lower the weighted sum of squares."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, d)
    if mirrored:
        # Squeezed along the mirrored axis, so that a rotation still fits well and the best scale is not near zero.
        target = target * np.r_[-0.4, np.ones(d - 1)]
        source = source * np.r_[np.ones(d - 1), 0.7]
    best = fit_rigid(source, target, weights, scale=scale)
    for size in np.logspace(-7, 0, 15):
        for _ in range(20):
            generator = np.zeros((d, d))
            generator[np.triu_indices(d, 1)] = size * rng.standard_normal(d * (d - 1) // 2)
            # Cayley's map turns a skew matrix into a rotation near the identity.
            skew = generator - generator.T
            turn = np.linalg.solve(np.eye(d) + skew, np.eye(d) - skew)
            s = np.asarray(best.pose.scale) * (np.exp(size * rng.standard_normal()) if scale else 1.0)
            pose = Pose(turn @ best.pose.R, best.pose.t + size * rng.standard_normal(d), s)
            assert pair_cost(pose, source, target, weights) >= best.cost * (1.0 - 1e-12)


def test_no_angle_at_all_fits_better_in_the_plane(rng, random_pose):
    """The optimum is at least as good as any of 3600 angles round the circle, each with its own best translation."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, 2, sigma=2.0)
    share = weights / weights.sum()
    rotations = Pose.from_angle(np.linspace(-np.pi, np.pi, 3600))
    best_shift = share @ target - share @ rotations.apply(source)
    poses = Pose(rotations.R, best_shift)
    assert pair_cost(poses, source, target, weights).min() >= fit_rigid(source, target, weights).cost * (1 - 1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_the_first_order_conditions_hold(d, rng, random_pose):
    """At the optimum the weighted residuals sum to zero, R H is symmetric, and the scale's derivative vanishes."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, d)
    for scale in (False, True):
        pose = fit_rigid(source, target, weights, scale=scale).pose
        residuals = pose.apply(source) - target
        assert np.abs(weights @ residuals).max() < 1e-12
        share = weights / weights.sum()
        p, q = source - share @ source, target - share @ target
        RH = pose.R @ (p.T @ (weights[:, None] * q))
        assert np.abs(RH - RH.T).max() < 1e-12
        if scale:
            assert abs(weights @ ((p @ pose.R.T) * residuals).sum(axis=1)) < 1e-12


@pytest.mark.parametrize("scale", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_moving_either_cloud_moves_the_answer_along(d, scale, rng, random_pose):
    """If the source is moved by A and the target by B, the optimum becomes B ∘ T ∘ A⁻¹, whatever origin or start."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, d)
    T = fit_rigid(source, target, weights, scale=scale).pose
    A, B = random_pose(rng, d, scaled=scale), random_pose(rng, d, scaled=scale)
    moved = fit_rigid(A.apply(source), B.apply(target), weights, scale=scale).pose
    assert np.allclose(moved.matrix, B.compose(T).compose(A.inverse()).matrix, atol=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_the_order_of_the_pairs_does_not_matter(d, rng, random_pose):
    """Shuffling the pairs leaves the optimum where it was."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, d)
    order = rng.permutation(len(source))
    a, b = fit_rigid(source, target, weights), fit_rigid(source[order], target[order], weights[order])
    assert np.allclose(a.pose.matrix, b.pose.matrix, atol=1e-13)


@pytest.mark.parametrize("d", [2, 3])
def test_a_weight_of_two_is_the_pair_twice(d, rng, random_pose):
    """Doubling a weight equals repeating the pair; a weight of zero equals leaving it out; a common factor is free."""
    source, target, _, _ = noisy_pairs(rng, random_pose, d)
    weights = np.array([2.0, 0.0] + [1.0] * 10)
    keep = np.r_[0, 0, 2:12]
    for fit in fits(d):
        weighted = fit(source, target, weights)
        repeated = fit(source[keep], target[keep])
        assert np.allclose(weighted.pose.matrix, repeated.pose.matrix, atol=1e-13)
        assert weighted.cost == pytest.approx(repeated.cost, rel=1e-12)
        assert np.allclose(fit(source, target, 1e-40 * weights).pose.matrix, weighted.pose.matrix, atol=1e-13)


def test_a_pair_without_weight_counts_for_nothing_however_far_it_lies(rng, random_pose):
    source, target, _, _ = noisy_pairs(rng, random_pose, 2)
    far_source, far_target = source.copy(), target.copy()
    far_source[0], far_target[0] = 1e140, -1e140
    weights = np.r_[0.0, np.ones(11)]
    a, b = fit_rigid(far_source, far_target, weights), fit_rigid(source[1:], target[1:])
    assert np.allclose(a.pose.matrix, b.pose.matrix, atol=1e-13)
    assert a.cost == pytest.approx(b.cost, rel=1e-12)
    # So far away that its coordinates overflow in units of the small cloud that does count.
    a = fit_rigid(1e-200 * source + np.r_[1e149, np.zeros(11)][:, None], 1e-200 * target, weights)
    assert a.status == Status.CONVERGED
    assert rre(a.pose, b.pose) < 1e-13


def test_the_planar_formula_and_the_singular_values_agree(rng):
    """The two closed forms agree to within 10⁻¹⁴ ‖H‖ / hypot(S, C), even if the angle is nearly undefined."""
    for lean in np.logspace(0, -12, 25):
        source = rng.standard_normal((50, 10, 2))
        source -= source.mean(axis=1, keepdims=True)
        # Subtract from a mirror image what it shares with a rotation, so both sums vanish. A little of a true rotation
        # then keeps the angle barely defined.
        across = source @ np.array([[0.0, 1.0], [-1.0, 0.0]])
        target = source * [1.0, -1.0]
        for part in (source, across):
            target = target - (np.sum(part * target, (1, 2)) / np.sum(part**2, (1, 2)))[:, None, None] * part
        target = target + lean * Pose.from_angle(rng.uniform(-np.pi, np.pi, 50)).apply(source)
        a, b = fit_rigid(source, target), fit_planar(source, target)
        p, q = source - source.mean(axis=1, keepdims=True), target - target.mean(axis=1, keepdims=True)
        H = p.swapaxes(1, 2) @ q
        size = np.linalg.norm(H, axis=(1, 2))
        sums = np.hypot(H[:, 0, 1] - H[:, 1, 0], H[:, 0, 0] + H[:, 1, 1])
        valid = (a.status == Status.CONVERGED) & (b.status == Status.CONVERGED)
        assert valid.all()
        assert np.all(rre(a.pose, b.pose) <= 1e-14 * size / sums)
        assert np.allclose(a.singular_values, b.singular_values, rtol=1e-12, atol=1e-13)
        assert np.array_equal(a.determinant, b.determinant)
        assert np.allclose(a.condition, b.condition, rtol=1e-2)
        assert lean > 0.01 or np.all(sums < 10 * lean * size)


@pytest.mark.parametrize("d", [2, 3])
def test_a_mirrored_cloud_is_where_the_determinant_matters(d, rng):
    """For a mirror image the best orthogonal matrix is the reflection, with zero error; the correction D gives the best
    rotation instead, which must leave some error."""
    source = rng.standard_normal((9, d))
    target = source * np.r_[-1.0, np.ones(d - 1)]
    free, fit = fit_rigid(source, target, proper=False), fit_rigid(source, target)
    assert free.determinant == fit.determinant == -1
    assert np.linalg.det(free.pose.R) == pytest.approx(-1.0)
    assert free.cost < 1e-26
    assert np.linalg.det(fit.pose.R) == pytest.approx(1.0)
    assert fit.cost > 1e-3
    # The extra cost of flipping the smallest singular value's sign is 4 λ_d.
    assert fit.cost - free.cost == pytest.approx(4.0 * fit.singular_values[-1], rel=1e-12)


def test_without_a_reflection_the_determinant_changes_nothing(rng, random_pose):
    """If det(V Uᵀ) = +1, the constrained and the unconstrained optimum are the same."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, 3, sigma=0.05)
    a, b = fit_rigid(source, target, weights), fit_rigid(source, target, weights, proper=False)
    assert a.determinant == 1
    assert np.array_equal(a.pose.R, b.pose.R)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("short_of", [0.0, 1e-12, 1e-8, 1e-3])
def test_half_turns_are_found(d, short_of, rng):
    """Rotations at and near 180°, where the angle's sign flips, are recovered like any other."""
    c, s = np.cos(np.pi - short_of), np.sin(np.pi - short_of)
    R = np.eye(d)
    R[:2, :2] = [[c, -s], [s, c]]
    truth = Pose(R, np.arange(1.0, d + 1.0))
    source = rng.standard_normal((10, d))
    for fit in fits(d):
        assert rre(fit(source, truth.apply(source)).pose, truth) < 1e-14 * 10


@pytest.mark.parametrize("scale", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_a_batch_equals_its_problems_one_by_one(d, scale, rng, random_pose):
    """Solving 40 problems at once gives what solving each alone gives, to 10⁻¹² relative."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, d, (8, 5))
    for fit in fits(d):
        batch = fit(source, target, weights, scale=scale)
        assert batch.pose.batch == batch.status.shape == batch.cost.shape == (8, 5)
        for i in np.ndindex(8, 5):
            alone = fit(source[i], target[i], weights[i], scale=scale)
            assert np.allclose(batch.pose[i].matrix, alone.pose.matrix, rtol=1e-12, atol=1e-12)
            assert batch.cost[i] == pytest.approx(alone.cost, rel=1e-12)


def test_the_similarity_scale_is_umeyamas(rng, random_pose):
    """With noise the scale is tr(Λ D) / Σ w ‖p̃‖²; fitting backwards gives less than its inverse."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, 3, sigma=0.5)
    fit = fit_rigid(source, target, weights, scale=True)
    p = source - (weights / weights.sum()) @ source
    assert fit.pose.scale == pytest.approx(fit.singular_values.sum() / (weights @ (p**2).sum(axis=1)), rel=1e-12)
    mirror = fit_rigid(source, -target, weights, scale=True)
    assert (fit.determinant, mirror.determinant) == (1, -1)
    # −target has the same singular values; D flips the smallest one's sign, which shrinks the scale.
    trace = mirror.singular_values @ [1.0, 1.0, -1.0]
    assert mirror.pose.scale == pytest.approx(trace / (weights @ (p**2).sum(axis=1)), rel=1e-12)
    inverse = fit_rigid(target, source, weights, scale=True)
    assert float(fit.pose.scale) * float(inverse.pose.scale) < 1.0 - 1e-3
    rigid = fit_rigid(source, target, weights)
    assert np.allclose(rigid.pose.R, fit.pose.R, atol=1e-12)
    assert fit.cost < rigid.cost


def test_a_single_fit_has_a_status_and_a_batch_one_each():
    """As in a result: equal to its name, and true if the pairs determine the pose."""
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    for fit in (fit_rigid, fit_planar):
        good, failure, batch = (fit(p, corner) for p in (corner, np.ones((3, 2)), np.stack([corner, np.ones((3, 2))])))
        assert good.status is Status.CONVERGED
        assert failure.status is Status.DEGENERATE
        assert (good.ended, failure.ended) == (True, False)
        assert batch.status.dtype == np.int8
        assert batch.ended.tolist() == [True, False]


def test_a_residual_is_normal_and_the_optimum_is_not_the_truth(rng, random_pose):
    """With noise the optimum fits the pairs better than the true motion does, and differs from it."""
    source, target, _, truth = noisy_pairs(rng, random_pose, 2, (100,), sigma=0.2)
    fit = fit_rigid(source, target)
    assert np.all(fit.cost < pair_cost(truth, source, target, np.ones(12)))
    assert np.all(fit.cost > 0.0)
    assert np.all(rre(fit.pose, truth) > 0.0)


def test_one_far_pair_can_carry_the_translation_as_far_as_it_likes(rng, random_pose):
    """Least squares has breakdown point zero: the farther one wrong partner is, the farther the answer goes."""
    source, target, _, truth = noisy_pairs(rng, random_pose, 2, sigma=0.0)
    errors = []
    for distance in (1e1, 1e3, 1e5):
        wrong = target.copy()
        wrong[0] += distance
        pose = fit_rigid(source, wrong).pose
        errors.append(float(np.linalg.norm(pose.apply(source).mean(0) - truth.apply(source).mean(0))))
    assert errors[1] > 50 * errors[0]
    assert errors[2] > 50 * errors[1]


@pytest.mark.parametrize("exponent", [-300, -150, -20, 20, 100, 149])
@pytest.mark.parametrize("d", [2, 3])
def test_the_unit_of_length_does_not_matter(d, exponent, rng, random_pose):
    """The same clouds in units of 10⁻³⁰⁰ to 10¹⁴⁹ give the same rotation: no square overflows or underflows."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, d)
    unit = 10.0**exponent / 10.0
    for fit in fits(d):
        a, b = fit(source, target, weights), fit(unit * source, unit * target, weights)
        assert b.status == Status.CONVERGED
        assert rre(a.pose, b.pose) < 1e-13
        assert np.allclose(b.pose.t / unit, a.pose.t, rtol=1e-9)


def test_far_from_the_origin_only_the_coordinates_own_rounding_is_lost(rng, random_pose):
    """Clouds 10⁶ u from the origin lose about six digits of the angle, as their coordinates do, and no more."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, 2)
    a, b = fit_rigid(source, target, weights), fit_rigid(source + 1e6, target - 1e6, weights)
    assert rre(a.pose, b.pose) < 1e-9


def test_a_cloud_that_is_tiny_for_its_distance_still_turns(rng, random_pose):
    """A thousand-millionth as wide as it is far away, it keeps seven digits of its shape, and so of the angle; where
    rounding leaves no shape, the fit says so."""
    source, target, weights, _ = noisy_pairs(rng, random_pose, 2)
    a = fit_rigid(source, target, weights)
    b = fit_rigid(1e-9 * source + [1.0, 0.5], 1e-9 * target + [-0.5, 1.0], weights)
    assert b.status == Status.CONVERGED
    assert rre(a.pose, b.pose) < 1e-6
    assert fit_rigid(1e-18 * source + [1.0, 0.5], target, weights).status == Status.DEGENERATE


def test_the_condition_says_how_much_an_error_is_magnified(rng):
    """Changing H a little turns the answer by at most the relative change times the condition, in the plane."""
    source = rng.standard_normal((10, 2))
    image = source * [1.0, -1.0]
    for lean in (1.0, 0.1, 0.01):
        target = image + lean * source
        fit = fit_rigid(source, target)
        nudge = 1e-9 * rng.standard_normal((10, 2))
        p = source - source.mean(0)
        change = np.linalg.norm(p.T @ (nudge - nudge.mean(0)))
        size = np.linalg.norm(fit.singular_values)
        angle = rre(fit_rigid(source, target + nudge).pose, fit.pose)
        assert angle <= 1.5 * fit.condition * change / size + 1e-15


def test_the_clouds_handed_in_are_not_changed(rng):
    source, target, weights = rng.standard_normal((5, 2)), rng.standard_normal((5, 2)), np.ones(5)
    before = source.copy(), target.copy(), weights.copy()
    fit_rigid(source, target, weights, scale=True)
    fit_planar(source, target, weights, scale=True)
    assert all(np.array_equal(a, b) for a, b in zip(before, (source, target, weights), strict=True))


@pytest.mark.native
@pytest.mark.parametrize("seed", range(20))
def test_scipy_finds_the_same_rotation(seed, random_pose):
    """SciPy's `Rotation.align_vectors` agrees in space, weighted, to 10⁻¹² rad, and on the sum of squares."""
    transform = pytest.importorskip("scipy.spatial.transform")
    rng = np.random.default_rng(seed)
    source, target, weights, _ = noisy_pairs(rng, random_pose, 3, sigma=1.0)
    fit = fit_rigid(source, target, weights)
    share = weights / weights.sum()
    p, q = source - share @ source, target - share @ target
    rotation, rssd = transform.Rotation.align_vectors(q, p, weights=weights)
    assert rre(fit.pose, Pose(rotation.as_matrix(), np.zeros(3))) < 1e-12
    assert fit.cost == pytest.approx(rssd**2, rel=1e-9)


def test_the_best_rotation_in_space_is_never_a_reflection() -> None:
    """Even if the best orthogonal matrix is one: the trace is then lower by twice the smallest singular value."""
    rng = np.random.default_rng(5)
    H = rng.standard_normal((200, 3, 3))
    R, trace, gap = best_rotation(H)
    values = np.linalg.svd(H, compute_uv=False)
    sign = np.sign(np.linalg.det(H))
    assert {-1.0, 1.0} == set(sign)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-12)
    np.testing.assert_allclose(R @ R.swapaxes(1, 2), np.broadcast_to(np.eye(3), H.shape), atol=1e-12)
    np.testing.assert_allclose(np.trace(R @ H, axis1=1, axis2=2), trace, atol=1e-12)
    np.testing.assert_allclose(trace, values[:, 0] + values[:, 1] + sign * values[:, 2], atol=1e-12)
    np.testing.assert_allclose(gap, values[:, 1] + sign * values[:, 2], atol=1e-12)


@pytest.mark.parametrize("wrong", ["no", 2.0, 1, None])
def test_what_is_neither_true_nor_false_chooses_nothing(wrong):
    for fit, name in ((fit_rigid, "scale"), (fit_rigid, "proper"), (fit_planar, "scale")):
        with pytest.raises(ValueError, match=f"^{name}: expected True or False"):
            fit(np.eye(2), np.eye(2), **{name: wrong})
