"""Batches of one cloud with many starts: shared data are computed once and not copied, and the answers are the same."""

from dataclasses import dataclass

import numpy as np
import pytest

from solvers import METHODS, Pose, register
from solvers.core.arrays import FloatArray
from solvers.core.tree import distinct, once, put, take
from solvers.geometry import nearest
from solvers.geometry.normals import normals
from solvers.methods.ndt import ndt_map, score
from solvers.scenes.rooms import room, room_start

NETWORKS = ("flow", "flow-from-source")


@dataclass(frozen=True, eq=False)
class Halves:
    low: FloatArray
    high: FloatArray | None


def broadcast(cloud, b):
    return np.broadcast_to(cloud, (b, *cloud.shape))


def test_what_repeats_is_made_once_and_all_see_it(rng):
    """For clouds that differ, or for equal copies, it is computed for each."""
    cloud, lengths = rng.standard_normal((6, 2)), []

    def halves(points):
        lengths.append(len(points))
        return Halves(points[:, :3], None)

    results = [once(halves, clouds) for clouds in (broadcast(cloud, 5), np.stack([cloud] * 5), cloud[None])]
    assert lengths == [1, 5, 1]
    assert [m.low.shape for m in results] == [(5, 3, 2), (5, 3, 2), (1, 3, 2)]
    assert (results[0].low == results[1].low).all()
    assert [len(distinct(m.low)) for m in results] == [1, 5, 1]


def test_a_batch_repeats_only_if_all_its_parts_do(rng):
    cloud = rng.standard_normal((4, 2))
    sizes = []
    for high in (broadcast(cloud, 3), np.stack([cloud] * 3), None):
        once(lambda parts: sizes.append(len(parts.low)) or parts, Halves(broadcast(cloud, 3), high))
    assert sizes == [1, 3, 1]


@pytest.mark.parametrize("rows", [np.array([2, 0]), np.array([True, False, True, False]), np.array([], dtype=np.int64)])
def test_rows_of_what_repeats_are_not_copied(rows, rng):
    """Rows are views that equal rows of copies; writing back to them makes a copy."""
    cloud = rng.standard_normal((5, 2))
    whole, copies = Halves(broadcast(cloud, 4), None), Halves(np.stack([cloud] * 4), None)
    part = take(whole, rows)
    np.testing.assert_array_equal(part.low, take(copies, rows).low)
    assert len(part.low) == 0 or np.shares_memory(part.low, cloud)
    result = put(whole, rows, Halves(np.zeros((len(part.low), 5, 2)), None))
    np.testing.assert_array_equal(result.low[rows], 0.0)
    assert (whole.low == cloud).all()


def test_index_normals_and_maps_of_one_cloud_are_made_once():
    """They equal those of copies; cells of several sizes need several maps."""
    cloud = room("clean", seed=40).target
    clouds = broadcast(cloud, 3), np.stack([cloud] * 3)
    indices = [nearest.build(x) for x in clouds]
    surfaces = [normals(x) for x in indices]
    maps = [ndt_map.build(x, 1.3, grids=4) for x in clouds]
    for (shared, copies), names in (
        (indices, ("points", "centre", "product", "radius", "extent")),
        (surfaces, ("vectors", "flagged", "eigenvalues")),
        (maps, ("mean", "precision", "table", "first", "reason", "dropped")),
    ):
        for name in names:
            assert len(distinct(getattr(shared, name))) == 1
            np.testing.assert_array_equal(getattr(shared, name), getattr(copies, name))
    sizes = np.array([1.0, 1.3, 1.6])
    several = [ndt_map.build(x, sizes) for x in clouds]
    np.testing.assert_array_equal(several[0].table, several[1].table)
    assert len({tuple(t) for t in several[0].first[:, 0]}) > 1


@pytest.mark.native
def test_one_tree_answers_for_all_starts(rng):
    """Rows and squares equal those of copies and are those of each problem's own points, and they can be followed."""
    pytest.importorskip("scipy")
    cloud, points = rng.standard_normal((500, 2)), rng.standard_normal((3, 40, 2))
    shared, copies = (nearest.build(x, tree_from=1) for x in (broadcast(cloud, 3), np.stack([cloud] * 3)))
    assert len(distinct(shared.trees)) == 1
    for index in (shared, take(shared, np.array([True, True, False])), take(shared, np.array([2]))):
        b = len(index.points)
        rows, squares, known = index.follow(points[:b], None)
        answer, expected, _ = take(copies, np.arange(b)).follow(points[:b], None)
        np.testing.assert_array_equal(rows, answer)
        np.testing.assert_array_equal(squares, expected)
        np.testing.assert_array_equal(squares, np.square(points[:b, :, None] - cloud).sum(axis=-1).min(axis=-1))
        assert known is not None


@pytest.mark.parametrize("shared", [True, False])
def test_ndt_scores_in_blocks_as_in_one(shared, monkeypatch):
    """With several clouds, each point set scored on its own map in any order, and with one map shared by all."""
    clouds = np.stack([room("outliers", seed=40 + (0 if shared else i)).target for i in range(3)])
    cells = ndt_map.build(broadcast(clouds[0], 3) if shared else clouds, 1.3, grids=4)
    rows = np.array([2, 0, 1, 1, 2, 0, 0])
    moved = clouds[rows] + 0.01 * np.arange(7)[:, None, None]
    pivot = moved.mean(axis=1)
    whole = score.evaluate(cells, moved, pivot, rows)
    parts = [score.evaluate(take(cells, rows[i : i + 1]), moved[i : i + 1], pivot[i : i + 1]) for i in range(7)]
    for limit in (1, 2 * 4 * moved.shape[1]):
        monkeypatch.setattr(score, "TOGETHER", limit)
        blocks = score.evaluate(cells, moved, pivot, rows)
        for name in ("score", "gradient", "hessian", "cells", "values"):
            np.testing.assert_array_equal(getattr(blocks, name), getattr(whole, name))
    np.testing.assert_array_equal(whole.gradient, np.concatenate([part.gradient for part in parts]))
    assert len(set(whole.score)) == 7


@pytest.mark.parametrize("method", METHODS)
def test_many_starts_of_one_pair_end_as_copies_of_it_do(method):
    """They agree bit for bit, whichever stops first."""
    scene = room("outliers", seed=40)
    source, target = scene.source[::3], scene.target[::3]
    if METHODS[method].paired:
        source = Pose.from_angle(2.0, (0.3, -4.0)).apply(target)
    if method in NETWORKS:
        source, target = source[::3], target[::3]
    starts = [room_start(turn, 0.4) for turn in (0.0, 20.0, 140.0)]
    start = Pose(np.stack([s.R for s in starts]), np.stack([s.t for s in starts]))
    batch = register(source, target, method, start=start, seed=40)
    copies = register(np.stack([source] * 3), np.stack([target] * 3), method, start=start, seed=40)
    np.testing.assert_array_equal(batch.pose.matrix, copies.pose.matrix)
    np.testing.assert_array_equal(batch.objective, copies.objective)
    np.testing.assert_array_equal(batch.steps, copies.steps)
    assert list(batch.reason) == list(copies.reason)
