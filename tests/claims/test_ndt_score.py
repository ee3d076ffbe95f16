"""Chapter 4b: what the score of a pose tells, and what it does not, in the figure's room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from solvers import METHODS, Pose
from solvers.core.stepper import begin, run
from solvers.methods.ndt import ndt
from solvers.methods.ndt.mixture import constants
from solvers.methods.ndt.ndt_map import NdtMap, build
from solvers.methods.ndt.score import evaluate, score_map
from solvers.methods.ndt.translation import climb
from solvers.metrics import rre, rte
from solvers.scenes.walls import ndt_room
from solvers.studies.benchmark import benchmark
from solvers.studies.race import MAX_STEPS, SEEDS, Controls, contestants, race_problem

AT = np.linspace(-1.5, 1.5, 31)
MIDDLE = 15


def room(seed: int, grids: int = 1, size: float = 1.0, **options: float) -> tuple[np.ndarray, NdtMap]:
    """The scan, at its true pose, and the map with cells of `size` u."""
    scene = ndt_room(seed=seed, **options)
    return scene.source, build(scene.target[None], size, grids=grids)


def field(scan: np.ndarray, cells: NdtMap) -> np.ndarray:
    """The score per point and grid over translations of up to 1.5 u along each axis."""
    return score_map(cells, scan, AT, AT) / (len(scan) * cells.table.shape[1])


def total(cells: NdtMap, points: np.ndarray) -> float:
    return float(evaluate(cells, points[None], np.zeros((1, 2)), derivatives=False).score[0])


def test_a_point_of_its_own_cell_scores_a_half_on_average():
    """Four clouds from round to thin, each in one cell: 40,000 points drawn from the cell's own Gaussian score ½ on
    average, and points drawn from one twice as wide a fifth."""
    rng = np.random.default_rng(40)
    for spread in ([[1.0, 0.0], [0.0, 1.0]], [[0.3, 0.2], [0.2, 0.15]], [[4.0, 0.0], [0.0, 0.001]], [[2, 1], [1, 2]]):
        cells = build(rng.multivariate_normal((50.0, 50.0), spread, 30)[None], 100.0)
        assert cells.kept.sum() == 1
        mean, S = cells.mean[0, 0], np.linalg.inv(cells.precision[0, 0])
        for wider, score in ((1.0, 1 / 2), (2.0, 1 / 5)):
            points = rng.multivariate_normal(mean, wider**2 * S, 40_000)
            assert total(cells, points) / len(points) == pytest.approx(score, abs=0.01)


def test_a_sharp_cell_counts_no_more_than_a_blurred_one():
    """25 draws of the room at its usual noise: a point at the mean of any kept cell scores one, although the cells'
    areas differ more than twenty-five-fold."""
    for seed in SEEDS:
        _, cells = room(seed, noise=0.03)
        kept = cells.kept[0]
        for mean in cells.mean[0][kept]:
            assert total(cells, mean[None]) == pytest.approx(1.0, abs=1e-12)
        areas = 1 / np.sqrt(np.linalg.det(cells.precision[0][kept]))
        assert areas.max() / areas.min() > 25


@pytest.mark.parametrize("grids", [1, 4])
def test_one_point_moves_the_score_by_at_most_one_on_each_grid(grids):
    """Moving any single scan point anywhere, even very far off, changes the sum by at most the number of grids."""
    scan, cells = room(40, grids)
    before, rng = total(cells, scan), np.random.default_rng(40)
    for k in rng.choice(len(scan), 40, replace=False):
        for position in (*rng.uniform(-5, 5, (5, 2)), (1e6, 0.0)):
            moved = scan.copy()
            moved[k] = position
            assert abs(total(cells, moved) - before) <= grids + 1e-9


def test_a_slide_along_one_pair_of_walls_keeps_what_they_score():
    """In all 25 draws, half a unit along x or y keeps more than twice the score of an equal shift along a diagonal."""
    for seed in SEEDS:
        scan, cells = room(seed)
        part = 0.5 / np.sqrt(2)
        straight = [total(cells, scan + 0.5 * np.array(way)) for way in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        diagonal = [total(cells, scan + part * np.array(way)) for way in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
        assert np.mean(straight) > 2 * np.mean(diagonal)


def offsets(noise: float, grids: int = 1, size: float = 1.0, seeds: Sequence[int] = SEEDS) -> np.ndarray:
    """Where the climb from the truth comes to rest, in u: one row per seed, (n, 2)."""
    ends = []
    for seed in seeds:
        scan, cells = room(seed, grids, size, noise=noise)
        ends.append(climb(cells, scan, np.zeros(2)).places[-1])
    return np.array(ends)


def test_25_draws_show_no_bias():
    """σ = 0.03 u, 25 draws: the summit is 0.005 to 0.02 u off on average, while the mean offset in x and in y is less
    than two standard errors from zero."""
    summits = offsets(0.03)
    assert 0.005 < np.linalg.norm(summits, axis=1).mean() < 0.02
    assert (np.abs(summits.mean(axis=0)) < 2 * summits.std(axis=0, ddof=1) / 5).all()


def test_400_draws_show_a_small_bias():
    """σ = 0.03 u, 400 draws that no other test uses: the mean offset in x is −0.001 to −0.004 u, more than three
    standard errors from zero, and a tenth to a third of the typical distance."""
    summits = offsets(0.03, seeds=range(10_000, 10_400))
    mean = summits[:, 0].mean()
    assert -0.004 < mean < -0.001
    assert mean < -3 * summits[:, 0].std(ddof=1) / 20
    assert 0.1 < -mean / np.linalg.norm(summits, axis=1).mean() < 0.33


def test_more_noise_moves_the_summit_further(why):
    """At σ = 0.1 u the summit is more than three times as far off on average as at 0.03 u, and the mean offset in x is
    more than two standard errors from zero."""
    calm, noisy = offsets(0.03), offsets(0.1)
    typical = [np.linalg.norm(values, axis=1).mean() for values in (noisy, calm)]
    why("the noise", {"0.1 u": f"{typical[0]:.3f} u off on average", "0.03 u": f"{typical[1]:.3f} u off"})
    assert np.linalg.norm(noisy, axis=1).mean() > 3 * np.linalg.norm(calm, axis=1).mean()
    assert abs(noisy[:, 0].mean()) > 2 * noisy[:, 0].std(ddof=1) / 5


def test_noise_broadens_the_summit_and_lowers_it():
    """From σ = 0.03 to 0.2 u, in each of ten draws, the part of the map above half its maximum grows more than
    fourfold, and the score at the truth falls."""
    for seed in SEEDS[:10]:
        calm, noisy = (field(*room(seed, noise=noise)) for noise in (0.03, 0.2))
        assert (noisy > 0.5 * noisy.max()).mean() > 4 * (calm > 0.5 * calm.max()).mean()
        assert noisy[MIDDLE, MIDDLE] < calm[MIDDLE, MIDDLE]


def test_outliers_make_cells_that_distract():
    """Over ten draws, 40 % outliers add cells, lower the score at the truth, and more than triple the map's floor,
    which is its median."""
    results = []
    for fraction in (0.0, 0.4):
        maps = [room(seed, outliers=fraction) for seed in SEEDS[:10]]
        values = [field(scan, cells) for scan, cells in maps]
        results.append(
            (
                np.mean([cells.kept.sum() for _, cells in maps]),
                np.mean([v[MIDDLE, MIDDLE] for v in values]),
                np.mean([np.median(v) for v in values]),
            )
        )
    (cells, truth, floor), (more, lower, higher) = results
    assert more > cells
    assert lower < truth
    assert higher > 3 * floor


def test_outliers_of_the_scan_score_little():
    """At the truth with 40 % outliers in both clouds, six draws: the scan's outliers score 0.05 to 0.15 on average, and
    between a third and nine tenths of them land in a kept cell."""
    scores = []
    for seed in SEEDS[:6]:
        scene = ndt_room(seed=seed, outliers=0.4)
        cells = build(scene.target[None], 1.0)
        scores += [total(cells, point[None]) for point in scene.source[scene.source_outlier]]
    assert 0.05 < np.mean(scores) < 0.15
    assert 1 / 3 < np.mean(np.array(scores) > 0.0) < 0.9


def test_outliers_spoil_the_way_before_the_summit():
    """With 40 % outliers, six draws: the highest tile lies within 0.15 u of the truth, but at most two thirds as many
    of 25 starts per draw arrive as without outliers."""
    for seed in SEEDS[:6]:
        values = field(*room(seed, outliers=0.4))
        row, column = np.unravel_index(values.argmax(), values.shape)
        assert np.hypot(AT[column], AT[row]) < 0.15
    assert 0 < arrivals(1, SEEDS[:6], outliers=0.4) < 2 / 3 * arrivals(1, SEEDS[:6])


def test_smaller_cells_are_not_more_precise_here(why):
    """σ = 0.03 u, 25 draws: the climb from the truth ends farther off with cells of 0.5 u than of 2 u, on average."""
    small, large = (np.linalg.norm(offsets(0.03, size=size), axis=1).mean() for size in (0.5, 2.0))
    why("the cells", {"0.5 u": f"{small:.4f} u off on average", "2 u": f"{large:.4f} u off"})
    assert small > 1.1 * large


def test_no_translation_repairs_a_rotation():
    """With the scan turned by 15°, four grids, ten draws: the best score over all translations is at most 30 % of the
    score at the truth, and lies more than half a unit from the true translation."""
    for seed in SEEDS[:10]:
        scan, cells = room(seed, 4)
        values = field(Pose.from_angle(np.radians(15.0)).apply(scan), cells)
        row, column = np.unravel_index(values.argmax(), values.shape)
        assert values.max() < 0.3 * field(scan, cells)[MIDDLE, MIDDLE]
        assert np.hypot(AT[column], AT[row]) > 0.5


def jumps(seed: int, grids: int) -> np.ndarray:
    """By how much the score per point and grid jumps at each border that any point crosses from x = −0.5 to 0.5 u."""
    scan, cells = room(seed, grids)
    size, nearly = float(cells.size[0]), 1e-9
    to = np.concatenate([np.mod(x0 - scan[:, 0], size) for x0 in np.unique(cells.origin[0, :, 0])])
    x = np.concatenate([to - size, to])
    x = x[np.abs(x) < 0.5]
    ahead, behind = (np.column_stack([x + side * nearly, np.zeros(len(x))]) for side in (1, -1))
    rows, pivot = np.zeros(len(x), dtype=np.int64), np.zeros((len(x), 2))
    scores = [
        evaluate(cells, scan + shift[:, None], pivot, rows, derivatives=False).score for shift in (ahead, behind)
    ]
    leaps = np.abs(scores[0] - scores[1]) / (len(scan) * grids)
    return np.asarray(leaps[leaps > 1e-6])


def test_a_hundred_borders_on_one_unit_of_travel():
    """From x = −0.5 to 0.5 u, one grid of 1 u, three draws: each has more than a hundred jumps above rounding error."""
    for seed in SEEDS[:3]:
        assert len(jumps(seed, 1)) > 100


def test_four_grids_make_jumps_smaller_and_more_of_them(why):
    """Along a line through the truth, in each of three draws: four grids make the largest jump at most 0.6 times as
    large, and jumps more than one and a half times as many, as one grid; the score is discontinuous with both."""
    first = {grids: jumps(SEEDS[0], grids) for grids in (4, 1)}
    words = {n: f"{len(result)} jumps, the largest {result.max():.4f} a point and grid" for n, result in first.items()}
    why("the grids", {"four": words[4], "one": words[1]})
    for seed in SEEDS[:3]:
        one, four = jumps(seed, 1), jumps(seed, 4)
        assert 0 < four.max() < 0.6 * one.max()
        assert len(four) > 1.5 * len(one) > 0


def arrivals(grids: int, seeds: tuple[int, ...] = SEEDS[:3], **options: float) -> float:
    """The share of 25 starts per seed, up to 1.4 u off along each axis, whose climb ends within 0.1 u of the truth."""
    ways = np.linspace(-1.4, 1.4, 5)
    ends = []
    for seed in seeds:
        scan, cells = room(seed, grids, **options)
        ends += [climb(cells, scan, np.array([x, y])).places[-1] for x in ways for y in ways]
    return float((np.linalg.norm(ends, axis=1) < 0.1).mean())


def test_less_than_half_of_the_starts_arrive():
    """At the true rotation, with cells of 1 u, a fifth to a half of the starts arrive with one grid, and not more of
    them with four."""
    one, four = arrivals(1), arrivals(4)
    assert 0.2 < one < 0.5
    assert 0.05 < four <= one


def test_a_share_of_outliers_widens_the_reach():
    """The race's NDT on 'combo' from 45° and 1.43 u, 25 seeds: at most 7 end within 5° and 0.2 u as it races, at least
    11 with an outlier share of 0.55. Wider cells alone explain this: the race's own climb, on maps whose covariances
    are divided by d₂, succeeds on just as many."""
    (contestant,) = contestants(["ndt"])
    controls = Controls(degrees=45.0, distance=1.43, setting="combo")
    mixture = replace(contestant, options={**contestant.options, "outliers": 0.55})
    lines = benchmark(controls, contestants=[contestant, mixture])
    plain, mixture_count = (line.close for line in lines)
    assert plain <= 7
    assert mixture_count >= 11

    def widen(problem, options):
        state = ndt.start(problem, options)
        maps = tuple(replace(cells, precision=constants(0.55)[1] * cells.precision) for cells in state.maps)
        moved = state.pose.apply(problem.source)
        at = evaluate(maps[0], moved, moved.mean(axis=1))
        return replace(state, maps=maps, at=at, objective=-at.score)

    problem, truth = race_problem(controls)
    method = replace(METHODS["ndt"], start=widen)
    batch, _ = run(begin(method, problem, method.options(**contestant.options), MAX_STEPS))
    end = batch.pose()
    assert int(((np.degrees(rre(end, truth)) < 5) & (rte(end, truth) < 0.2)).sum()) == mixture_count
