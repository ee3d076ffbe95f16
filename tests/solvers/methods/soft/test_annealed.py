"""The annealed soft targets: weights by definition, the schedule, descent at one width, and what they are not."""

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, metrics, register
from solvers.core.method import Problem
from solvers.core.stepper import begin
from solvers.methods.soft.annealed import SoftOptions, weights
from solvers.methods.soft.cpd import CpdOptions, responsibilities
from solvers.numerics import gaussians
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

RACE = {"first": 1.1, "last": 0.12, "shrink": 0.9, "miss": 0.12, "least_support": 0.15}


def problem(source, target):
    weights = np.ones((1, len(source)))
    return Problem(source[None], target[None], weights, Pose.identity(2, (1,)), np.zeros(1, dtype=np.int64))


def score(pose, source, target, sigma, miss):
    """The score −σ² Σ_i log(1 + Σ_j K_ij / o), (b,)."""
    density = gaussians.sums(pose.apply(source), target, np.full(len(source), sigma), np.ones((*target.shape[:2], 1)))
    return -(sigma**2) * np.log1p(density[..., 0] / miss).sum(axis=1)


def test_targets_and_support_are_what_the_definition_says():
    """Gaussian weights over the targets, normalised together with the constant 0.12; rows below 0.15 are dropped."""
    s = room("outliers")
    state = begin(METHODS["soft-annealed"], problem(s.source, s.target), SoftOptions(**{**RACE, "first": 0.2})).state()
    K = np.exp(-np.square(s.source[:, None] - s.target).sum(axis=2) / (2.0 * 0.2**2))
    w = K / (K.sum(axis=1, keepdims=True) + 0.12)
    np.testing.assert_allclose(weights(state), w, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(state.support[0], w.sum(axis=1), rtol=1e-10, atol=1e-14)
    np.testing.assert_array_equal(state.used[0], w.sum(axis=1) >= 0.15)
    assert 0 < np.count_nonzero(~state.used) < 30
    rows = state.used[0]
    np.testing.assert_allclose(state.soft[0][rows], (w @ s.target / w.sum(axis=1)[:, None])[rows], rtol=1e-10)
    squares = np.square(s.source - state.soft[0]).sum(axis=1)
    np.testing.assert_allclose(state.objective[0], (w.sum(axis=1) * squares)[rows].sum(), rtol=1e-10)


def test_the_width_follows_its_schedule():
    """σ is 1.1 × 0.9ᵏ, down to 0.12, however good the fit."""
    s = room("clean")
    widths = []
    register(
        s.source, s.target, "soft-annealed", start=room_start(), **RACE,
        callback=lambda k, state: widths.append(state.sigma[0]),
    )  # fmt: skip
    assert len(widths) > 22
    np.testing.assert_allclose(widths, np.maximum(1.1 * 0.9 ** np.arange(1, len(widths) + 1), 0.12), rtol=1e-12)


def test_at_one_width_a_step_never_raises_its_score(rng, random_pose):
    """With σ fixed and no row dropped, no step raises −σ² Σ log(1 + Σ K/o), on 40 random scenes from far starts."""
    source = rng.standard_normal((40, 12, 2))
    target = random_pose(rng, 2, (40,)).apply(source[:, :10]) + 0.2 * rng.standard_normal((40, 10, 2))
    options = {"first": 0.5, "last": 0.5, "least_support": 0.0, "max_steps": 40}
    start = random_pose(rng, 2, (40,))
    result = register(source, target, "soft-annealed", start=start, **options)
    poses = result.history.poses
    scores = np.stack([score(poses[k], source, target, 0.5, 0.12) for k in range(len(poses.t))])
    assert np.all(np.diff(scores, axis=0) <= 1e-9)
    assert np.median(scores[-1] - scores[0]) < -0.1


def test_it_is_not_cpd():
    """It normalises over the fixed points for each moving point, whose shares sum to one at most, those of some fixed
    point to more. CPD normalises over the moving points for each fixed one: there it is the other way round."""
    s = room("clean")
    w = weights(begin(METHODS["soft-annealed"], problem(s.source, s.target), SoftOptions()).state())
    assert np.all(w.sum(axis=1) <= 1.0)
    assert w.sum(axis=0).max() > 1.0
    P = responsibilities(begin(METHODS["cpd-rigid"], problem(s.source, s.target), CpdOptions(sigma=0.5)).state())
    assert P.sum(axis=0).max() <= 1.0 + 1e-12
    assert P.sum(axis=1).max() > 1.0
    # Doubling the fixed points in place halves the odds of 'no partner'; CPD's clutter does not behave like that.
    target = np.concatenate([s.target, s.target])
    double = weights(begin(METHODS["soft-annealed"], problem(s.source, target), SoftOptions(first=0.2)).state())
    single = weights(begin(METHODS["soft-annealed"], problem(s.source, s.target), SoftOptions(first=0.2)).state())
    missing, before = 1.0 - double.sum(axis=1), 1.0 - single.sum(axis=1)
    np.testing.assert_allclose(missing / (1.0 - missing), 0.5 * before / (1.0 - before), rtol=1e-9)


@pytest.mark.parametrize("degrees", [-160.0, 90.0])
def test_large_motions_are_found_from_near_them(degrees):
    s = room("clean")
    truth = Pose.from_angle(np.radians(degrees), (4.0, -3.0))
    start = Pose.from_angle(np.radians(degrees + 15.0), (3.8, -2.9))
    result = register(s.source, truth.apply(s.target), "soft-annealed", start=start)
    assert result.status == Status.CONVERGED
    assert metrics.rre(result.pose, truth) < np.radians(0.5)
    assert metrics.point_error(result.pose, truth, s.source) < 0.05


def test_a_shifted_cloud_in_space_is_brought_back(rng, random_pose):
    source = rng.standard_normal((80, 3)) * [3.0, 2.0, 1.0]
    truth = random_pose(rng, 3)
    start = Pose(truth.R, truth.t + 0.3)
    result = register(source, truth.apply(source), "soft-annealed", start=start)
    assert metrics.point_error(result.pose, truth, source) < 0.01


def test_a_batch_is_its_single_runs():
    scenes = [room("combo", seed=seed) for seed in SEEDS[:5]]
    source, target = np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])
    batch = register(source, target, "soft-annealed", start=room_start(30.0), max_steps=40, **RACE)
    for k in range(5):
        alone = register(source[k], target[k], "soft-annealed", start=room_start(30.0), max_steps=40, **RACE)
        assert alone.steps == batch.steps[k]
        np.testing.assert_allclose(batch.matrix[k], alone.matrix, rtol=1e-12, atol=1e-12)


def test_no_overlap_and_equal_points_are_said():
    """Clouds out of reach have no support and stay; equal source points are reported, and a single fixed point ends
    without support."""
    s = room("clean")
    failure = register(s.source, s.target + 100.0, "soft-annealed", **RACE)
    assert failure.status == Status.DEGENERATE
    assert "support" in failure.reason
    np.testing.assert_array_equal(failure.matrix, np.eye(3))
    equal = "all source points with weight are equal"
    for source, target, text in (
        ([[1.0, 2.0]], s.target, equal),
        (np.full((4, 2), 0.1), s.target, equal),
        (s.source, [[0.0, 0.0]], "no source point has enough support"),
    ):
        result = register(source, target, "soft-annealed", max_steps=200)
        assert result.status == Status.DEGENERATE
        assert result.reason.startswith(text)


def test_two_points():
    two = np.array([[0.0, 0.0], [2.0, 0.0]])
    result = register(two, Pose.from_angle(0.3, (0.1, 0.2)).apply(two), "soft-annealed", max_steps=300)
    assert result.status == Status.CONVERGED
    np.testing.assert_allclose(result.transform(two), Pose.from_angle(0.3, (0.1, 0.2)).apply(two), atol=1e-3)


def test_a_circle_and_a_wall_stop_truthfully():
    """What the scene leaves free is not found: the run stops, and the error against the truth remains."""
    f = 2.0 * np.pi * np.arange(60) / 60.0
    circle = np.column_stack([np.cos(f), np.sin(f)])
    circle_result = register(circle, Pose.from_angle(2.0).apply(circle), "soft-annealed", max_steps=200)
    assert metrics.rre(circle_result.pose, Pose.from_angle(2.0)) > np.radians(30.0)
    wall = np.column_stack([np.linspace(-3.0, 3.0, 60), np.zeros(60)])
    slid = register(wall[20:40], wall, "soft-annealed", start=Pose.from_angle(0.1, (1.0, 0.2)), max_steps=200)
    assert abs(slid.pose.t[0]) > 0.5
    assert abs(slid.pose.t[1]) < 0.01


def test_unrelated_clouds_end_with_a_status(rng):
    source, target = rng.uniform(-5.0, 5.0, (2, 60, 2))
    result = register(source, target, "soft-annealed", **RACE)
    assert result.status in (Status.CONVERGED, Status.CAPPED)


@pytest.mark.parametrize(
    ("name", "value"), [("first", 0.0), ("last", -1.0), ("shrink", 1.5), ("miss", 0.0), ("least_support", 2.0)]
)
def test_options_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"^{name}: "):
        register(np.eye(2), np.eye(2), "soft-annealed", **{name: value})
