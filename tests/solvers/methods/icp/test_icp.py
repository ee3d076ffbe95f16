"""ICP, trimmed and capped ICP, the KISS threshold and fast-robust ICP: descent, large motions, degenerate scenes."""

from functools import partial

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.geometry import nearest
from solvers.methods.icp.kiss import KissOptions, sigma
from solvers.metrics import rre, rte
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS, Controls, race_problem

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

FAMILY = ["icp", "trimmed-icp", "capped-icp", "kiss-threshold-icp", "fast-robust-icp"]


def rooms(setting, degrees, distance=1.43, seeds=SEEDS):
    scenes = [room(setting, seed=s) for s in seeds]
    source, target = np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])
    return source, target, room_start(degrees, distance)


def shape(rng, d, n=90):
    """A cloud without symmetry: a bent, tapering strip."""
    u = np.linspace(0.0, 1.0, n)
    coordinates = [3.0 * u, np.sin(5.0 * u) + u * u, np.cos(4.0 * u) * u]
    return np.stack(coordinates[:d], axis=1) + 0.01 * rng.standard_normal((n, d))


def falls(history, slack=1e-12):
    """Whether an objective (k + 1, b) never rises, up to rounding of its first value."""
    return np.all(np.diff(history, axis=0) <= slack * history[0])


@pytest.mark.parametrize("d", [2, 3])
def test_the_sum_of_squares_never_rises(d, rng, random_pose):
    """With exact neighbours, exact fits, no gate and no trimming, E(T) never rises, over 200 random scenes and
    starts."""
    source, target = rng.standard_normal((200, 25, d)), rng.standard_normal((200, 30, d))
    weights = rng.uniform(0.0, 2.0, (200, 25))
    start = random_pose(rng, d, (200,))
    result = register(source, target, start=start, weights=weights, rms_tolerance=0.0)
    assert falls(result.history.objective)
    assert np.median(result.steps) > 5
    # The objective agrees with its definition at the last pose.
    gaps = np.linalg.norm(result.transform(source)[:, :, None] - target[:, None], axis=3)
    assert np.allclose(result.objective, (weights * gaps.min(axis=2) ** 2).sum(axis=1), rtol=1e-12)


def test_gated_or_trimmed_the_shown_rms_can_rise():
    """A gate or trimming changes the set that is summed over, so the RMS over the pairs used can rise, and does."""
    source, target, start = rooms("combo", 45.0)
    for options in ({"gate": 0.6}, {"gate": 1.0, "trim": 0.3}):
        rms, count = [], []

        def watch(k, state, rms=rms, count=count):
            rms.append(state.pairing.rms)
            count.append(state.pairing.count)

        register(source, target, start=start, rms_tolerance=0.0, callback=watch, **options)
        rises = np.diff(np.stack(rms), axis=0) > 1e-3
        assert rises.any(axis=0).sum() >= 10
        assert (np.diff(np.stack(count), axis=0) != 0).any()


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("trimmed-icp", {"keep": 0.6}),
        ("trimmed-icp", {"keep": 0.8, "weight": "tukey", "scale": 0.3}),
        ("capped-icp", {"cap": 0.7}),
        ("capped-icp", {}),
        ("capped-icp", {"cap": 0.9, "weight": "huber", "scale": 0.2}),
        ("capped-icp", {"cap": 0.9, "weight": "welsch", "scale": 0.2}),
        ("icp", {"weight": "geman-mcclure", "scale": 0.2}),
        ("kiss-threshold-icp", {"initial": 0.5, "angle": 0.2, "shift": 0.2}),
        ("fast-robust-icp", {}),
        ("fast-robust-icp", {"history": 0}),
        ("fast-robust-icp", {"forget": False}),
        ("fast-robust-icp", {"first": 2.0, "last": 0.05}),
    ],
)
def test_each_variant_descends_on_its_own_objective(method, options, d, rng, random_pose):
    """Fixed-count trimming, capped distances, robust losses with a fixed scale, Welsch with a shrinking threshold, and
    extrapolated steps: no step raises the variant's own objective."""
    source, target = rng.standard_normal((60, 25, d)), rng.standard_normal((60, 30, d))
    start = Pose(random_pose(rng, d, (60,)).R, 0.3 * rng.standard_normal((60, d)))
    result = register(source, target, method, start=start, **options)
    assert falls(result.history.objective)
    assert np.median(result.steps) > 3
    assert np.median(result.history.objective[-1] / result.history.objective[0]) < 0.9


def test_the_objectives_are_what_they_are_said_to_be(rng):
    """By brute force. Trimmed: the sum of the `count` smallest squares. Capped: the sum of the squares, each capped."""
    source, target = rng.standard_normal((4, 20, 2)), rng.standard_normal((4, 30, 2))
    trimmed = register(source, target, "trimmed-icp", keep=0.61)
    capped = register(source, target, "capped-icp", cap=0.4)
    for result, cost in (
        (trimmed, lambda r2: np.sort(r2, axis=1)[:, :12].sum(axis=1)),
        (capped, lambda r2: np.minimum(r2, 0.16).sum(axis=1)),
    ):
        gaps = ((result.transform(source)[:, :, None] - target[:, None]) ** 2).sum(axis=3)
        assert np.allclose(result.objective, cost(gaps.min(axis=2)), rtol=1e-12)
        pairing = result.detail("pairing")
        assert np.array_equal(pairing.rows, gaps.argmin(axis=2))
    assert np.all(trimmed.detail("pairing").count == 12)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("method", FAMILY)
def test_a_large_motion_comes_out_the_right_way_round(method, d, rng, random_pose):
    """A rotation far from the identity, started slightly off it, exposes any transpose or wrong order of
    composition."""
    cloud = shape(rng, d)
    truth = random_pose(rng, d, (6,))
    small = random_pose(rng, d, (6,)).R
    axis = 0.05 * (small - small.swapaxes(1, 2))
    turn = np.linalg.solve(np.eye(d) + axis, np.eye(d) - axis)
    start = truth.compose(Pose(turn, np.full((6, d), 0.03)))
    result = register(cloud, truth.apply(np.broadcast_to(cloud, (6, *cloud.shape))), method, start=start)
    assert np.all(result.status == Status.CONVERGED)
    assert np.abs(result.matrix - truth.matrix).max() < 1e-6


@pytest.mark.parametrize("method", FAMILY)
def test_a_batch_gives_what_each_problem_gives_alone(method):
    """Poses, statuses and steps of 25 rooms, batched and one by one, agree to 1e-12."""
    source, target, start = rooms("combo", 30.0)
    batch = register(source, target, method, start=start)
    for i in range(0, 25, 4):
        alone = register(source[i], target[i], method, start=start)
        assert alone.steps == batch.steps[i]
        assert alone.status == batch.status[i]
        assert np.allclose(alone.matrix, batch.matrix[i], rtol=1e-12, atol=1e-12)


def test_from_near_the_room_is_found_and_from_far_a_stop_is_no_success():
    """In 'clean', from 15° all 25 seeds end within 5° and 0.2 u; from 120° all report convergence and are wrong."""
    source, target, near = rooms("clean", 15.0)
    result = register(source, target, start=near)
    truth = Pose.identity(2, (25,))
    assert np.all((rre(result.pose, truth) < np.radians(5.0)) & (rte(result.pose, truth) < 0.2))
    source, target, far = rooms("clean", 120.0)
    result = register(source, target, start=far, max_steps=200)
    assert np.all(result.status == Status.CONVERGED)
    assert np.all(rre(result.pose, truth) > np.radians(30.0))


def test_scans_that_overlap_in_part_need_a_gate():
    """Ten noisy rooms of which the target sees 60 %, from 10° and 0.3 u: without a gate none ends within 2° and 0.1 u,
    with one of 0.5 u at least eight do; all converge in both cases."""
    problem, truth = race_problem(Controls(10.0, 0.3, "noise", overlap=0.6), seeds=SEEDS[:10])
    right = {}
    for gate in (np.inf, 0.5):
        result = register(problem.source, problem.target, "icp", start=problem.start, gate=gate)
        assert (result.status == Status.CONVERGED).all()
        right[gate] = ((rre(result.pose, truth) < np.radians(2.0)) & (rte(result.pose, truth) < 0.1)).sum()
    assert right[np.inf] == 0
    assert right[0.5] >= 8


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("method", ["icp", "trimmed-icp", "capped-icp", "fast-robust-icp"])
def test_units_do_not_matter(method, d, rng):
    """Metres and millimetres give the same steps and the same pose in those units."""
    cloud, target = shape(rng, d), shape(rng, d, 70)
    plain = register(cloud, target, method, start=Pose(np.eye(d), np.full(d, 0.2)))
    scaled = register(1e3 * cloud, 1e3 * target, method, start=Pose(np.eye(d), np.full(d, 200.0)))
    assert scaled.steps == plain.steps
    assert np.allclose(scaled.pose.R, plain.pose.R, atol=1e-9)
    assert np.allclose(scaled.pose.t, 1e3 * plain.pose.t, atol=1e-6)


def test_the_state_shows_pairs_of_its_own_pose(rng):
    """From the start on, a state's pairs, distances, RMS and count belong to its pose."""
    source, target = rng.standard_normal((2, 15, 2)), rng.standard_normal((2, 18, 2))
    options = METHODS["icp"].options(gate=0.8, trim=0.2, weight="huber")
    problem = Problem(source, target, np.ones((2, 15)), Pose.identity(2, (2,)), np.zeros(2, dtype=np.int64))
    batch = begin(METHODS["icp"], problem, options)
    for _ in range(4):
        state, at = batch.state(), batch.state().pairing
        gaps = np.linalg.norm(state.pose.apply(source)[:, :, None] - target[:, None], axis=3)
        assert np.array_equal(at.rows, gaps.argmin(axis=2))
        assert np.allclose(at.distances, gaps.min(axis=2), rtol=1e-13)
        assert np.all(at.distances[at.used] <= 0.8)
        assert np.array_equal(at.count, at.used.sum(axis=1))
        within = (gaps.min(axis=2) <= 0.8).sum(axis=1)
        assert np.array_equal(at.count, within - np.floor(0.2 * within))
        assert np.allclose(at.rms**2, (at.weights * at.distances**2).sum(axis=1) / at.weights.sum(axis=1))
        assert np.all((at.weights > 0.0) == at.used)
        batch = advance(batch)


def test_the_two_ways_to_come_to_rest_are_told_apart(rng):
    """A vanishing pose change and a vanishing RMS change are separate rules, and the reason names the one that
    applied."""
    cloud = shape(rng, 2)
    exact = register(cloud, cloud, start=Pose.from_angle(0.02))
    assert exact.reason == "the pose has come to rest"
    source, target, start = rooms("combo", 45.0)
    by_rms = register(source, target, start=start, rms_tolerance=0.05)
    by_pose = register(source, target, start=start, rms_tolerance=0.0, max_steps=300)
    assert np.all(by_rms.reason == "the RMS has come to rest")
    assert np.all(by_pose.reason == "the pose has come to rest")
    assert np.all(by_rms.steps < by_pose.steps)
    # A small change of RMS only triggers a stop: most of the motion may still be ahead.
    assert np.median(np.linalg.norm(by_rms.pose.t - by_pose.pose.t, axis=1)) > 0.1


def test_a_robust_weight_resists_what_a_plain_fit_does_not(rng):
    """With a fifth of the source junk to one side, Huber's weights more than halve plain ICP's error, and redescending
    ones leave less than 0.02."""
    cloud = shape(rng, 2)
    source = cloud.copy()
    source[rng.permutation(90)[:18]] += [0.0, 2.0]
    errors = {}
    for weight in ("none", "huber", "tukey", "welsch", "geman-mcclure"):
        result = register(source, cloud, start=Pose.from_angle(0.05), weight=weight)
        errors[weight] = float(np.linalg.norm(result.matrix - np.eye(3)))
    assert errors["none"] > 0.1
    assert errors["huber"] < 0.5 * errors["none"]
    assert max(errors["tukey"], errors["welsch"], errors["geman-mcclure"]) < 0.02


def test_weightless_points_take_no_part(rng):
    cloud = shape(rng, 2)
    source = np.concatenate([cloud, rng.uniform(-50.0, 50.0, (30, 2))])
    weights = np.r_[np.ones(90), np.zeros(30)]
    for method in ("icp", "capped-icp", "kiss-threshold-icp", "fast-robust-icp"):
        with_junk = register(source, cloud, method, weights=weights, start=Pose.from_angle(0.03))
        assert np.abs(with_junk.matrix - np.eye(3)).max() < 1e-6
    assert not register(source, cloud, weights=weights).detail("pairing").used[90:].any()


# Scenes that do not determine the pose.


@pytest.mark.parametrize("method", FAMILY)
def test_coincident_points_leave_the_rotation_open(method):
    """If all source or all target points are equal, the centroids meet, the rotation stays, and the reason says why."""
    spread = np.random.default_rng(1).standard_normal((8, 2))
    start = Pose.from_angle(0.3)
    first = register(np.full((8, 2), 0.7), spread, method, start=start)
    assert first.status is Status.DEGENERATE
    assert "source points" in first.reason
    options = {"cap": 10.0} if method == "capped-icp" else {}
    second = register(spread, np.full((8, 2), 0.7), method, start=start, **options)
    assert second.status is Status.DEGENERATE
    assert "target points" in second.reason
    assert np.allclose(second.pose.R, start.R)


@pytest.mark.parametrize("method", FAMILY)
def test_two_points_are_enough_in_the_plane(method):
    two = np.array([[0.0, 0.0], [1.0, 0.0]])
    options = {"keep": 1.0} if method == "trimmed-icp" else {}
    result = register(two, Pose.from_angle(0.2, (0.1, 0.0)).apply(two), method, **options)
    assert np.abs(result.matrix - Pose.from_angle(0.2, (0.1, 0.0)).matrix).max() < 1e-6
    single = register(two[:1], two, method)
    assert single.status is Status.DEGENERATE


def test_many_points_with_one_nearest_partner_do_not_end_the_run(rng):
    """From far away all points may share one nearest target point: the centroid moves there, and ICP continues."""
    cloud = shape(rng, 2)
    fan = np.concatenate([cloud, [[-3.0, 0.0]]])
    result = register(cloud, fan, start=Pose.from_angle(0.0, (-40.0, 0.0)))
    first = register(cloud, fan, start=Pose.from_angle(0.0, (-40.0, 0.0)), max_steps=0)
    assert len(set(first.detail("pairing").rows.tolist())) == 1
    assert result.status is not Status.DEGENERATE
    assert result.steps > 2
    assert falls(result.history.objective)


def test_no_overlap_within_the_gate_is_degenerate_and_stays_put(rng):
    cloud = shape(rng, 2)
    limits = {"icp": {"gate": 2.0}, "capped-icp": {"cap": 2.0}, "kiss-threshold-icp": {"initial": 0.5}}
    for method, options in limits.items():
        result = register(cloud, cloud + 100.0, method, **options)
        assert result.status is Status.DEGENERATE
        assert "no pair with weight lies within" in result.reason
        assert result.steps == 0
        assert np.array_equal(result.matrix, np.eye(3))
    source, target, start = rooms("clean", 15.0, seeds=SEEDS[:3])
    source[1] += 1000.0
    batch = register(source, target, start=start, gate=2.6)
    assert batch.status.tolist() == [Status.CONVERGED, Status.DEGENERATE, Status.CONVERGED]
    alone = register(source[2], target[2], start=start, gate=2.6)
    assert np.allclose(batch.matrix[2], alone.matrix, atol=1e-12)


def test_one_wall_leaves_the_slide_to_the_sampling():
    """Along a straight wall only its ends and the sampling reveal the position: ICP stops with wall on wall and a wrong
    slide, and reports convergence."""
    wall = np.stack([np.arange(0.0, 10.0, 0.1), np.zeros(100)], axis=1)
    piece = wall[20:60]
    result = register(piece, wall, start=Pose.from_angle(0.02, (1.03, 0.2)))
    assert result.status is Status.CONVERGED
    assert abs(result.pose.angle) < 1e-6
    assert abs(result.pose.t[1]) < 1e-6
    assert result.pose.t[0] == pytest.approx(1.0, abs=0.11)


def test_a_circle_leaves_the_turn_to_the_start(why):
    """On a circle every rotation fits: the centre is found, the turn depends on the start alone."""
    angle = np.linspace(-np.pi, np.pi, 721)[:-1]
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    turns = [0.3, 1.4]
    results = [register(ring[::4], ring, start=Pose.from_angle(turn, (0.2, 0.1))) for turn in turns]
    why(
        "the turn of the start",
        {f"{turn} rad": f"ends at {float(r.pose.angle):.2f} rad" for turn, r in zip(turns, results, strict=True)},
    )
    for turn, result in zip(turns, results, strict=True):
        assert result.status is Status.CONVERGED
        assert np.linalg.norm(result.pose.t) < 2e-2
        assert abs(float(result.pose.angle) - turn) < 0.2


def test_no_weight_at_all_is_degenerate(rng):
    cloud = shape(rng, 2)
    for method in ("icp", "capped-icp", "kiss-threshold-icp", "fast-robust-icp"):
        result = register(cloud, cloud, method, weights=np.zeros(90))
        assert result.status is Status.DEGENERATE
        assert "weight" in result.reason
    weightless = register(cloud, cloud + 50.0, weight="tukey", scale=0.1)
    assert weightless.status is Status.DEGENERATE


@pytest.mark.native
@pytest.mark.parametrize("method", FAMILY)
def test_tree_and_products_give_the_same_run(method, monkeypatch, rng):
    """With scipy's tree and without it, every step is the same, bit for bit."""
    pytest.importorskip("scipy")
    cloud = shape(rng, 2, 500)
    assert nearest.build(cloud[None]).trees is not None
    make = partial(register, cloud[::2] + 0.02, cloud, method, start=Pose.from_angle(0.1))
    with_tree = make()
    rows, squares = nearest.build(cloud[None]).nearest(cloud[None, ::2] + 0.02)
    monkeypatch.setattr("solvers.geometry.nearest.TREE_FROM", 10**9)
    assert nearest.build(cloud[None]).trees is None
    without = make()
    assert np.array_equal(with_tree.history.poses.matrix, without.history.poses.matrix)
    assert len(with_tree.history.objective) > 3
    for a, b in zip((rows, squares), nearest.build(cloud[None]).nearest(cloud[None, ::2] + 0.02), strict=True):
        assert np.array_equal(a, b)


# Ideas of single variants.


def test_the_kiss_threshold_follows_the_stated_deviation(rng):
    """σ² is the mean of the squares of the first error and δ = 2 r_max sin(θ/2) + ‖t‖; a tiny δ is ignored."""
    source = rng.standard_normal((1, 30, 3))
    problem = Problem(source, source, np.ones((1, 30)), Pose.identity(3, (1,)), np.zeros(1, dtype=np.int64))
    assert sigma(problem, KissOptions(initial=0.7)).tolist() == [0.7]
    reach = np.linalg.norm(source[0], axis=1).max()
    delta = 2.0 * reach * np.sin(0.2) + 0.5
    assert sigma(problem, KissOptions(angle=0.4, shift=0.5, initial=0.7))[0] == pytest.approx(
        np.sqrt((0.7**2 + delta**2) / 2.0)
    )
    turn = np.eye(3)
    turn[:2, :2] = Pose.from_angle(0.4).R
    moved = Problem(source, source, np.ones((1, 30)), Pose(turn[None], np.array([[0.3, 0.4, 0.0]])), problem.seed)
    assert sigma(moved, KissOptions(initial=0.7))[0] == pytest.approx(np.sqrt((0.7**2 + delta**2) / 2.0))
    # By default both are shares of the target's radius: a deviation of just over 0.03 of it counts.
    size = float(np.sqrt(np.square(source[0] - source[0].mean(axis=0)).sum(axis=1).mean()))
    for shift, counts in ((0.0299 * size, 0.0), (0.0301 * size, 0.0301 * size)):
        expected = np.sqrt((0.36 * size**2 + counts**2) / 2.0) if counts else 0.6 * size
        assert sigma(problem, KissOptions(angle=0.0, shift=shift))[0] == pytest.approx(expected, rel=1e-12)
    # No pose within the stated deviation moves a point farther than δ.
    assert np.all(np.linalg.norm(moved.start.apply(source) - source, axis=2) <= delta)
    result = register(source[0], source[0], "kiss-threshold-icp", initial=0.7)
    assert result.detail("reach") == pytest.approx(2.1)
    assert result.detail("pairing").threshold == pytest.approx(0.7 / 3.0)


@pytest.mark.parametrize(
    ("method", "option", "value"),
    [
        ("icp", "gate", 0.0), ("icp", "gate", float("nan")), ("icp", "trim", 1.0), ("icp", "trim", -0.1),
        ("icp", "weight", "cauchy"), ("icp", "tolerance", -1.0), ("icp", "rms_tolerance", "x"),
        ("trimmed-icp", "keep", 0.0), ("trimmed-icp", "keep", 1.1), ("capped-icp", "cap", -1.0),
        ("kiss-threshold-icp", "initial", 0.0), ("kiss-threshold-icp", "angle", 4.0),
        ("fast-robust-icp", "history", -1), ("fast-robust-icp", "forget", 0), ("fast-robust-icp", "first", 0.0),
    ],
)  # fmt: skip
def test_wrong_options_are_named(method, option, value, rng):
    with pytest.raises(ValueError, match=rf"^{option}: "):
        register(rng.standard_normal((4, 2)), rng.standard_normal((4, 2)), method, **{option: value})
