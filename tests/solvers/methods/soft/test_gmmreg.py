"""GMMReg: the L2 distance against integration, its equality to a kernel MMD, derivatives, and the course of a run."""

from itertools import pairwise

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, metrics, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.soft.gmmreg import GmmRegOptions, moved_by
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def problem(source, target, start=None):
    pose = Pose.identity(2, (1,)) if start is None else Pose(start.R[None], start.t[None])
    return Problem(source[None], target[None], np.ones((1, len(source))), pose, np.zeros(1, dtype=np.int64))


def state_at(source, target, pose, sigma):
    return begin(METHODS["gmmreg"], problem(source, target, pose), GmmRegOptions(first=sigma, last=0.01)).state()


def density(points, places, sigma):
    """A mixture of equal isotropic Gaussians centred at `points`, evaluated at `places`."""
    squares = np.square(places[:, None] - points).sum(axis=2)
    return np.exp(-squares / (2.0 * sigma**2)).mean(axis=1) / (2.0 * np.pi * sigma**2)


def gaussian_mmd2(x, y, length):
    """MMD² of two clouds: the exact pairwise V-statistic, diagonal included, for a Gaussian kernel of length ℓ."""

    def mean_kernel(a, b):
        return np.exp(-np.square(a[:, None] - b).sum(axis=2) / (2.0 * length**2)).mean()

    return mean_kernel(x, x) - 2.0 * mean_kernel(x, y) + mean_kernel(y, y)


def test_the_objective_is_the_integral_of_the_squared_difference(rng):
    """∫ (f − g)² by a fine sum over the plane, which for Gaussians is exact up to rounding."""
    source, target, sigma = rng.standard_normal((6, 2)), rng.standard_normal((9, 2)), 0.4
    pose = Pose.from_angle(0.7, (0.3, -0.2))
    axis = np.arange(-7.0, 7.0, 0.1)
    places = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    difference = density(pose.apply(source), places, sigma) - density(target, places, sigma)
    result = state_at(source, target, pose, sigma).objective[0]
    assert result == pytest.approx(np.square(difference).sum() * 0.01, rel=1e-9)


@pytest.mark.parametrize("sigma", [0.1, 0.5, 2.0])
def test_it_is_a_gaussian_kernel_mmd(rng, sigma):
    """The L2 distance is MMD² with ℓ = √2 σ, times (4πσ²)^(−d/2), for uniform weights and one component per point."""
    source, target = rng.standard_normal((20, 2)), rng.standard_normal((30, 2)) + 0.5
    pose = Pose.from_angle(-2.0, (0.3, 0.4))
    result = state_at(source, target, pose, sigma).objective[0]
    expected = gaussian_mmd2(pose.apply(source), target, np.sqrt(2.0) * sigma) / (4.0 * np.pi * sigma**2)
    assert result == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("sigma", [0.2, 1.0])
@pytest.mark.parametrize("shift", [0.0, 100.0])
def test_derivatives_against_finite_differences(rng, sigma, shift):
    """Gradient and Hessian in (v, ρω) against central differences of the objective, even far from the origin."""
    source, target = rng.standard_normal((15, 2)) + shift, rng.standard_normal((20, 2)) + shift
    at = Pose.from_angle(0.3).R
    pose = Pose(at, source.mean(axis=0) - at @ source.mean(axis=0) + [0.2, -0.1])
    state = state_at(source, target, pose, sigma)
    factor = 2.0 / (4.0 * np.pi * sigma**2)  # E = const − 2 k_xy / MN, times the leading factor

    def at_xi(xi):
        neighbour = moved_by(state, np.array([xi]))
        return state_at(source, target, neighbour[0], sigma)

    h = 1e-4 * sigma
    for k in range(3):
        e = h * np.eye(3)[k]
        slope = (at_xi(e).objective[0] - at_xi(-e).objective[0]) / (2.0 * h)
        scale = np.abs(state.gradient).max() * factor
        assert factor * state.gradient[0, k] == pytest.approx(slope, abs=1e-6 * scale)
        for j in range(k, 3):
            f = h * np.eye(3)[j]
            values = [at_xi(a * e + b * f).objective[0] for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
            bend = (values[0] - values[1] - values[2] + values[3]) / (4.0 * h * h)
            scale = np.abs(state.hessian).max() * factor
            assert factor * state.hessian[0, k, j] == pytest.approx(bend, abs=2e-5 * scale)


def test_within_a_stage_it_never_rises(rng, random_pose):
    """No step at one σ raises the objective, on 40 random scenes from far starts."""
    source = rng.standard_normal((40, 15, 2)) * [2.0, 1.0]
    target = random_pose(rng, 2, (40,)).apply(source[:, :12]) + 0.1 * rng.standard_normal((40, 12, 2))
    steps = []
    register(
        source, target, "gmmreg", start=random_pose(rng, 2, (40,)),
        callback=lambda k, state: steps.append((state.sigma.copy(), state.objective.copy())),
    )  # fmt: skip
    count = 0
    for (sigma, before), (next_sigma, after) in pairwise(steps):
        stage = sigma == next_sigma
        assert np.all(after[stage] <= before[stage])
        count += np.count_nonzero(stage)
    assert count > 100


def test_the_width_is_annealed_in_stages():
    s = room("clean")
    widths = []
    register(
        s.source, s.target, "gmmreg", first=1.2, last=0.2, start=room_start(),
        callback=lambda k, state: widths.append(state.sigma[0]),
    )  # fmt: skip
    np.testing.assert_allclose(sorted(set(widths), reverse=True), [1.2, 0.6, 0.3, 0.2])
    assert np.all(np.diff(widths) <= 0.0)


@pytest.mark.parametrize("degrees", [-160.0, 90.0])
def test_large_motions_are_found_from_near_them(degrees):
    s = room("clean")
    truth = Pose.from_angle(np.radians(degrees), (4.0, -3.0))
    start = Pose.from_angle(np.radians(degrees + 25.0), (3.6, -2.7))
    result = register(s.source, truth.apply(s.target), "gmmreg", start=start)
    assert result.status == Status.CONVERGED
    assert metrics.rre(result.pose, truth) < np.radians(0.5)
    assert metrics.point_error(result.pose, truth, s.source) < 0.05


def test_equal_clouds_have_no_distance(rng):
    points = rng.standard_normal((25, 2))
    result = register(points, points, "gmmreg", start=Pose.from_angle(0.2, (0.1, 0.1)))
    np.testing.assert_allclose(result.matrix, np.eye(3), atol=1e-7)
    assert 0.0 <= result.objective < 1e-12


def test_a_batch_is_its_single_runs():
    scenes = [room("combo", seed=seed) for seed in SEEDS[:5]]
    source, target = np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])
    batch = register(source, target, "gmmreg", start=room_start())
    for k in range(5):
        alone = register(source[k], target[k], "gmmreg", start=room_start())
        assert alone.steps == batch.steps[k]
        # Older numpy versions sum a batch in another order, and the steps amplify that.
        np.testing.assert_allclose(batch.matrix[k], alone.matrix, rtol=0.0, atol=1e-9)


def test_units_and_origin_do_not_matter():
    s = room("outliers")
    plain = register(s.source, s.target, "gmmreg", start=room_start(30.0, 0.5))
    shift = np.array([300.0, -200.0])
    start = Pose(room_start(30.0).R, 1e3 * room_start(30.0, 0.5).t + shift - room_start(30.0).R @ shift)
    big = register(1e3 * s.source + shift, 1e3 * s.target + shift, "gmmreg", start=start)
    np.testing.assert_allclose(big.pose.R, plain.pose.R, atol=1e-7)
    moved = 1e3 * plain.transform(s.source) + shift
    np.testing.assert_allclose(big.transform(1e3 * s.source + shift), moved, rtol=1e-5)


def test_no_overlap_is_said():
    s = room("clean")
    failure = register(s.source, s.target + 1000.0, "gmmreg", first=0.5, last=0.1)
    assert failure.status == Status.DEGENERATE
    assert "no kernel reaches" in failure.reason
    assert failure.steps == 0


@pytest.mark.parametrize("distance", [50.0, 1e3, 1e4])
@pytest.mark.parametrize("cloud", ["source", "target"])
def test_points_beyond_all_kernels_are_passed_over(cloud, distance):
    """They count for nothing, not even for the centre and radius of a step: the run is the same as without them."""
    scene, start = room("clean"), room_start(5.0, 0.3)
    clouds = {"source": scene.source, "target": scene.target}
    far = {**clouds, cloud: np.vstack([clouds[cloud], distance * np.array([[1.0, -1.0], [1.0, -1.1], [1.2, -1.0]])])}
    usual, beside = (register(**pair, method="gmmreg", start=start) for pair in (clouds, far))
    assert usual.status is beside.status is Status.CONVERGED
    assert usual.steps == beside.steps
    assert np.allclose(beside.matrix, usual.matrix, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_clouds_that_are_one_point_leave_the_rotation_undefined(unit):
    """A single point, or equal ones, in either cloud: degenerate with a reason, once the translation is found; the rest
    of the batch goes on."""
    s = room("clean")
    for source, target, name in (
        ([[1.0, 2.0]], s.target, "source"), (np.full((4, 2), 0.1), s.target, "source"),
        (s.source, [[0.1, 0.2]], "target"), (s.source, np.full((5, 2), 0.3), "target"),
    ):  # fmt: skip
        source, target = unit * np.asarray(source), unit * np.asarray(target)
        result = register(source, target, "gmmreg")
        assert result.status == Status.DEGENERATE
        assert result.reason == f"all {name} points are equal: the rotation is undefined"
        assert result.steps > 0
        assert np.isfinite(result.matrix).all()
    onto = register(np.full((4, 2), 0.1), np.full((3, 2), 0.6), "gmmreg")
    np.testing.assert_allclose(onto.transform(np.full((1, 2), 0.1)), [[0.6, 0.6]], atol=1e-6)
    batch = register(np.stack([s.source, np.full_like(s.source, 0.1)]), s.target, "gmmreg", start=room_start(10.0, 0.2))
    assert batch.status.tolist() == [Status.CONVERGED, Status.DEGENERATE]


def test_scenes_that_determine_little(rng):
    """Two points, a circle, a wall, all outliers: finite poses and a status, without a claim to be right."""
    two = np.array([[0.0, 0.0], [2.0, 0.0]])
    pair = register(two, Pose.from_angle(0.3, (0.1, 0.2)).apply(two), "gmmreg")
    np.testing.assert_allclose(pair.transform(two), Pose.from_angle(0.3, (0.1, 0.2)).apply(two), atol=1e-6)
    f = 2.0 * np.pi * np.arange(60) / 60.0
    circle = np.column_stack([np.cos(f), np.sin(f)])
    circle_result = register(circle, Pose.from_angle(2.0).apply(circle), "gmmreg")
    assert metrics.rre(circle_result.pose, Pose.from_angle(2.0)) > np.radians(30.0)
    wall = np.column_stack([np.linspace(-3.0, 3.0, 60), np.zeros(60)])
    slid = register(wall[20:40], wall, "gmmreg", start=Pose.from_angle(0.1, (0.0, 0.2)))
    assert abs(slid.pose.t[1]) < 1e-3
    source, target = rng.uniform(-5.0, 5.0, (2, 60, 2))
    assert register(source, target, "gmmreg").status in (Status.CONVERGED, Status.CAPPED, Status.STALLED)


def test_a_saddle_is_left_behind():
    """If the Hessian is not positive definite, the damped step still lowers the objective."""
    s = room("clean")
    batch = begin(METHODS["gmmreg"], problem(s.source, s.target, room_start(80.0)), GmmRegOptions(first=0.4, last=0.4))
    after = advance(batch).state()
    assert np.linalg.eigvalsh(batch.state().hessian[0])[0] < 0.0
    assert after.damping[0] > 0.0
    assert after.objective[0] < batch.state().objective[0]


@pytest.mark.parametrize(("name", "value"), [("first", 0.0), ("last", -1.0), ("shrink", 1.0), ("coarse", -1.0)])
def test_options_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"^{name}: "):
        register(np.eye(2), np.eye(2), "gmmreg", **{name: value})


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e6])
def test_a_width_that_no_point_would_reach_across_is_raised(unit):
    """To a millionth of the clouds' extent; one that nobody gives is 0.4, then 0.05, of the target's RMS radius."""
    s = room("clean")
    source, target = unit * s.source, unit * s.target
    extent = max(np.ptp(cloud, axis=0).max() for cloud in (source, target))
    radius = np.sqrt(np.square(target - target.mean(axis=0)).sum(axis=1).mean())
    for given, expected in (({"first": 1e-9 * unit, "last": 1e-12 * unit}, 1e-6 * extent), ({}, 0.4 * radius)):
        state = begin(METHODS["gmmreg"], problem(source, target), GmmRegOptions(**given)).state()
        assert state.sigma[0] == pytest.approx(expected)
    result = register(source, target, "gmmreg")
    assert result.detail("sigma") == pytest.approx(0.05 * radius)


def test_a_tiny_source_and_a_target_at_one_far_place_are_degenerate():
    """A hostile call found this pair: E's curvature in the turn overflows, which made numpy warn."""
    source = 1e-100 * np.array([[0.8, -0.8], [-0.1, 1.9], [-0.2, -0.4], [-0.9, -0.8], [-0.1, 0.0]])
    result = register(source, np.tile([4e28, 1.5e30], (6, 1)), "gmmreg")
    assert result.status == Status.DEGENERATE
    assert result.reason
    assert np.isfinite(result.pose.matrix).all()
