"""Branch and bound: its bounds against sampled poses, its optimum against enumeration, and what its proof covers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import METHODS, Pose, Status, register
from solvers.core.stepper import begin, run
from solvers.methods.search import bounds
from solvers.methods.search.branch_and_bound import CELLS_PER_CAP, _confined
from solvers.methods.search.distance_grid import build
from solvers.metrics import rre
from solvers.scenes.rooms import room, room_start
from solvers.scenes.walls import hall
from solvers.studies.race import SEEDS, Controls, race_problem

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

METHOD = "branch-and-bound"


def objective(poses, source, target, cap):
    """The objective from its definition, with every distance of every pose: (k,)."""
    values = []
    for part in np.array_split(np.arange(len(poses.t)), max(1, len(poses.t) // 50)):
        moved = poses[part].apply(source)
        squares = np.square(moved[:, :, None] - target).sum(axis=-1).min(axis=-1)
        values.append(np.minimum(squares, cap**2).mean(axis=-1))
    return np.concatenate(values)


def small_scene(seed, n=14):
    """A few noisy points of a bent outline, seen from elsewhere in the source, one in seven junk there; and the
    truth."""
    rng = np.random.default_rng(seed)
    along = np.linspace(0.0, 1.0, n)
    target = np.stack([3.0 * along, np.square(2.0 * along)], axis=1) + 0.05 * rng.standard_normal((n, 2))
    truth = Pose.from_angle(rng.uniform(-np.pi, np.pi), rng.uniform(-3.0, 3.0, 2))
    source = truth.inverse().apply(target + 0.05 * rng.standard_normal((n, 2)))
    source[::7] += rng.uniform(-2.0, 2.0, (len(source[::7]), 2))
    return source, target, truth


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(st.integers(0, 2**32), st.floats(-4.0, 0.6), st.floats(-4.0, 0.6), st.integers(1, 40))
def test_no_pose_of_a_box_lies_below_its_bounds(seed, log_turn, log_side, n):
    """Both bounds, for boxes from 1e-4 to 4 caps and radians, corners included; lengths in caps."""
    rng = np.random.default_rng(seed)
    target = rng.uniform(-4.0, 4.0, (n, 2)) * rng.uniform(0.05, 1.0, 2)
    arms = rng.uniform(-4.0, 4.0, (rng.integers(1, 30), 2))
    arms -= arms.mean(axis=0)
    grid = build(target, 1.0 / CELLS_PER_CAP, 2.0)
    middle = np.concatenate([rng.uniform(-4.0, 4.0, (20, 1)), rng.uniform(-5.0, 5.0, (20, 2))], axis=1)
    # Half of the boxes are around poses that put a point on a target point, where the fine bound has something to lose.
    picks = rng.integers(0, len(arms), 10)
    offsets = Pose.from_angle(middle[:10, 0], np.zeros((10, 2))).R @ arms[picks][..., None]
    middle[:10, 1:] = target[rng.integers(0, n, 10)] - offsets[..., 0]
    half = np.tile([10.0**log_turn, 10.0**log_side], (20, 1))
    low = np.maximum(
        bounds.coarse(grid, arms, middle, half), bounds.fine(grid, arms, middle, half)
    )
    corners = np.stack([a.ravel() for a in np.meshgrid([-1, 1], [-1, 1], [-1, 1])], axis=1)
    within = np.concatenate([rng.uniform(-1.0, 1.0, (60, 3)), corners, np.zeros((1, 3))])
    samples = middle[:, None] + within * half[0, [0, 1, 1]]
    poses = Pose.from_angle(samples[..., 0].ravel(), samples[..., 1:].reshape(-1, 2))
    values = objective(poses, arms, target, 1.0).reshape(20, -1)
    assert (low <= values.min(axis=1) + 1e-12).all()


def test_the_fine_bound_falls_with_the_square_of_a_box():
    """At the minimum of a noisy room, a box a tenth the size leaves the coarse bound more than a tenth of its distance
    from the value, the fine one less than a twentieth."""
    scene, cap = room("noise"), 0.4
    best = register(scene.source, scene.target, METHOD, cap=cap, gap=1e-3)
    ground = best.states[0].ground[0]
    shift = (best.pose.apply(scene.source.mean(axis=0, keepdims=True))[0] - ground.middle) / cap
    middle = np.array([[float(best.pose.angle), *shift]])
    value = float(best.objective) / cap**2
    losses = {}
    for size in (0.02, 0.002):
        half = np.array([[size / ground.reach, size]])
        fine = bounds.fine(ground.grid, ground.arms, middle, half)[0]
        losses[size] = value - np.array([bounds.coarse(ground.grid, ground.arms, middle, half)[0], fine])
    assert losses[0.002][1] < 0.05 * losses[0.02][1]
    assert losses[0.002][0] > 0.1 * losses[0.02][0]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_optimum_is_that_of_enumeration_and_descent(seed):
    """Against all turns by 5° and all places by half a cap, the best thirty of them refined by capped ICP."""
    source, target, _ = small_scene(seed)
    cap, gap = 0.4, 1e-4
    result = register(source, target, METHOD, cap=cap, gap=gap)
    assert result.status == Status.PROVED
    assert 0.0 <= result.gap <= gap
    mean = source.mean(axis=0)
    turns = np.radians(np.arange(-180.0, 180.0, 5.0))
    low, high = target.min(axis=0) - 1.0, target.max(axis=0) + 1.0
    x, y = (np.arange(low[k], high[k], 0.2) for k in (0, 1))
    grid = np.stack([a.ravel() for a in np.meshgrid(turns, x, y)], axis=1)
    R = Pose.from_angle(grid[:, 0], np.zeros((len(grid), 2))).R
    poses = Pose(R, grid[:, 1:] - R @ mean)
    values = objective(poses, source, target, cap)
    starts = poses[np.argsort(values)[:30]]
    ends = register(source, target, "capped-icp", start=starts, cap=cap, max_steps=100)
    least = min(values.min(), ends.objective.min() / len(source))
    assert result.lower <= least + 1e-12
    assert result.objective <= least + gap
    value = objective(Pose(result.pose.R[None], result.pose.t[None]), source, target, cap)[0]
    assert value == pytest.approx(float(result.objective), abs=1e-12)


@pytest.mark.parametrize("setting", ["noise", "combo"])
def test_capped_icp_from_500_starts_is_never_better_by_more_than_the_gap(setting):
    """From 500 random poses none ends below the proved floor, or below the proved pose by more than 1e-3 u²."""
    scene, rng, cap = room(setting), np.random.default_rng(1), 0.4
    result = register(scene.source, scene.target, METHOD, cap=cap, gap=1e-3)
    assert result.status == Status.PROVED
    starts = Pose.from_angle(rng.uniform(-np.pi, np.pi, 500), rng.uniform(-3.0, 3.0, (500, 2)))
    ends = register(scene.source, scene.target, "capped-icp", start=starts, cap=cap, max_steps=40)
    assert ends.objective.min() / len(scene.source) >= result.lower
    assert result.objective <= ends.objective.min() / len(scene.source) + 1e-3


def test_the_hall_is_proved_and_may_be_half_a_turn_off():
    """All 6 draws are proved; some answers are within 5° of the truth, the others within 5° of half a turn from it."""
    scenes = [hall(seed=seed) for seed in SEEDS[:6]]
    result = register(
        np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), METHOD, gap=1e-3
    )
    assert (result.status == Status.PROVED).all()
    error = np.degrees(rre(result.pose, scenes[0].truth))
    assert ((error < 5.0) | (error > 175.0)).all()
    assert 0 < np.count_nonzero(error > 175.0) < 6


def test_a_batch_equals_its_single_runs_and_the_bound_only_rises():
    controls = Controls(setting="noise")
    problem, _ = race_problem(controls, seeds=[40, 53, 66])
    lowers = []
    result, _ = run(begin(METHODS[METHOD], problem), lambda k, state: lowers.append((state.lower, state.objective)))
    batch = result.state()
    for i, seed in enumerate((40, 53, 66)):
        single, _ = race_problem(controls, seeds=[seed])
        alone = run(begin(METHODS[METHOD], single))[0].state()
        for name in ("objective", "lower", "examined", "left", "status"):
            assert getattr(alone, name)[0] == getattr(batch, name)[i]
        assert np.array_equal(alone.pose.R[0], batch.pose.R[i])
        assert np.array_equal(alone.pose.t[0], batch.pose.t[i])
    lower, ceiling = (np.stack(x) for x in zip(*lowers, strict=True))
    assert (np.diff(lower, axis=0) >= 0.0).all()
    assert (np.diff(ceiling, axis=0) <= 0.0).all()
    assert (lower <= ceiling).all()


def test_the_start_plays_no_part():
    """Twelve starts round the circle are all proved and end at the same value, to within the gap."""
    scene = room("outliers")
    starts = Pose.from_angle(np.radians(30.0 * np.arange(12)), 3.0 * np.ones((12, 2)))
    result = register(scene.source, scene.target, METHOD, start=starts, gap=1e-3)
    assert (result.status == Status.PROVED).all()
    assert np.ptp(result.objective) <= 1e-3
    assert (np.degrees(rre(result.pose, scene.truth)) < 2.0).all()


def test_a_search_that_is_confined_stays_where_it_is_told():
    """First turns alone, with the centroid fixed; then a turn of at most 20° and a shift of at most half a unit."""
    scene = room("noise")
    mean = scene.source.mean(axis=0)
    start = Pose.from_angle(np.radians(100.0), mean - Pose.from_angle(np.radians(100.0), (0.0, 0.0)).R @ mean)
    result = register(scene.source, scene.target, METHOD, start=start, shift=0.0, gap=1e-3)
    assert result.status == Status.PROVED
    assert np.allclose(result.pose.apply(mean[None])[0], mean, atol=1e-12)
    turns = Pose.from_angle(np.radians(np.arange(-180.0, 180.0, 0.25)), np.zeros((1440, 2)))
    poses = Pose(turns.R, mean - turns.R @ mean)
    least = objective(poses, scene.source, scene.target, float(result.states[0].ground[0].cap)).min()
    assert result.lower <= least
    assert result.objective <= least + 1e-3
    origin = room_start(60.0, 1.0)
    second = register(scene.source, scene.target, METHOD, start=origin, turn=np.radians(20.0), shift=0.5, gap=1e-3)
    assert second.status == Status.PROVED
    assert 40.0 - 1e-9 <= np.degrees(second.pose.angle) <= 80.0 + 1e-9
    assert np.abs(second.pose.apply(mean[None]) - origin.apply(mean[None])).max() <= 0.5 + 1e-9
    assert second.objective > result.objective


def test_a_pose_beyond_any_side_of_the_window_is_moved_to_that_side(rng):
    """One within it is left as it is."""
    scene, origin = room("noise"), room_start(175.0, 1.0)
    run = register(scene.source, scene.target, METHOD, start=origin, turn=0.3, shift=0.5, max_steps=0)
    mean = scene.source.mean(axis=0)
    turn, shift = rng.uniform(-0.6, 0.6, 200), rng.uniform(-1.0, 1.0, (200, 2))

    def poses(turn, shift):
        R = Pose.from_angle(turn).R @ origin.R
        return Pose(R, origin.apply(mean[None]) + shift - R @ mean)

    given, expected = poses(turn, shift), poses(np.clip(turn, -0.3, 0.3), np.clip(shift, -0.5, 0.5))
    np.testing.assert_allclose(_confined(run.states[0].ground[0], given).matrix, expected.matrix, atol=1e-9)


def test_a_run_cut_short_has_the_gap_that_remains():
    scene = room("combo")
    part = register(scene.source, scene.target, METHOD, gap=1e-3, boxes=256, max_steps=25)
    whole = register(scene.source, scene.target, METHOD, gap=1e-3, boxes=256)
    assert part.status == Status.CAPPED
    assert whole.status == Status.PROVED
    assert part.gap > 1e-3 >= whole.gap
    assert part.lower <= whole.objective
    few = register(scene.source, scene.target, METHOD, gap=1e-3, most=100)
    assert few.status == Status.CAPPED
    assert "more than 100 boxes" in few.reason


def test_what_proves_nothing_has_no_gap():
    scene = room("clean")
    result = register(scene.source, scene.target, "icp")
    assert result.lower is None
    assert result.gap is None
    clouds = [scene.source, scene.source[:60]]
    batch = register(clouds, [scene.target, scene.target], METHOD, gap=1e-3)
    assert batch.gap.shape == (2,)
    assert (batch.gap <= 1e-3).all()


@pytest.mark.parametrize("unit", [1e-6, 1e3])
def test_the_answer_has_no_unit_and_no_origin(unit):
    """The default cap and gap are derived from the target's size."""
    scene = room("noise")
    plain = register(scene.source, scene.target, METHOD)
    second = register(unit * scene.source + 7.0 * unit, unit * scene.target + 9.0 * unit, METHOD)
    assert plain.status == second.status == Status.PROVED
    assert second.objective / unit**2 == pytest.approx(float(plain.objective), abs=float(plain.gap))
    mean = scene.source.mean(axis=0)
    point = second.pose.apply(unit * mean[None] + 7.0 * unit) / unit - 9.0
    assert np.abs(point - plain.pose.apply(mean[None])).max() < 0.1


@pytest.mark.parametrize(
    ("source", "target", "reason"),
    [
        (np.ones((5, 2)), np.arange(10.0).reshape(5, 2), "all source points are equal"),
        (np.arange(10.0).reshape(5, 2), np.ones((4, 2)), "all target points are equal"),
        (np.arange(10.0).reshape(5, 2) * 1e9, np.arange(10.0).reshape(5, 2), "caps wide"),
    ],
)
def test_clouds_that_cannot_be_searched_are_said_to_be_such(source, target, reason):
    result = register(source, target, METHOD)
    assert result.status == Status.DEGENERATE
    assert reason in result.reason
    assert result.detail("ground") is None
    assert np.isfinite(result.objective)
    assert result.lower == 0.0


def test_the_cure_for_clouds_that_span_too_many_caps_is_named_and_works():
    scene = room("noise")
    source = np.concatenate([scene.source, [[1e5, 0.0]]])
    assert register(source, scene.target, METHOD).reason.endswith("leave out its far points, or give a larger cap")
    assert register(source, scene.target, METHOD, cap=11.0, max_steps=1).status == Status.CAPPED


@pytest.mark.parametrize(
    "options", [{"cap": 0.0}, {"gap": 0.0}, {"turn": 4.0}, {"shift": -1.0}, {"boxes": 0}, {"most": 0}]
)
def test_options_out_of_range_are_refused(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        register(np.eye(2), np.eye(2), METHOD, **options)


def test_a_line_on_a_line_is_proved_though_many_poses_tie():
    """All places along the wall, and half a turn, are equally good: the value is proved, the pose is one of many."""
    wall = np.stack([np.linspace(0.0, 8.0, 60), np.zeros(60)], axis=1)
    result = register(wall[20:40], wall, METHOD)
    assert result.status == Status.PROVED
    assert result.objective < 1e-4


def test_the_objective_is_that_of_the_cap_that_is_told():
    """The default cap is an eighth of the target's RMS radius."""
    scene = room("noise")
    for own in ({}, {"cap": 0.3}):
        result = register(scene.source, scene.target, "branch-and-bound", max_steps=3, **own)
        cap = result.detail("ground").cap
        usual = np.sqrt(np.square(scene.target - scene.target.mean(axis=0)).sum(axis=1).mean()) / 8.0
        assert cap == pytest.approx(own.get("cap", usual), rel=1e-12)
        distances = np.linalg.norm(result.transform(scene.source)[:, None] - scene.target, axis=2).min(axis=1)
        assert result.objective == pytest.approx(np.square(np.minimum(distances, cap)).mean(), rel=1e-9)


@pytest.mark.parametrize("shift", [1e3, 1e100])
def test_a_shift_beyond_all_overlap_is_as_none(shift):
    """Where no point comes within the cap there is nothing to find; boxes there took the proof."""
    target = np.random.default_rng(2).uniform(-2.0, 2.0, (25, 2))
    source, start = Pose.from_angle(0.4, (0.3, 0.1)).apply(target), Pose.from_angle(0.0, (1.0, 0.0))
    wide, usual = (register(source, target, METHOD, start=start, gap=0.01, shift=s) for s in (shift, None))
    assert wide.status == usual.status == Status.PROVED
    assert (wide.objective, wide.lower, wide.steps) == (usual.objective, usual.lower, usual.steps)


def test_a_searched_turn_may_pass_half_a_turn():
    """A start at 174° and a truth at −174° are 11° apart: a search to within 23° proves the truth."""
    target = np.random.default_rng(2).uniform(-2.0, 2.0, (25, 2))
    truth = Pose.from_angle(-np.pi + 0.1, (0.1, -0.2))
    start = Pose.from_angle(np.pi - 0.1, (0.0, 0.0))
    result = register(
        truth.inverse().apply(target), target, "branch-and-bound", start=start, turn=0.4, shift=0.5, cap=0.4, gap=1e-3
    )
    assert result.status == Status.PROVED
    assert np.degrees(rre(result.pose, truth)) < 1.0
    assert result.objective < 1e-3


def test_the_fine_bound_allows_for_the_bend_of_the_arc():
    """A box of turns moves a point along an arc, which can pass closer to a target point than its chord suggests."""
    target, arms = np.array([[-0.5, 0.0]]), np.array([[0.3, 0.0], [-0.15, 3.0], [-0.15, -3.0]])
    bound = bounds.fine(build(target, 0.05, 2.0), arms, np.zeros((1, 3)), np.array([[0.5, 0.0]]))[0]
    moved = Pose.from_angle(0.5).apply(arms)
    assert bound <= np.minimum(np.square(moved - target).sum(axis=1), 1.0).mean()
