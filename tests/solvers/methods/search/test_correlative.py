"""The correlative search: its table, its bounds, exhaustive enumeration, the runner-up, hopeless scenes."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import METHODS, Pose, Status, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.search.lattice import WORTH, Window, build
from solvers.metrics import rre, rte
from solvers.scenes.rooms import ROOM_SETTINGS, room, room_start
from solvers.scenes.walls import hall
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

EVERYWHERE = Window(None, 1.0, None, None, None)


def table(lattice, level=0):
    return lattice.tables[level].reshape(-1, lattice.width)


def every_sum(lattice, source):
    """The sums of all poses (angles, rows, columns), computed point by point from just the angles and the table."""
    sums = np.zeros((len(lattice.angles), lattice.rows, lattice.columns), dtype=np.int64)
    p = np.ldexp(source - lattice.centroid, -lattice.exponent)
    for k, angle in enumerate(lattice.angles):
        points = p @ Pose.from_angle(angle).R.T
        for column, row in np.floor(points / lattice.cell).astype(int) + lattice.margin:
            sums[k] += table(lattice)[row : row + lattice.rows, column : column + lattice.columns]
    return sums


def small_scene(seed):
    """A thinned room and a part of it turned by a random angle."""
    rng = np.random.default_rng(seed)
    scene = room("combo", seed=seed)
    truth = Pose.from_angle(rng.uniform(-np.pi, np.pi), rng.uniform(-3.0, 3.0, 2))
    return truth.inverse().apply(scene.source[5:90:4]), scene.target[::3]


@pytest.mark.parametrize("options", [{}, {"blur": 0.3}, {"cell": 0.9, "apart": 0.6}, {"turn": 0.8, "shift": 1.7}])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_search_answers_as_exhaustive_enumeration_does(seed, options):
    """The score is the highest of all poses, the runner-up's the highest of all that are not neighbours of the best."""
    source, target = small_scene(seed)
    result = register(source, target, "correlative", **{"cell": 0.5, **options})
    assert result.status is Status.CONVERGED
    lattice = result.states[0].lattice[0]
    sums = every_sum(lattice, source)
    assert sums.size == result.detail("poses")
    angle, column, row = result.detail("place")
    assert sums[angle, row, column] == sums.max()
    assert result.detail("score") == sums.max() / (WORTH * len(source))
    assert result.objective == 1.0 - result.detail("score")

    k, y, x = np.indices(sums.shape)
    moved = np.square(x - column) + np.square(y - row)
    arc = 2.0 * lattice.radius * np.sin(0.5 * (lattice.angles[k] - lattice.angles[angle]))
    apart = options.get("apart", 0.25) * lattice.radius
    far = np.square(lattice.cell) * moved + np.square(arc) > np.square(apart)
    assert result.detail("runner_score") == sums[far].max() / (WORTH * len(source))
    angle, column, row = result.detail("runner_place")
    assert far[angle, row, column]
    assert sums[angle, row, column] == sums[far].max()


def test_the_table_is_the_blurred_target():
    """Each cell holds 255 exp(−d²/2σ²), rounded, where d is its centre's distance from the nearest target point."""
    source, target = small_scene(4)
    for blur in (0.6, 1.0, 2.5):
        lattice = build(source, target, Pose.identity(), Window(0.4, blur, None, None, None))
        height, width = table(lattice).shape
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        centres = lattice.low + lattice.cell * (np.stack([x, y], axis=-1) - lattice.margin)
        q = np.ldexp(target - lattice.middle, -lattice.exponent)
        gaps = np.linalg.norm(centres[:, :, None] - q, axis=-1).min(axis=-1) / lattice.cell
        worth = np.rint(WORTH * np.exp(-np.square(gaps) / (2.0 * blur**2)))
        near = gaps < 3.0 * blur  # a stamp may end further out
        assert (table(lattice)[near] == worth[near]).all()
        assert table(lattice)[~near].max() <= np.ceil(WORTH * np.exp(-4.5))


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(st.integers(0, 10**6), st.integers(1, 4), st.floats(0.3, 3.0))
def test_no_pose_of_a_square_exceeds_its_bound(seed, level, blur):
    """For any square of any lattice, even one that extends over the rim, the bound is at least the sum of each pose in
    it, and at most what doubling the window allows."""
    rng = np.random.default_rng(seed)
    source, target = rng.standard_normal((7, 2)), 2.0 * rng.standard_normal((9, 2))
    lattice = build(source, target, Pose.identity(), Window(0.3, blur, 0.5, None, None))
    level = min(level, lattice.levels)
    angle = rng.integers(len(lattice.angles))
    column, row = rng.integers(lattice.columns), rng.integers(lattice.rows)
    x, y = np.meshgrid(np.arange(column, min(column + 2**level, lattice.columns)),
                       np.arange(row, min(row + 2**level, lattice.rows)))  # fmt: skip
    inside = np.stack([np.full(x.size, angle), x.ravel(), y.ravel()], axis=1)
    bound = lattice.bounds(level, np.array([[angle, column, row]]))[0]
    assert bound >= lattice.bounds(0, inside).max()
    assert bound >= lattice.bounds(level - 1, inside[:1])[0]


@pytest.mark.parametrize("setting", ROOM_SETTINGS)
def test_the_room_is_found_from_nothing(setting):
    """Six draws, each turned by another angle: found to within 5° and 0.2 u after scoring under a tenth of the poses;
    the runner-up scores at most 0.85 of that."""
    for seed in SEEDS[:6]:
        scene = room(setting, seed=seed)
        turn = Pose.from_angle(float(seed), (seed / 30.0, -1.0))
        result = register(turn.apply(scene.source), scene.target, "correlative")
        pose = result.pose.compose(turn)
        assert result.status is Status.CONVERGED
        assert rre(pose, scene.truth) < np.radians(5.0)
        assert rte(pose, scene.truth) < 0.2
        assert result.detail("nodes") < 0.1 * result.detail("poses")
        assert result.detail("runner_score") < 0.85 * result.detail("score")


def test_the_hall_has_a_runner_up_half_a_turn_away():
    """25 draws of a hall that looks the same after half a turn: the runner-up is 177° to 180° from the best pose and
    scores more than 0.97 of it; the best pose is the truth in 5 to 20 of them."""
    right = 0
    for seed in SEEDS:
        scene = hall(seed=seed)
        result = register(scene.source, scene.target, "correlative")
        difference = result.pose.inverse().compose(result.detail("runner_up"))
        assert abs(difference.angle) > np.radians(177.0)
        assert 0.97 < result.detail("runner_score") / result.detail("score") <= 1.0
        right += bool(rre(result.pose, scene.truth) < np.radians(5.0))
    assert 5 <= right <= 20


def test_the_runner_up_moves_the_points_away():
    """It moves them by more than `apart` radii (RMS) from where the best pose puts them."""
    source, target = small_scene(7)
    radius = np.sqrt(np.square(source - source.mean(axis=0)).sum(axis=1).mean())
    for apart in (0.0, 0.25, 0.7):
        result = register(source, target, "correlative", cell=0.5, apart=apart)
        way = result.pose.apply(source) - result.detail("runner_up").apply(source)
        assert np.sqrt(np.square(way).sum(axis=1).mean()) > apart * radius * (1.0 - 1e-9)
    single = register(source, target, "correlative", cell=0.5, apart=100.0)
    assert single.status is Status.CONVERGED
    assert single.detail("runner_score") == 0.0
    assert single.detail("runner_place").tolist() == [-1, -1, -1]
    assert np.array_equal(single.detail("runner_up").matrix, np.eye(3))


def test_a_pose_scores_what_its_points_fall_on():
    """The final score is that of the returned pose; the initial one is that of the start."""
    source, target = small_scene(5)
    result = register(source, target, "correlative", start=room_start())
    lattice = result.states[0].lattice[0]
    # A point exactly on a cell's rim may fall to either side of it.
    assert lattice.score(result.pose, source) == pytest.approx(result.detail("score"), abs=1.0 / len(source))
    assert result.history.objective[0] == 1.0 - lattice.score(room_start(), source)
    assert lattice.score(Pose.from_angle(0.0, (1e100, 0.0)), source) == 0.0


def test_the_start_plays_no_part_without_a_window():
    source, target = small_scene(6)
    results = [register(source, target, "correlative", start=start) for start in (None, room_start(170.0, 50.0))]
    assert np.array_equal(results[0].matrix, results[1].matrix)


@pytest.mark.parametrize("turn", [0.3, 0.8, 2.0])
def test_the_angles_of_a_window_fill_it_and_do_not_leave_it(turn):
    """To less than a step, for the steps that are chosen by default."""
    source, target = small_scene(8)
    angles = register(source, target, "correlative", turn=turn, cell=0.5, max_steps=0).states[0].lattice[0].angles
    step = np.diff(angles).mean()
    for end in (-angles[0], angles[-1]):
        assert turn - step < end <= turn + 1e-9


def test_a_window_keeps_the_search_about_the_start():
    """Angle and centroid stay within the window around the start; a window of only the start returns the start."""
    source, target = small_scene(8)
    start = Pose.from_angle(2.0, (0.4, -0.3))
    result = register(source, target, "correlative", start=start, turn=0.3, shift=0.8)
    difference = result.pose.compose(start.inverse())
    assert abs(difference.angle) <= 0.3 + 1e-12
    centroid = source.mean(axis=0)[None]
    assert np.abs(result.pose.apply(centroid) - start.apply(centroid)).max() <= 0.8 + 1e-12
    only = register(source, target, "correlative", start=start, turn=0.0, shift=0.0)
    assert only.detail("poses") == 1
    assert np.allclose(only.matrix, start.matrix, atol=1e-12)
    failure = register(source, target, "correlative", start=Pose.from_angle(0.0, (90.0, 0.0)), shift=2.0)
    assert failure.status is Status.DEGENERATE
    assert "nothing overlaps within 2 u of the start" in failure.reason


@pytest.mark.parametrize("offset", [-0.7, 0.0, 0.7])
def test_a_window_reaches_to_both_sides_of_the_start(offset):
    """From starts 0.7 rad off, either way, the room is found in a window of 0.8 rad, and not in one of 0.5 rad."""
    scene = room("clean", seed=40)
    start = Pose.from_angle(offset).compose(scene.truth)
    for turn, hits in ((0.8, True), (0.5, offset == 0.0)):
        pose = register(scene.source, scene.target, "correlative", start=start, turn=turn).pose
        assert (rre(pose, scene.truth) < np.radians(5.0)) == hits, turn


@pytest.mark.parametrize(("unit", "shift"), [(0.5, 0.0), (2.0**40, 0.0), (2.0**-300, 0.0), (1.0, 4096.0)])
def test_unit_and_origin_change_nothing(unit, shift):
    """In another unit, or with both clouds elsewhere, the grid, the best pose on it and its score are the same."""
    source, target = small_scene(9)
    source, target = (np.round(cloud * 2.0**20) / 2.0**20 for cloud in (source, target))
    plain = register(source, target, "correlative")
    second = register(unit * source, unit * target + shift, "correlative")
    assert second.detail("place").tolist() == plain.detail("place").tolist()
    assert second.detail("score") == plain.detail("score")
    assert np.allclose(second.pose.R, plain.pose.R, atol=1e-12)
    assert np.allclose((second.pose.t - shift) / unit, plain.pose.t, atol=1e-9)


def test_a_batch_gives_what_each_problem_gives_alone():
    """They agree bit for bit, even with a hopeless problem among them."""
    scenes = [small_scene(seed) for seed in (1, 2, 3)]
    source, target = (np.stack(clouds) for clouds in zip(*scenes, strict=True))
    source[1] = 0.5
    batch = register(source, target, "correlative")
    assert batch.status.tolist() == [Status.CONVERGED, Status.DEGENERATE, Status.CONVERGED]
    for i in (0, 2):
        alone = register(source[i], target[i], "correlative")
        assert np.array_equal(alone.matrix, batch.matrix[i])
        assert alone.steps == batch.steps[i]
        for name in ("score", "runner_score", "nodes"):
            assert alone.detail(name) == batch.detail(name)[i]


def test_a_step_at_a_time_the_best_only_improves_and_a_cap_is_said():
    scene = room("combo", seed=53)
    problem = Problem(
        scene.source[None], scene.target[None], np.ones((1, len(scene.source))), Pose.identity(2, (1,)), np.array([53])
    )
    batch = advance(begin(METHODS["correlative"], problem, METHODS["correlative"].options(per_step=4)))
    scores = [batch.state().score[0]]
    for _ in range(40):
        batch = advance(batch)
        scores.append(batch.state().score[0])
    assert scores == sorted(scores)
    whole = register(scene.source, scene.target, "correlative")
    for per_step in (1, 1000):
        result = register(scene.source, scene.target, "correlative", per_step=per_step, max_steps=20_000)
        assert result.detail("score") == whole.detail("score")
        assert result.detail("runner_score") == whole.detail("runner_score")
    short = register(scene.source, scene.target, "correlative", per_step=4, max_steps=3)
    assert short.status is Status.CAPPED
    assert 0.0 < short.detail("score") <= whole.detail("score")


def test_scenes_without_an_answer():
    source, target = small_scene(1)
    for clouds, words in (
        ((np.ones((5, 2)), target), "all source points are equal"),
        ((source, np.ones((5, 2))), "all target points are equal"),
        ((1e-9 * source, target), "all source points lie within one cell"),
        ((source, 1e-9 * target), "all target points lie within one cell"),
    ):
        result = register(*clouds, "correlative")
        assert result.status is Status.DEGENERATE
        assert words in result.reason
        assert np.array_equal(result.matrix, np.eye(3))
    for cell in (1e-3, 1e-6):
        fine = register(source, target, "correlative", cell=cell)
        assert fine.status is Status.DEGENERATE
        assert "cells are too small" in fine.reason


def test_too_many_source_points_are_not_blamed_on_the_cells():
    source = np.random.default_rng(2).uniform(-2.0, 2.0, (70_000, 2))
    message = r"70000 source points at \d+ angles are too many: thin the source, or give a larger cell or angle"
    assert re.fullmatch(message, build(source, source[:5000], Pose.identity(), EVERYWHERE))
    assert not isinstance(build(source[::100], source[:5000], Pose.identity(), EVERYWHERE), str)


@pytest.mark.parametrize(
    ("option", "value"),
    [("cell", 0.0), ("blur", 0.0), ("blur", 9.0), ("angle", 0.0), ("shift", -1.0), ("turn", 4.0), ("apart", -0.1),
     ("per_step", 0)],
)  # fmt: skip
def test_wrong_options_are_named(option, value):
    with pytest.raises(ValueError, match=rf"^{option}: "):
        register(np.eye(3)[:, :2], np.eye(3)[:, :2], "correlative", **{option: value})


@pytest.mark.parametrize("distance", [1e3, 1e7])
def test_a_stray_does_not_widen_the_field(distance):
    """A point far away in one cloud or in both leaves grid and answer unchanged; in the source, the score counts it as
    a point that hits nothing."""
    scene = room("noise")
    alone = register(scene.source, scene.target, "correlative")
    source = np.vstack([[[-distance, 0.5 * distance]], scene.source])
    target = np.vstack([scene.target, [[distance, -0.3 * distance]]])
    m = len(scene.source)
    for p, q in ((scene.source, target), (source, scene.target), (source, target)):
        result = register(p, q, "correlative")
        assert np.array_equal(result.matrix, alone.matrix)
        assert np.array_equal(result.detail("runner_up").matrix, alone.detail("runner_up").matrix)
        assert result.detail("poses") == alone.detail("poses")
        assert result.detail("score") == pytest.approx(alone.detail("score") * m / len(p), rel=1e-12)
        # A start may put the stray on the target and the rest of the source far away.
        assert result.states[0].lattice[0].score(Pose.from_angle(0.0, (distance, -0.5 * distance)), p) == 0.0
