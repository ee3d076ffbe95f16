"""End poses of many runs: means and modes, redrawn scans, and the spread of starts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose, register
from solvers.scenes.rooms import BIRD, KABSCH_TRUTH
from solvers.scenes.walls import corridor, hall
from solvers.uncertainty import Covariance, covariance, from_matrix, from_starts, log, monte_carlo, quantile, spread_of

START = from_matrix(np.diag([0.03, 0.2, 0.2]) ** 2, Pose.identity())


def test_poses_drawn_from_a_covariance_give_it_back():
    half = np.random.default_rng(1).standard_normal((3, 3)) * 0.05
    truth = from_matrix(half @ half.T, Pose.from_angle(2.0, (3.0, 1.0)), centre=(2.0, 0.0), radius=2.0)
    middle = truth.mean.inverse().apply([[2.0, 0.0]])[0]
    estimate = spread_of(truth.sample(20_000, seed=3)[:3000], centre=middle, radius=2.0, apart=10.0).whole
    np.testing.assert_allclose(estimate.deviations, truth.deviations, rtol=0.06)
    assert truth.distance(estimate.mean) < quantile(0.9999) / 3000


@given(st.floats(-3.0, 3.0), st.floats(-20.0, 20.0))
def test_where_the_target_lies_changes_no_deviation(turn, shift):
    poses = START.sample(20, seed=1)
    first = spread_of(poses, centre=(1.0, 0.0), radius=2.0)
    second = spread_of(Pose.from_angle(turn, (shift, 1.0)).compose(poses), centre=(1.0, 0.0), radius=2.0)
    np.testing.assert_allclose(second.whole.deviations, first.whole.deviations, rtol=1e-5)
    np.testing.assert_array_equal(second.mode, first.mode)


def test_modes_are_what_chains_of_near_poses_connect():
    chain = Pose.from_angle(0.0, np.column_stack([np.linspace(0.0, 3.0, 31), np.zeros(31)]))
    cluster = Pose.from_angle(np.pi, np.column_stack([np.linspace(0.0, 0.3, 4), np.zeros(4)]))
    order = np.random.default_rng(2).permutation(35)
    poses = Pose(np.concatenate([cluster.R, chain.R])[order], np.concatenate([cluster.t, chain.t])[order])
    estimate = spread_of(poses, centre=(0.0, 0.0), radius=2.0, apart=0.15)
    np.testing.assert_array_equal(estimate.mode, (order < 4).astype(int))
    np.testing.assert_allclose(estimate.shares, [31 / 35, 4 / 35])
    assert estimate.modes[0].deviations[0] == pytest.approx(np.std(np.linspace(0.0, 3.0, 31), ddof=1))
    assert len(spread_of(poses, centre=(0.0, 0.0), radius=2.0, apart=100.0).modes) == 1


@pytest.mark.parametrize(("apart", "count"), [(0.99, 2), (1.01, 1)])
def test_two_turns_are_as_far_apart_as_they_take_a_point_at_the_radius(apart, count):
    """A turn by 60° takes it as far as the radius."""
    poses = Pose.from_angle([0.0, np.pi / 3.0])
    assert len(spread_of(poses, centre=(0.0, 0.0), radius=2.0, apart=2.0 * apart).modes) == count


def test_two_modes_half_a_turn_apart_are_told_and_nothing_is_nan():
    """The covariance of all poses is as wide as half a turn; those of the modes are not."""
    poses = Pose.from_angle(np.concatenate([np.linspace(-0.02, 0.02, 10), np.pi + np.linspace(-0.02, 0.02, 10)]))
    estimate = spread_of(poses, centre=(1.0, 0.0), radius=3.0)
    assert len(estimate.modes) == 2
    assert np.isfinite(estimate.whole.matrix).all()
    assert estimate.whole.deviations[0] > 3.0
    assert max(m.deviations[0] for m in estimate.modes) < 0.1


def test_a_mode_of_one_pose_has_no_spread():
    estimate = spread_of(Pose.from_angle([0.0, 0.01, 3.0]), centre=(0.0, 0.0), radius=2.0)
    assert estimate.modes[1].deviations.tolist() == [0.0, 0.0, 0.0]


def test_redrawn_noise_of_known_pairs_gives_the_closed_form():
    rng = np.random.default_rng(4)
    target = KABSCH_TRUTH.apply(BIRD) + 0.05 * rng.standard_normal((3000, *BIRD.shape))
    result = monte_carlo(BIRD, target, "kabsch").whole
    closed = covariance(register(BIRD, KABSCH_TRUTH.apply(BIRD), "kabsch"), sigma=0.05)
    z = result.directions * result.deviations
    excess = (z @ z.T) / closed.deviations[0] ** 2 - np.eye(3)  # isotropic about the centre
    assert np.abs(excess).max() < 5.0 * np.sqrt(2.0 / 3000)


def test_the_hall_has_two_modes_and_the_wrong_one_is_half_a_turn_off():
    scenes = [hall(seed=seed) for seed in range(30)]
    source, target = (np.stack([getattr(s, n) for s in scenes]) for n in ("source", "target"))
    start = Pose.from_angle(np.pi * (np.arange(30) % 3 == 0))
    result = monte_carlo(source, target, "icp", start=start, gate=0.8)
    np.testing.assert_allclose(result.shares, [2 / 3, 1 / 3])
    assert abs(result.modes[1].mean.angle) == pytest.approx(np.pi, abs=0.02)


def test_a_corridor_passes_the_spread_of_the_start_on_and_across_it_does_not():
    scene = corridor()
    result = from_starts(scene.source, scene.target, "icp", start=START, gate=0.8)
    assert result.deviations[0] > 0.1
    assert result.deviations[1] < 0.02
    assert result.made_by == "starts"
    for draws in (50,):
        sample = from_starts(scene.source, scene.target, "icp", start=START, draws=draws, gate=0.8)
        assert sample.deviations[0] == pytest.approx(result.deviations[0], rel=0.4)


def test_a_run_of_no_step_passes_on_the_spread_of_the_starts():
    """Without draws it is the start's own covariance, else the mean square of the poses drawn."""
    p = np.random.default_rng(1).normal(size=(20, 2))
    p -= p.mean(axis=0)
    np.testing.assert_allclose(from_starts(p, p, start=START, max_steps=0).matrix, START.matrix, atol=1e-12)
    for seed in (0, 1):
        twist = log(START.sample(5, seed))
        result = from_starts(p, p, start=START, draws=5, seed=seed, max_steps=0)
        np.testing.assert_allclose(result.matrix, twist.T @ twist / 5.0, atol=1e-12)


def test_no_spread_of_the_start_leaves_the_noise_alone():
    scene = hall()
    exact = from_matrix(np.zeros((3, 3)), Pose.from_angle(0.02))
    run = register(scene.source, scene.target, "point-to-plane", start=exact.mean, gate=0.8)
    noise = covariance(run, "censi", source_noise=0.02, target_noise=0.02)
    result = from_starts(scene.source, scene.target, "point-to-plane", start=exact, noise=noise, gate=0.8)
    np.testing.assert_allclose(result.matrix, noise.matrix, rtol=1e-6, atol=1e-12)


def test_what_the_noise_leaves_free_stays_free():
    scene = corridor(noise=0.0)
    run = register(scene.source, scene.target, "point-to-plane", start=scene.truth, gate=0.4)
    noise = covariance(run, "censi", source_noise=0.02)
    start = from_matrix(np.diag([0.01, 0.02, 0.02]) ** 2, scene.truth)
    result = from_starts(scene.source, scene.target, "point-to-plane", start=start, noise=noise, gate=0.4)
    assert result.free.tolist() == [True, False, False]
    assert not np.isnan(result.matrix).any()


def test_a_free_direction_told_about_another_centre_stays_free():
    """The noise is estimated about the weighted centre of some of the source points, and carried through for all of
    them."""
    scene = corridor(noise=0.0)
    half = (np.arange(len(scene.source)) % 2).astype(float) + (scene.source[:, 0] > 0.0)
    run = register(scene.source, scene.target, "point-to-plane", start=scene.truth, gate=0.4, weights=half)
    noise = covariance(run, "censi", source_noise=0.02)
    start = from_matrix(np.diag([0.01, 0.02, 0.02]) ** 2, scene.truth)
    result = from_starts(scene.source, scene.target, "point-to-plane", start=start, noise=noise, gate=0.4)
    assert np.linalg.norm(result.centre - noise.centre) > 0.1
    assert result.free.tolist() == [True, False, False]
    np.testing.assert_allclose(result.directions[:, 0], noise.directions[:, 0], atol=1e-9)


def test_what_is_refused():
    with pytest.raises(ValueError, match="poses"):
        spread_of(Pose.identity(batch=(1,)), centre=(0.0, 0.0), radius=1.0)
    with pytest.raises(ValueError, match="radius"):
        spread_of(Pose.identity(batch=(3,)), centre=(0.0, 0.0), radius=0.0)
    with pytest.raises(ValueError, match=r"^poses: .*motions of the plane"):
        spread_of(Pose.identity(3, batch=(3,)), centre=(0.0, 0.0), radius=1.0)
    with pytest.raises(ValueError, match=r"^poses.scale: expected rigid motions, of scale 1"):
        spread_of(Pose.from_angle(np.zeros(3), scale=2.0), centre=(0.0, 0.0), radius=1.0)
    scene = hall()
    for call, further in ((monte_carlo, {}), (from_starts, {"start": START})):
        with pytest.raises(ValueError, match=r"^method: 'cpd-similarity' finds a scale"):
            call(scene.source, scene.target, "cpd-similarity", **further)
    with pytest.raises(ValueError, match="one pair"):
        from_starts(scene.source[None], scene.target, start=START)
    for wrong in (Pose.identity(), np.eye(3), None):
        message = f"expected a Covariance, got {type(wrong).__name__}; solvers.uncertainty.from_matrix makes one"
        with pytest.raises(ValueError, match=f"^start: {message}"):
            from_starts(scene.source, scene.target, start=wrong)
        if wrong is not None:
            with pytest.raises(ValueError, match=f"^noise: {message}"):
                from_starts(scene.source, scene.target, start=START, noise=wrong)
    two = from_matrix(np.stack([1e-4 * np.eye(3)] * 2), Pose.identity(batch=(2,)))
    with pytest.raises(ValueError, match=r"^noise: expected one covariance, got a batch of shape \(2,\)"):
        from_starts(scene.source, scene.target, start=START, noise=two)
    for centre, text in (("x", "expected real numbers"), ((0.0, np.nan), "1 of 2 numbers is"), (0.0, "expected shape")):
        with pytest.raises(ValueError, match=f"^centre: {text}"):
            spread_of(Pose.identity(batch=(3,)), centre=centre, radius=1.0)


@pytest.mark.parametrize("draws", [0, 5])
@pytest.mark.parametrize("seed", ["a", -1, 1.5, None])
def test_what_is_no_seed_is_refused_whether_it_is_used_or_not(draws: int, seed: object) -> None:
    scene = hall(seed=1)
    with pytest.raises(ValueError, match=r"^seed: "):
        from_starts(scene.source, scene.target, start=START, draws=draws, seed=seed)  # type: ignore[arg-type]


@pytest.mark.parametrize(("unit", "origin"), [(1.0, (0.0, 0.0)), (1.0, (5e5, 5e6)), (1e-9, (0.0, 0.0))])
def test_a_noise_about_another_centre_is_carried_there_in_any_unit(unit, origin):
    """A turn of 0.01 rad about a point 2 u away is a deviation of 0.02 u here, wherever the origin is."""
    rng = np.random.default_rng(1)
    p = unit * (rng.normal(size=(60, 2)) + origin)
    centre = p.mean(axis=0)
    radius = float(np.sqrt(np.square(p - centre).sum(axis=1).mean()))
    mean = Pose.identity()
    start = from_matrix(np.zeros((3, 3)), mean, centre=centre, radius=radius)
    noise = Covariance(
        mean, np.array([0.01 * radius, 0.0, 0.0]), np.eye(3), centre + np.array([2.0 * unit, 0.0]), np.array(radius),
        "target", "given",
    )  # fmt: skip
    result = from_starts(p, p, "icp", start=start, noise=noise)
    assert result.point_covariance(centre)[1, 1] ** 0.5 == pytest.approx(0.02 * unit, rel=1e-3)


def test_the_mean_of_all_does_not_depend_on_their_order():
    """Two clusters half a turn apart."""
    angle = np.concatenate([np.linspace(-0.3, 0.3, 12), np.pi + np.linspace(-0.3, 0.3, 5)])
    t = np.column_stack([np.linspace(0.0, 0.3, 17), np.zeros(17)])
    first, second = (
        spread_of(Pose.from_angle(angle[order], t[order]), centre=(1.0, 0.0), radius=3.0)
        for order in (np.arange(17), np.arange(17)[::-1])
    )
    assert len(first.modes) == 2
    np.testing.assert_allclose(first.whole.mean.matrix, second.whole.mean.matrix, atol=1e-6)


def test_a_point_without_weight_moves_no_centre():
    """This holds wherever the point is."""
    rng = np.random.default_rng(4)
    source = rng.standard_normal((30, 2))
    target = source + 0.01 * rng.standard_normal((40, 30, 2))
    weights, stray = np.ones(30), source.copy()
    weights[0], stray[0] = 0.0, (500.0, 300.0)
    first, second = (monte_carlo(cloud, target, "kabsch", weights=weights) for cloud in (source, stray))
    np.testing.assert_allclose(second.whole.centre, first.whole.centre, atol=1e-9)
    assert second.whole.radius == pytest.approx(float(first.whole.radius))


@pytest.mark.parametrize("count", [10, 30])
def test_the_centre_of_pairs_is_that_of_the_paired_points(count):
    """Weights are then those of the pairs, not of the source's rows."""
    rng = np.random.default_rng(4)
    source = rng.standard_normal((30, 2))
    pairs, weights = np.repeat(np.arange(29, 29 - count, -1)[:, None], 2, axis=1), np.ones(count)
    weights[: count // 2] = 0.0
    weighed = source[pairs[count // 2 :, 0]].mean(axis=0)
    target = source + 0.01 * rng.standard_normal((5, 30, 2))
    spread = monte_carlo(source, target, "kabsch", pairs=pairs, weights=weights).whole
    np.testing.assert_allclose(spread.centre, spread.mean.apply(weighed[None])[0], atol=1e-12)
    offsets = source[pairs[count // 2 :, 0]] - weighed
    assert float(spread.radius) == pytest.approx(np.sqrt(np.square(offsets).sum(axis=1).mean()))
    ends = from_starts(source, target[0], "kabsch", start=START, pairs=pairs, weights=weights)
    np.testing.assert_allclose(ends.centre, ends.mean.apply(weighed[None])[0], atol=1e-12)


def test_a_spread_takes_two_draws_and_the_message_says_of_what():
    scene = hall()
    for source, start in ((scene.source, None), (scene.source[None], None), (scene.source, Pose.identity(2, (2, 2)))):
        with pytest.raises(ValueError, match=r"^source, target: expected two or more draws of either, in one row"):
            monte_carlo(source, scene.target, start=start)
    assert monte_carlo(scene.source, np.stack([scene.target] * 2)).poses.batch == (2,)


def test_draws_of_unequal_size_are_a_list():
    """The spread is about the centre of the first source's weighted points."""
    scenes = [hall(seed=seed) for seed in range(4)]
    source, target = [s.source[: 90 - k] for k, s in enumerate(scenes)], [s.target[k:] for k, s in enumerate(scenes)]
    result = monte_carlo(source, target, gate=0.8)
    for k in range(4):
        assert result.poses[k] == register(source[k], target[k], gate=0.8).pose
    middle = result.whole.mean.apply(source[0].mean(axis=0)[None])[0]
    np.testing.assert_allclose(result.whole.centre, middle, atol=1e-12)
    half = np.arange(90) % 2
    weighted = monte_carlo(source, target, gate=0.8, weights=[half, None, None, None]).whole
    middle = weighted.mean.apply(source[0][1::2].mean(axis=0)[None])[0]
    np.testing.assert_allclose(weighted.centre, middle, atol=1e-12)
    assert monte_carlo(source, scenes[0].target, gate=0.8, weights=[None] * 4).poses.batch == (4,)
    assert monte_carlo(scenes[0].source, target, gate=0.8).poses.batch == (4,)
