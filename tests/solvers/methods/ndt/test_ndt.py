"""NDT: cells kept and dropped, derivatives against differences, maps, the climb and its stops."""

from itertools import pairwise

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.methods.ndt import ndt, ndt_map
from solvers.methods.ndt.score import evaluate, score_map
from solvers.methods.ndt.translation import climb
from solvers.metrics import rre, rte
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
TWO_ISLANDS = np.repeat(np.array([[0.0, 0.0], [1e9, 1e9]]), 4, axis=0) + np.arange(16).reshape(8, 2) / 99.0
GRIDS = pytest.mark.parametrize("grids", [1, 4])


def by_hand(points, size, offset=(0.0, 0.0)):
    """The cells of one grid as a dictionary from lattice coordinates to the points there."""
    results = {}
    for p in points:
        results.setdefault(tuple(np.floor((p - offset) / size).astype(int)), []).append(p)
    return {k: np.array(v) for k, v in results.items()}


# ---- the map ----


@GRIDS
def test_cells_hold_the_mean_and_covariance_of_their_points(grids):
    """Against a plain dictionary, on every grid: counts, means, covariances divided by n, and which cells are kept."""
    cloud, h = room("combo").target, 0.9
    cells = ndt_map.build(cloud[None], h, offset=np.array([0.3, -0.2]), grids=grids)
    count = 0
    for g in range(grids):
        at = np.array([0.3, -0.2]) + h * ndt_map.SHIFTS[g]
        for key, points in by_hand(cloud, h, at).items():
            corner = at + h * np.array(key)
            (k,) = np.flatnonzero((cells.grid[0] == g) & (np.abs(cells.corner[0] - corner).max(axis=1) < 1e-9))
            count += 1
            assert cells.count[0, k] == len(points)
            np.testing.assert_allclose(cells.mean[0, k], points.mean(axis=0), atol=1e-13)
            np.testing.assert_allclose(cells.covariance[0, k], np.cov(points.T, ddof=0).reshape(2, 2) if len(points) > 1
                                       else np.zeros((2, 2)), atol=1e-14)  # fmt: skip
            assert cells.kept[0, k] == (len(points) >= 3)
            assert cells.dropped[0, k] == ("" if len(points) >= 3 else "fewer than 3 points")
    assert count == (cells.count[0] > 0).sum()


def test_the_small_eigenvalue_is_floored_and_points_at_one_place_are_dropped():
    """Points on a line get λ₂ = λ₁/1000 and keep λ₁; five points at one place, or a single one, make no Gaussian."""
    wall = np.column_stack([np.linspace(0.1, 0.9, 9), np.full(9, 0.5)])
    spot = np.full((5, 2), 3.5)
    result = ndt_map.build(np.vstack([wall, spot, [[8.2, 8.2]]])[None], 1.0)
    assert result.kept[0].tolist() == [True, False, False]
    assert result.dropped[0].tolist() == ["", "all points at one place", "fewer than 3 points"]
    values = np.linalg.eigvalsh(np.linalg.inv(result.precision[0, 0]))
    assert values[0] == pytest.approx(0.001 * values[1])
    assert values[1] == pytest.approx(np.var(wall[:, 0]))
    assert not result.precision[0, 1:].any()


@GRIDS
def test_the_table_finds_every_point_its_cell(rng, grids):
    """The look-up agrees with the corner test on each grid, inside and outside the map."""
    result = ndt_map.build(room("combo").target[None], 0.7, grids=grids)
    points = rng.uniform(-7.0, 7.0, (1, 500, 2))
    rows = result.lookup(points, np.zeros(1, dtype=np.int64))[0]
    for g in range(grids):
        in_grid = np.flatnonzero(result.kept[0] & (result.grid[0] == g))
        point_cell = np.floor((points[0] - result.origin[0, g]) / 0.7)
        cell = np.round((result.corner[0, in_grid] - result.origin[0, g]) / 0.7)
        hits = (point_cell[:, None] == cell).all(axis=2)
        expected = np.where(hits.any(axis=1), in_grid[hits.argmax(axis=1)], -1)
        np.testing.assert_array_equal(rows[g], expected)


def test_four_grids_are_the_first_moved_by_half_a_cell():
    cloud = room("noise").target
    four = ndt_map.build(cloud[None], 1.1, grids=4)
    for g, shift in enumerate(((0.0, 0.0), (0.55, 0.0), (0.0, 0.55), (0.55, 0.55))):
        single = ndt_map.build(cloud[None], 1.1, offset=np.array(shift))
        mine = four.kept[0] & (four.grid[0] == g)
        np.testing.assert_allclose(four.mean[0][mine], single.mean[0][single.kept[0]], atol=1e-14)
    with pytest.raises(ValueError, match="grids"):
        ndt_map.build(cloud[None], 1.1, grids=3)


def test_far_from_the_origin_no_digits_are_lost():
    cloud = np.round(room("noise").target * 2.0**20) / 2.0**20
    near, far = (ndt_map.build(cloud[None] + at, 1.0) for at in (0.0, 2.0**20))
    np.testing.assert_allclose(far.covariance, near.covariance, atol=1e-15)
    np.testing.assert_array_equal(far.kept, near.kept)


# ---- the score ----


def no_change_of_cell(cells, points, poses):
    rows = [cells.lookup(p.apply(points)[None], np.zeros(1, dtype=np.int64)) for p in poses]
    return all((r == rows[0]).all() for r in rows)


@GRIDS
@pytest.mark.parametrize("about", ["pose", "centroid"])
def test_gradient_and_hessian_agree_with_differences(rng, grids, about):
    """f, ∂f and ∂²f by (tx, ty, φ) against central differences, at random poses where no point changes its cell on any
    grid, about the pose's own translation and about the moved centroid."""
    scene = room("combo")
    cells = ndt_map.build(scene.target[None], 1.2, grids=grids)
    count, h = 0, 2e-6
    while count < 12:
        pose = Pose.from_angle(rng.uniform(-0.4, 0.4), rng.uniform(-0.8, 0.8, 2))
        pivot = pose.t if about == "pose" else pose.apply(scene.source).mean(axis=0)
        points = scene.source[rng.permutation(len(scene.source))[:25]]

        def at(step, pose=pose, pivot=pivot):
            return ndt.moved_by(Pose(pose.R[None], pose.t[None]), np.asarray(step)[None], pivot[None])[0]

        steps = h * np.vstack([np.eye(3), -np.eye(3)])
        if not no_change_of_cell(cells, points, [pose, *(at(s) for s in steps)]):
            continue
        count += 1

        def score(step, at=at, points=points, pivot=pivot):
            # The pivot moves with the points: derivatives are taken at the pose reached, by the same kind of step.
            return evaluate(cells, at(step).apply(points)[None], (pivot + np.asarray(step)[:2])[None])

        result = score(np.zeros(3))
        pairs = [(score(s), score(-s)) for s in steps[:3]]
        gradient = [-(a.score[0] - b.score[0]) / (2 * h) for a, b in pairs]
        hessian = [(a.gradient[0] - b.gradient[0]) / (2 * h) for a, b in pairs]
        np.testing.assert_allclose(result.gradient[0], gradient, rtol=1e-6, atol=1e-6 * np.abs(gradient).max())
        size = np.abs(result.hessian[0]).max()
        np.testing.assert_allclose(result.hessian[0], np.array(hessian), rtol=1e-5, atol=1e-6 * size)
        np.testing.assert_array_equal(result.hessian[0], result.hessian[0].T)


def test_about_the_poses_translation_the_angle_is_the_poses_own():
    """With pivot t the derivatives are those of f(tx, ty, φ) with T(p) = R(φ) p + t, a pose's usual parameters."""
    scene = room("noise")
    cells = ndt_map.build(scene.target[None], 2.4)
    points = scene.source[::9]
    x = np.array([0.11, -0.07, 0.2])

    def f(x):
        moved = Pose.from_angle(x[2], x[:2]).apply(points)[None]
        return evaluate(cells, moved, x[None, :2])

    h, steps = 1e-6, 1e-6 * np.eye(3)
    poses = [Pose.from_angle(y[2], y[:2]) for y in (x, *(x + steps), *(x - steps))]
    assert no_change_of_cell(cells, points, poses)
    slope = [-(f(x + s).score[0] - f(x - s).score[0]) / (2 * h) for s in steps]
    np.testing.assert_allclose(f(x).gradient[0], slope, rtol=1e-6, atol=1e-6)


def test_the_score_is_the_sum_it_is_said_to_be():
    """Pair by pair: exp(−½ qᵀΣ⁻¹q) for a point's cell, zero for an empty cell, and no determinant factor."""
    scene = room("combo")
    cells = ndt_map.build(scene.target[None], 1.2, grids=4)
    moved = Pose.from_angle(0.1, (0.2, -0.1)).apply(scene.source)
    result = evaluate(cells, moved[None], np.zeros((1, 2)))
    total = 0.0
    for g in range(4):
        for i, x in enumerate(moved):
            k = result.cells[0, g, i]
            q = x - cells.mean[0, k]
            s = np.exp(-0.5 * q @ cells.precision[0, k] @ q) if k >= 0 else 0.0
            assert result.values[0, g, i] == pytest.approx(s, abs=1e-15)
            total += s
    assert result.score[0] == pytest.approx(total)


@GRIDS
def test_a_score_map_is_the_score_at_each_translation(rng, grids):
    """60 × 60 translations at once score the same as one by one; a coarse map is every third row and column of it."""
    scene = room("combo")
    cells = ndt_map.build(scene.target[None], 1.2, grids=grids)
    turned = Pose.from_angle(0.2).apply(scene.source)
    x, y = np.linspace(-3.0, 3.0, 60), np.linspace(-2.0, 5.0, 60)
    result = score_map(cells, turned, x, y)
    assert result.shape == (60, 60)
    for i, j in rng.integers(0, 60, (20, 2)):
        value = evaluate(cells, (turned + np.array([x[i], y[j]]))[None], np.zeros((1, 2)))
        assert result[j, i] == pytest.approx(value.score[0], rel=1e-12, abs=1e-12)
    np.testing.assert_allclose(score_map(cells, turned, x[::3], y[::3]), result[::3, ::3], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(score_map(cells, turned, x, y[7:9]), result[7:9], rtol=1e-12, atol=1e-12)
    assert not score_map(cells, turned, x + 100.0, y).any()


@GRIDS
def test_a_score_map_takes_translations_in_any_order(rng, grids):
    """Shuffled, repeated and single translations score exactly the same; points that are nowhere add nothing, and
    neither do grids without kept cells."""
    scene = room("combo")
    cells = ndt_map.build(scene.target[None], 1.2, grids=grids)
    x, y = np.linspace(-3.0, 3.0, 31), np.linspace(-2.0, 5.0, 23)
    result = score_map(cells, scene.source, x, y)
    i, j = rng.integers(0, 31, 40), rng.permutation(23)
    assert np.array_equal(score_map(cells, scene.source, x[i], y[j]), result[np.ix_(j, i)])
    assert score_map(cells, scene.source, x[4:5], y[9:10]) == result[9, 4]
    nowhere = np.concatenate([[[np.nan, 0.0]], scene.source, [[0.0, np.inf], [1e300, -1e300]]])
    assert np.array_equal(score_map(cells, nowhere, x, y), result)
    empty = ndt_map.build(np.array([[[0.0, 0.0], [9.0, 9.0]]]), 1.2, grids=grids)
    assert not score_map(empty, scene.source, x, y).any()


# ---- the run ----


@pytest.mark.parametrize("seed", [40, 53, 66])
def test_each_level_only_climbs(seed):
    """The score never falls within a level, no step exceeds its caps, and the levels go from coarse to fine."""
    scene, states = room("combo", seed=seed), []
    register(
        scene.source, scene.target, "ndt", start=room_start(30.0, 0.8), cells=(2.4, 1.2, 0.6), max_shift=0.5,
        callback=lambda k, s: states.append(s),
    )  # fmt: skip
    levels = [int(s.level[0]) for s in states]
    assert levels == sorted(levels)
    assert levels[-1] == 2
    for a, b in pairwise(states):
        if a.level[0] == b.level[0]:
            assert b.at.score[0] >= a.at.score[0]
            assert b.accepted[0] == (b.at.score[0] > a.at.score[0])
        assert np.hypot(*b.step[0, :2]) <= 0.5 * (1 + 1e-12)
        assert abs(b.step[0, 2]) <= 0.2 * (1 + 1e-12)


def test_from_nearby_the_truth_is_found():
    """Of 25 seeds of the noisy room, started 10° and 0.3 u off, at least 24 end within 3°, and half within 0.08 u."""
    scenes = [room("noise", seed=seed) for seed in SEEDS]
    result = register(
        np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), "ndt", start=room_start(10.0, 0.3),
        cells=(2.4, 1.2), max_shift=0.5,
    )  # fmt: skip
    assert (rre(result.pose, Pose.identity()) < np.radians(3.0)).sum() >= 24
    assert np.median(rte(result.pose, Pose.identity())) < 0.08


def test_a_large_motion_far_from_the_origin_is_composed_the_right_way():
    """A truth of 150° and 40 u, started 8° and 0.2 u off it, is found as well as at the origin."""
    scene = room("noise")
    truth = Pose.from_angle(np.radians(150.0), (30.0, -25.0))
    target = truth.apply(scene.target)
    start = truth.compose(room_start(8.0, 0.2))
    result = register(scene.source, target, "ndt", start=start, cells=(2.4, 1.2), max_shift=0.5)
    assert rre(result.pose, truth) < np.radians(2.0)
    assert np.abs(result.transform(scene.source) - truth.apply(scene.source)).max() < 0.25


def test_a_batch_is_its_single_runs():
    scenes = [room("combo", seed=seed) for seed in SEEDS[:5]]
    source, target = (np.stack([getattr(s, x) for s in scenes]) for x in ("source", "target"))
    options = {"start": room_start(25.0, 0.7), "cells": (2.4, 1.2), "max_shift": 0.5}
    batch = register(source, target, "ndt", **options)
    for i in range(5):
        alone = register(source[i], target[i], "ndt", **options)
        assert alone.steps == batch.steps[i]
        assert alone.status == batch.status[i]
        np.testing.assert_allclose(alone.pose.matrix, batch.pose.matrix[i], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "source", "target", "options", "words"),
    [
        ("no overlap", room().source + 100.0, room().target, {}, "no moved point"),
        ("two target points", room().source, np.eye(2), {}, "no cell"),
        ("coincident target", room().source, np.full((9, 2), 0.25), {}, "no cell"),
        ("coincident source", np.full((9, 2), 0.1), np.random.default_rng(0).normal(0, 0.5, (60, 2)), {"cells": 1.0},
         "change along"),
        ("small cells", room().source, TWO_ISLANDS, {"cells": 0.7}, "too small"),
    ],
)  # fmt: skip
def test_hopeless_scenes_are_degenerate_and_leave_the_batch_alone(name, source, target, options, words):
    good = room("noise")
    result = register([good.source, source], [good.target, target], "ndt", **options)
    assert result.status[1] == Status.DEGENERATE
    assert words in result.reason[1]
    assert result.status[0] in (Status.CONVERGED, Status.STALLED)
    assert np.isfinite(result.pose.matrix).all()


def test_a_wall_is_harder_along_itself():
    """On one straight wall the only curvature along it comes from the cells: the condition number is more than three
    times the room's."""
    rng = np.random.default_rng(5)
    wall = np.column_stack([rng.uniform(-5.0, 5.0, 300), 0.02 * rng.standard_normal(300)])
    alone = register(wall[::2], wall[1::2], "ndt", cells=1.5, max_steps=0).states[0]
    scene = room("clean")
    corner = register(scene.source, scene.target, "ndt", cells=1.5, max_steps=0).states[0]
    assert alone.condition[0] > 3.0 * corner.condition[0]


@GRIDS
def test_along_a_wall_only_the_pattern_of_the_cells_is_left(grids):
    """On a long, evenly sampled wall, the smallest curvature is along it. Sliding by whole cells leaves the score
    unchanged, sliding by part of one does not, and 0.1 u across the wall nothing is left of it."""
    h, x = 1.5, (np.arange(1200) - 599.5) * 0.05
    wall = np.column_stack([x, 0.4 + 0.02 * np.sin(2.0 * np.pi * x / (h / 5.0))])  # rough, alike in all cells
    scan = wall[np.abs(x) < 6.4]
    cells = ndt_map.build(wall[None], h, grids=grids)

    def score(*shift):
        at = evaluate(cells, (scan + shift)[None], np.zeros((1, 2)), derivatives=False)
        return float(at.score[0]) / (len(scan) * grids)

    whole = [score(k * h, 0.0) for k in range(-3, 4)]
    np.testing.assert_allclose(whole, whole[0], rtol=1e-9)
    assert np.ptp([score(k * h / 10, 0.0) for k in range(10)]) > 1e-3 / grids
    assert score(0.0, 0.1) < 0.01 * whole[0]
    hessian = evaluate(cells, (scan + np.array([0.2, 0.0]))[None], np.zeros((1, 2))).hessian[0, :2, :2]
    size, vectors = np.linalg.eigh(hessian)
    assert abs(vectors[0, np.abs(size).argmin()]) > 0.999
    assert np.abs(size).max() > 100.0 * np.abs(size).min()


def test_the_climb_over_translations_shows_accepted_and_rejected_steps():
    """Accepted scores rise, rejected ones do not exceed that of the place they started from, and the first is the
    start."""
    scene = room("combo")
    cells = ndt_map.build(scene.target[None], 1.2, grids=4)
    rejections = 0
    for x in np.linspace(-1.5, 1.5, 5):
        path = climb(cells, scene.source, np.array([x, 0.7]))
        assert path.status in (Status.CONVERGED, Status.STALLED)
        assert path.accepted[0]
        np.testing.assert_array_equal(path.tried[0], [x, 0.7])
        best, position = path.score[0], path.tried[0]
        for t, s, ok in zip(path.tried[1:], path.score[1:], path.accepted[1:], strict=True):
            assert ok == (s > best)
            assert np.linalg.norm(t - position) <= 0.6 * (1 + 1e-9)
            best, position = (s, t) if ok else (best, position)
        rejections += int((~path.accepted).sum())
        np.testing.assert_array_equal(path.places[-1], position)
        exact = evaluate(cells, (scene.source + position)[None], np.zeros((1, 2))).score[0]
        assert exact == pytest.approx(path.score.max())
    assert rejections > 0
    assert climb(cells, scene.source, np.array([50.0, 0.0])).status is Status.DEGENERATE
    assert climb(cells, scene.source, np.array([0.5, 0.5]), max_steps=1).status is Status.CAPPED


def test_translation_alone_does_not_repair_a_rotation():
    """With the rotation 25° off, the best score over translations stays below 70 % of that at the truth."""
    scene = room("clean")
    cells = ndt_map.build(scene.target[None], 1.2, grids=4)
    x = np.linspace(-2.0, 2.0, 41)
    wrong = score_map(cells, Pose.from_angle(np.radians(25.0)).apply(scene.source), x, x).max()
    assert wrong < 0.7 * evaluate(cells, scene.source[None], np.zeros((1, 2))).score[0]


@pytest.mark.parametrize("method", ["ndt", "ndt-d2d"])
def test_on_a_circle_the_centre_is_found_and_the_turn_is_weak(method):
    """Only the cells distinguish one turn of a circle from another: the run finds the centre and ends near its initial
    turn, and the Hessian's weak direction is the angle, at a condition number far above the room's."""
    circles = []
    for n, phase in ((300, 0.0), (200, 0.3)):
        angle = 2.0 * np.pi * (np.arange(n) + phase) / n
        circles.append(3.0 * np.column_stack([np.cos(angle), np.sin(angle)]))
    for turn in (0.0, 0.2, 1.0):
        start = Pose.from_angle(turn, (0.3, -0.2))
        result = register(circles[1], circles[0], method, start=start, cells=(2.4, 1.2))
        state = result.states[0]
        assert np.abs(result.pose.t).max() < 0.01
        assert abs(result.pose.angle - turn) < 0.15
        assert state.condition[0] > 200.0
        assert abs(state.weak[0, 2]) > 0.999
    scene = room("clean")
    assert register(scene.source, scene.target, method, cells=1.2, max_steps=0).states[0].condition[0] < 50.0


@pytest.mark.parametrize("method", ["ndt", "ndt-d2d", "point-to-plane", "gicp"])
def test_where_all_is_outliers_nothing_is_claimed_but_a_stop(method):
    """For two clouds of junk the pose is finite and the status says how the run ended, whatever it found."""
    scenes = [room("clean", seed=seed, outliers=1.0) for seed in SEEDS[:5]]
    result = register(np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), method, max_steps=200)
    assert np.isfinite(result.pose.matrix).all()
    assert np.isin(result.status, (Status.CONVERGED, Status.STALLED, Status.DEGENERATE)).all()
    assert (result.reason != "").all()


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"cells": ()}, "cells"), ({"cells": "1.2"}, "cells"), ({"cells": (1.0, -1.0)}, "cells"),
        ({"grids": 2}, "grids"), ({"offset": (1.0,)}, "offset"), ({"max_shift": 0.0}, "max_shift"),
        ({"max_turn": -1.0}, "max_turn"), ({"halvings": -1}, "halvings"),
    ],
)  # fmt: skip
def test_refusals_name_the_option(options, name):
    with pytest.raises(ValueError, match=rf"^{name}"):
        register(np.eye(2), np.eye(2), "ndt", **options)
