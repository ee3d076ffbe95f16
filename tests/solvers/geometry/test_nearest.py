"""Nearest neighbours against the definition, point by point; gate and trim against plain loops."""

import tracemalloc

import numpy as np
import pytest

from solvers.core.tree import take
from solvers.geometry import nearest

NEVER = 10**9


def by_definition(points, target, k):
    """The k nearest rows of each point, with squares summed coordinate by coordinate, sorted by distance and row."""
    rows = np.empty((len(points), k), dtype=np.int64)
    for i, p in enumerate(points.tolist()):
        d = [sum_in_order(p, q) for q in target.tolist()]
        rows[i] = sorted(range(len(d)), key=lambda j: (d[j], j))[:k]
    return rows


def sum_in_order(p, q):
    total = 0.0
    for a, b in zip(p, q, strict=True):
        total += (a - b) * (a - b)
    return total


def clouds(kind, rng, m, n, d):
    points, target = rng.standard_normal((m, d)), rng.standard_normal((n, d))
    if kind == "lattice":  # ties everywhere
        return np.round(2.0 * points) / 2.0, np.round(target)
    if kind == "equal":
        return points, np.repeat(target[:1], n, axis=0)
    if kind == "repeated":
        return points, target[rng.integers(0, min(4, n), n)]
    if kind == "far":  # spacing close to the coordinates' rounding
        return 1e-8 * points + 1e6, 1e-8 * target + 1e6
    if kind == "tiny":  # squares underflow
        return np.round(2.0 * points) * 5e-163, np.round(target) * 1e-162
    if kind == "circle":  # every target point is equally far from the centre, up to rounding
        angle = rng.uniform(-np.pi, np.pi, n)
        target[:, 0], target[:, 1], target[:, 2:] = np.cos(angle), np.sin(angle), 0.0
        return np.zeros((m, d)), target
    return points, target


KINDS = ["random", "lattice", "equal", "repeated", "far", "tiny", "circle"]


@pytest.mark.parametrize("tree_from", [NEVER, pytest.param(1, marks=pytest.mark.native)])
@pytest.mark.parametrize("kind", KINDS)
def test_the_nearest_is_that_of_the_definition(kind, tree_from, rng):
    """Matrix products and k-d tree both return exactly the neighbours of the definition, with ties to the lowest
    row."""
    if tree_from == 1:
        pytest.importorskip("scipy")
    for m, n, d in ((5, 1, 2), (9, 7, 2), (20, 60, 2), (15, 40, 3), (6, 30, 4)):
        points, target = clouds(kind, rng, m, n, d)
        index = nearest.build(target[None], tree_from=tree_from)
        assert (index.trees is not None) == (tree_from == 1)
        rows, squares = index.nearest(points[None])
        expected = by_definition(points, target, n)
        assert np.array_equal(rows[0], expected[:, 0])
        assert squares[0].tolist() == [sum_in_order(p, target[j]) for p, j in zip(points, rows[0], strict=True)]
        for k in {1, min(3, n), min(7, n), n}:
            result, _ = index.nearest_k(points[None], k)
            assert np.array_equal(result[0], expected[:, :k])


@pytest.mark.native
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stride", [0.0, 1e-12, 1e-3, 0.1, 1.0, 1e3, 1e160])
def test_points_that_are_followed_find_what_they_would_find_anew(kind, stride, rng):
    """Rows and squares agree bit for bit, whatever the clouds and the motion: a drift, a return to the start, points on
    target points and midway between two, and a jump so far that its square overflows."""
    for n, d in ((1, 2), (40, 2), (30, 3)):
        points, target = (np.stack(x) for x in zip(*(clouds(kind, rng, 25, n, d) for _ in range(2)), strict=True))
        index, known, size = nearest.build(target, tree_from=1), None, np.abs(target).max()
        way = stride * size * rng.standard_normal((2, 25, d))
        middles = 0.5 * (target[:, rng.integers(0, n, 25)] + target[:, rng.integers(0, n, 25)])
        onto = target[:, rng.integers(0, n, 25)]
        with np.errstate(over="ignore"):
            path = [points + k * way for k in (0.0, 0.1, 0.2, 1.0, 0.9, 0.0)]
        for query in [*path, middles, middles + 1e-16 * way, onto, np.nextafter(onto, np.inf), points]:
            rows, squares, known = index.follow(query, known)
            expected, expected_squares = index.nearest(query)
            assert np.array_equal(rows, expected)
            assert np.array_equal(squares, expected_squares)


@pytest.mark.native
def test_many_points_are_asked_for_in_an_order_of_their_own(rng):
    """With enough points to be sorted, each finds what it would without a tree, even if only some are looked up."""
    pytest.importorskip("scipy")
    points, target = rng.standard_normal((2, 2500, 2)), rng.standard_normal((2, 300, 2))
    index, plain, known = nearest.build(target, tree_from=1), nearest.build(target, tree_from=NEVER), None
    step = 0.01 * rng.standard_normal((2, 2500, 2)) * (rng.random((2, 2500, 1)) < 0.5)
    for k in range(4):
        before = known
        rows, squares, known = index.follow(points + k * step, known)
        expected, expected_squares = plain.nearest(points + k * step)
        assert np.array_equal(rows, expected)
        assert np.array_equal(squares, expected_squares)
        assert np.array_equal(index.nearest(points + k * step)[0], expected)
        assert before is None or 0.0 < (known.points != before.points).any(axis=2).mean() < 0.5
    assert not np.array_equal(known.order[0], np.arange(2500))


@pytest.mark.native
def test_a_point_that_has_hardly_moved_is_not_looked_up_again(rng):
    """A point that moves by less than half the gap between its two nearest distances keeps its neighbour; in a batch,
    and in a part of one, each point by itself."""
    points, target = rng.standard_normal((3, 200, 3)), rng.standard_normal((3, 500, 3))
    index = nearest.build(target, tree_from=1)
    _, _, known = index.follow(points, None)
    squares = index.nearest_k(points, 2)[1]
    gap = np.sqrt(squares[..., 1]) - np.sqrt(squares[..., 0])
    np.testing.assert_allclose(known.slack, 0.5 * gap, rtol=1e-6, atol=1e-11)
    step = 1e-3 * np.ones((3, 200, 3))
    _, _, after = index.follow(points + step, known)
    kept = (after.points == points).all(axis=2)
    assert np.array_equal(kept, np.sqrt(3e-6) < known.slack)
    assert 0.8 < kept.mean() < 1.0
    part = take(index, np.array([2, 0])).follow(points[[2, 0]] + 3.0 * step[:2], take(after, np.array([2, 0])))
    assert np.array_equal(part[0], index.nearest(points + 3.0 * step)[0][[2, 0]])
    assert nearest.build(target, tree_from=NEVER).follow(points, None)[2] is None


def test_what_is_picked_is_each_problems_own(rng):
    values, rows = rng.standard_normal((4, 7, 2, 3)), rng.integers(0, 7, (4, 11))
    assert np.array_equal(nearest.picked(values, rows), values[np.arange(4)[:, None], rows])


def test_a_batch_is_its_single_problems(rng):
    """Every problem of a batch gets, bit for bit, what it gets alone, however the batch is split into blocks."""
    points, target = rng.standard_normal((7, 50, 2)), np.round(4.0 * rng.standard_normal((7, 80, 2))) / 4.0
    index = nearest.build(target)
    rows, squares = index.nearest(points)
    for i in range(7):
        own, own_squares = nearest.build(target[i : i + 1]).nearest(points[i : i + 1])
        assert np.array_equal(rows[i], own[0])
        assert np.array_equal(squares[i], own_squares[0])
    part = take(index, np.array([5, 2]))
    assert np.array_equal(part.nearest(points[[5, 2]])[0], rows[[5, 2]])


@pytest.mark.parametrize("block", [1, 64, 300, 5000])
def test_the_block_size_changes_nothing(block, monkeypatch, rng):
    points, target = rng.standard_normal((3, 21, 2)), rng.standard_normal((3, 33, 2))
    expected = nearest.build(target).nearest(points)[0]
    monkeypatch.setattr(nearest, "BLOCK", block)
    index = nearest.build(target)
    assert np.array_equal(index.nearest(points)[0], expected)
    assert np.array_equal(index.nearest_k(points, 1)[0][..., 0], expected)


def test_memory_stays_within_a_few_blocks(rng):
    """3000 × 3000 distances are 72 MB; the search holds only a few blocks of 2 MB at a time."""
    points, target = rng.standard_normal((1, 3000, 2)), rng.standard_normal((1, 3000, 2))
    index = nearest.build(target, tree_from=NEVER)
    tracemalloc.start()
    index.nearest(points)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 * 8 * nearest.BLOCK


@pytest.mark.native
def test_a_thousand_points_at_one_place_do_not_slow_the_tree(rng):
    """Scanners return the origin for missing echoes; a place counts once, so no query visits all its copies."""
    pytest.importorskip("scipy")
    target = rng.standard_normal((1, 4000, 3))
    target[0, rng.permutation(4000)[:2000]] = 0.0
    points = np.concatenate([np.zeros((1, 500, 3)), rng.standard_normal((1, 500, 3))], axis=1)
    index = nearest.build(target)
    assert len(index.trees[0].start) - 1 == 2001
    lowest = int(np.flatnonzero(~target[0].any(axis=1))[0])
    assert np.all(index.nearest(points)[0][0, :500] == lowest)
    plain = nearest.build(target, tree_from=NEVER)
    assert np.array_equal(index.nearest(points)[0], plain.nearest(points)[0])
    assert np.array_equal(index.nearest_k(points[:, 480:520], 5)[0], plain.nearest_k(points[:, 480:520], 5)[0])


@pytest.mark.native
def test_large_clouds_use_the_tree_and_one_tree_serves_equal_clouds(rng):
    pytest.importorskip("scipy")
    target = rng.standard_normal((nearest.TREE_FROM, 2))
    trees = nearest.build(np.stack([target, target, target + 1.0])).trees
    assert trees[0] is trees[1]
    assert trees[1] is not trees[2]
    assert nearest.build(target[None, 1:]).trees is None


def test_distances_beyond_the_numbers_are_infinite():
    """A distance that overflows is infinite, with row 0, and raises nothing."""
    index = nearest.build(np.array([[[0.0, 0.0], [1.0, 0.0]]]))
    with np.errstate(all="raise"):
        rows, squares = index.nearest(np.array([[[1e200, 0.0], [0.9, 0.0]]]))
    assert rows.tolist() == [[0, 1]]
    assert squares[0, 0] == np.inf
    assert squares[0, 1] == pytest.approx(0.01)


@pytest.mark.parametrize("k", [0, 4, -1])
def test_more_neighbours_than_points_are_refused(k, rng):
    with pytest.raises(ValueError, match=r"^k: expected 1 to 3"):
        nearest.build(rng.standard_normal((1, 3, 2))).nearest_k(np.zeros((1, 1, 2)), k)


def test_gate_trim_and_count(rng):
    """The gate keeps what is within it, trimming drops the farthest fraction of that, a count keeps exactly that
    many."""
    squares = np.array([[4.0, 1.0, 0.25, 1.0, 9.0, np.inf], [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]])
    mask = nearest.within(squares, 2.0)
    assert mask.tolist() == [[True, True, True, True, False, False], [True] * 6]
    assert nearest.within(squares, np.inf).sum(axis=1).tolist() == [5, 6]
    assert nearest.within(squares, np.array([0.5, 0.5])).sum(axis=1).tolist() == [1, 0]
    # Among equal distances, the first are kept.
    assert nearest.smallest(squares, 2)[0].tolist() == [False, True, True, False, False, False]
    assert nearest.smallest(squares, 2)[1].tolist() == [True, True, False, False, False, False]
    assert nearest.smallest(squares, np.array([3, 5]), mask).sum(axis=1).tolist() == [3, 5]
    assert np.array_equal(nearest.smallest(squares, 100, mask), mask)
    assert nearest.trimmed(squares, 0.25, mask).tolist() == [
        [False, True, True, True, False, False],
        [True] * 5 + [False],
    ]
    assert np.array_equal(nearest.trimmed(squares, 0.0, mask), mask)
    ten = rng.random((1, 10))
    for trim, count in ((0.1, 9), (0.3, 7), (0.7, 3), (0.99, 1)):
        assert nearest.trimmed(ten, trim, np.ones((1, 10), dtype=bool)).sum() == count


def test_neighbours_are_right_where_products_lose_their_digits():
    """A cloud of 1e-4 u a million u away: what rounding hides is recomputed point by point."""
    rng = np.random.default_rng(1)
    target = np.vstack([[-1e6, 0.0], np.column_stack([1e6 + 1e-4 * rng.random(200), 1e-4 * rng.random(200)])])
    points = np.column_stack([1e6 + 1e-4 * rng.random(50), 1e-4 * rng.random(50)])
    rows, _ = nearest.build(target[None], tree_from=10**9).nearest(points[None])
    assert np.array_equal(rows[0], np.square(points[:, None] - target).sum(axis=2).argmin(axis=1))


def test_a_trimmed_share_is_not_rounded_down_by_a_digit():
    """0.29 of 100 is 29, although 100 times 0.29 is slightly less in floating point."""
    assert nearest.trimmed(np.arange(100.0)[None], 0.29, np.ones((1, 100), dtype=bool)).sum() == 71
