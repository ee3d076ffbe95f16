"""The causes that the three chapters on distributions for points name: each test changes that one factor."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from solvers import Pose, register
from solvers.core.method import Problem
from solvers.methods.ndt import ndt
from solvers.methods.ndt.ndt_map import build
from solvers.methods.ndt.score import evaluate, score_map
from solvers.methods.ndt.translation import climb
from solvers.metrics import rre, rte
from solvers.scenes.walls import NDT_ROOM, PILLAR, ndt_room, sampled
from solvers.studies.race import SEEDS, Controls, race_problem
from solvers.studies.seeds import seeds

FRESH = range(10_000, 10_400)  # seeds that no other test uses
AT = np.linspace(-1.5, 1.5, 31)
DOWN_RIGHT = np.array([0.83205, -0.5547])
CAPS = {"max_shift": 0.5, "max_turn": 0.2, "max_steps": 45}


# The map


def test_the_spacing_of_the_points_decides_which_cells_are_lost(why):
    """25 draws: cells of 0.3 u cover less than half of the room's points when the points are 0.13 u apart, and more
    than 95 % at half that spacing."""
    coverage = {}
    for spacing in (0.13, 0.065):
        outline = np.vstack([sampled(NDT_ROOM, spacing), sampled(PILLAR, spacing)])
        parts = []
        for seed in SEEDS:
            cells = build((outline + 0.03 * np.random.default_rng(seed).standard_normal(outline.shape))[None], 0.3)
            parts.append(cells.count[0][cells.kept[0]].sum() / len(outline))
        coverage[spacing] = float(np.mean(parts))
    why(
        "the spacing of the points",
        {f"{spacing:g} u": f"cells of 0.3 u cover {100 * part:.0f} %" for spacing, part in coverage.items()},
    )
    assert coverage[0.13] < 0.5
    assert coverage[0.065] > 0.95


@cache
def lost(across, along):
    """How many points cells of 0.4 u lose in 25 draws of the room, on average: of those on walls that lie on borders of
    the grid, and of the others more than a cell from their wall's ends. Whether there is noise across and along walls.
    """
    outline = np.vstack([sampled(NDT_ROOM, 0.13), sampled(PILLAR, 0.13)])
    corners, ends = np.vstack([NDT_ROOM[:-1], PILLAR[:-1]]), np.vstack([NDT_ROOM[1:], PILLAR[1:]])
    length = np.linalg.norm(ends - corners, axis=1)
    unit = (ends - corners) / length[:, None]
    place = np.clip(((outline[:, None] - corners) * unit).sum(axis=2), 0.0, length)
    wall = np.linalg.norm(outline[:, None] - corners - place[..., None] * unit, axis=2).argmin(axis=1)
    unit, place = unit[wall], place[np.arange(len(wall)), wall]
    cells = (outline * np.abs(unit[:, ::-1])).sum(axis=1) / 0.4  # where a wall lies, in cells across it
    border = np.abs(cells - np.rint(cells)) < 1e-9
    plain = ~border & (np.minimum(place, length[wall] - place) > 0.4)
    counts = []
    for seed in SEEDS:
        noise = 0.03 * np.random.default_rng(seed).standard_normal(outline.shape)
        part = (noise * unit).sum(axis=1, keepdims=True) * unit
        points = outline + along * part + across * (noise - part)
        rows = build(points[None], 0.4).lookup(points[None], np.array([0]))[0, 0]
        counts.append([(rows[which] < 0).sum() for which in (border, plain)])
    return np.mean(counts, axis=0)


def test_walls_on_borders_lose_points_to_the_noise_across(why):
    """Cells of 0.4 u, 25 draws: the walls that lie on borders of the grid lose more than ten of their points if there
    is noise across the walls alone, and fewer than five if there is noise along them alone."""
    noisy, still = lost(True, False)[0], lost(False, True)[0]
    why("the noise across these walls", {"there": f"{noisy:.1f} points lost", "not there, only along": f"{still:.1f}"})
    assert noisy > 10.0
    assert still < 5.0


def test_noise_along_the_walls_carries_points_away(why):
    """Cells of 0.4 u, 25 draws: far from corners, walls off the grid's borders lose more than ten points if there is
    noise along the walls alone, and none if there is noise across them alone."""
    noisy, still = lost(False, True)[1], lost(True, False)[1]
    why("the noise along these walls", {"there": f"{noisy:.1f} points lost", "not there, only across": f"{still:.1f}"})
    assert noisy > 10.0
    assert still == 0.0


def test_junk_widens_the_races_cells_more_than_noise():
    """The race's coarse cells, 100 seeds: the median σ across their walls is 0.02 u in the clean room, 0.09 u with
    noise, 0.22 u with junk and 0.25 u with both."""
    widths = {}
    for setting in ("clean", "noise", "outliers", "combo"):
        problem, _ = race_problem(Controls(setting=setting), seeds(100))
        cells = build(problem.target, 2.4, grids=4)
        widths[setting] = np.sqrt(np.median(np.linalg.eigvalsh(cells.covariance[cells.kept])[:, 0]))
    assert widths == pytest.approx({"clean": 0.02, "noise": 0.09, "outliers": 0.22, "combo": 0.25}, abs=0.005)


# The score


def total(cells, points):
    return float(evaluate(cells, points[None], np.zeros((1, 2)), derivatives=False).score[0])


@cache
def scores_at_the_truth():
    """At the truth, on cells of 1 u, in 25 draws: the scores of the scan's points, those of the target's own, and which
    of the scan's are in a cell that holds a corner of the room or of the pillar."""
    corners = np.unique(np.floor(np.vstack([NDT_ROOM, PILLAR])), axis=0)
    scan, target, at_corner = [], [], []
    for seed in SEEDS:
        scene = ndt_room(seed=seed)
        cells = build(scene.target[None], 1.0)
        for points, scores in ((scene.source, scan), (scene.target, target)):
            scores.append(evaluate(cells, points[None], np.zeros((1, 2))).values[0, 0])
        at_corner.append((np.floor(scene.source)[:, None] == corners).all(axis=2).any(axis=1))
    return np.array(scan), np.array(target), np.array(at_corner)


def test_fresh_points_score_less_than_those_a_cell_was_fitted_to(why):
    """25 draws of the room at the truth, cells of 1 u: the scan's points score 0.37 to 0.40 on average, the target's
    own 0.43 to 0.45."""
    scan, target = (float(scores.mean()) for scores in scores_at_the_truth()[:2])
    why("which points are scored", {"the scan's": f"{scan:.2f} on average", "the target's own": f"{target:.2f}"})
    assert 0.37 < scan < 0.40
    assert 0.43 < target < 0.45


def test_cells_with_a_corner_score_no_less():
    """25 draws of the room at the truth, cells of 1 u: the scan's points in cells that hold a corner score 0.40 to 0.42
    on average, those in other kept cells 0.36 to 0.39."""
    scan, _, at_corner = scores_at_the_truth()
    assert 0.40 < scan[at_corner & (scan > 0.0)].mean() < 0.42
    assert 0.36 < scan[~at_corner & (scan > 0.0)].mean() < 0.39


def test_a_ridge_comes_from_the_walls_along_it(why):
    """25 draws: a shift of half a unit along x keeps more than half of the score per point at the truth. Without the
    scan's points on walls along x it keeps less than a quarter, about as much as half a unit along the diagonals."""
    exact = np.vstack([sampled(NDT_ROOM, 0.16, 0.05, 0.75), sampled(PILLAR, 0.16)])
    step = np.abs(np.gradient(exact, axis=0))
    along = step[:, 0] > step[:, 1]
    full, without, diagonal = [], [], []
    for seed in SEEDS:
        scene = ndt_room(seed=seed)
        cells = build(scene.target[None], 1.0)
        ways = 0.5 * np.array([(1.0, 0.0), (-1.0, 0.0)])
        slants = 0.5 / np.sqrt(2.0) * np.array([(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)])
        rest, base = scene.source[~along], total(cells, scene.source) / len(scene.source)
        full.append(np.mean([total(cells, scene.source + way) for way in ways]) / len(scene.source) / base)
        without.append(np.mean([total(cells, rest + way) for way in ways]) / len(rest) / base)
        diagonal.append(np.mean([total(cells, scene.source + way) for way in slants]) / len(scene.source) / base)
    why(
        "the scan's points on walls along x",
        {
            "they are there": f"half a unit along x keeps {100 * np.mean(full):.0f} % of the score a point",
            "they are left out": f"it keeps {100 * np.mean(without):.0f} %",
        },
    )
    assert min(full) > 0.5
    assert max(without) < 0.25
    assert np.mean(without) < 1.5 * np.mean(diagonal)


def maps(seeds, **changes):
    """Score maps with the change in neither cloud, in the scan alone, in the target alone, and in both."""
    fields = {"neither": [], "the scan": [], "the target": [], "both": []}
    for seed in seeds:
        usual, variant = ndt_room(seed=seed), ndt_room(seed=seed, **changes)
        pairs = [(usual, usual), (variant, usual), (usual, variant), (variant, variant)]
        for result, (scan, target) in zip(fields.values(), pairs, strict=True):
            result.append(score_map(build(target.target[None], 1.0), scan.source, AT, AT) / len(scan.source))
    return fields


def test_the_score_at_the_truth_falls_with_the_scans_noise(why):
    """Ten draws, σ raised from 0.03 to 0.2 u: in the scan alone, the noise more than halves the score at the truth; in
    the target alone, it raises the score."""
    truth = {name: float(np.mean([f[15, 15] for f in result])) for name, result in maps(SEEDS[:10], noise=0.2).items()}
    why(
        "which cloud has noise of 0.2 u in place of 0.03 u",
        {name: f"{truth[name]:.2f} a point at the truth" for name in ("both", "the scan", "the target", "neither")},
    )
    assert truth["the scan"] < 0.5 * truth["neither"]
    assert truth["the target"] > truth["neither"]
    assert truth["both"] < truth["neither"]


def test_the_plain_rises_with_the_targets_outliers(why):
    """Ten draws with 40 % outliers: in the target alone they more than triple the map's median; in the scan alone they
    raise it by less than a half."""
    fields = maps(SEEDS[:10], outliers=0.4)
    plain = {name: float(np.mean([np.median(field) for field in result])) for name, result in fields.items()}
    why(
        "which cloud has 40 % outliers",
        {name: f"the plain lies at {plain[name]:.3f}" for name in ("both", "the target", "the scan", "neither")},
    )
    assert plain["the target"] > 3.0 * plain["neither"]
    assert plain["the scan"] < 1.5 * plain["neither"]


def test_the_scans_outliers_cost_more_arrivals_than_the_targets(why):
    """Six draws, 25 starts each, 40 % outliers: in the target alone they leave about two thirds of the arrivals, in the
    scan alone less than a third."""
    ways, counts = np.linspace(-1.4, 1.4, 5), dict.fromkeys(("the scan", "the target", "neither"), 0)
    for seed in SEEDS[:6]:
        usual, variant = ndt_room(seed=seed), ndt_room(seed=seed, outliers=0.4)
        for name, scan, target in (
            ("the scan", variant, usual), ("the target", usual, variant), ("neither", usual, usual),
        ):  # fmt: skip
            cells = build(target.target[None], 1.0)
            ends = [climb(cells, scan.source, np.array([x, y])).places[-1] for x in ways for y in ways]
            counts[name] += int((np.linalg.norm(ends, axis=1) < 0.1).sum())
    why("which cloud has 40 % outliers", {name: f"{count} of 150 starts arrive" for name, count in counts.items()})
    assert counts["the scan"] < counts["neither"] / 3
    assert 0.6 < counts["the target"] / counts["neither"] < 0.75


def test_noise_alone_moves_the_summit_of_the_map(why):
    """Cells of 1 u, 25 draws, climbs over translations from the truth: with noise of 0.03 u they end 0.01 u off on
    average, without noise less than 0.0001 u off."""
    errors = {}
    for noise in (0.03, 0.0):
        scenes = [ndt_room(seed=seed, noise=noise) for seed in SEEDS]
        ends = [climb(build(s.target[None], 1.0), s.source, np.zeros(2)).places[-1] for s in scenes]
        errors[noise] = float(np.linalg.norm(ends, axis=1).mean())
    why("the noise", {"0.03 u": f"{errors[0.03]:.3f} u off on average", "none": f"{errors[0.0]:.3f} u off"})
    assert errors[0.03] == pytest.approx(0.01, abs=0.002)
    assert errors[0.0] < 1e-4


def test_the_bias_comes_from_where_the_cells_stand(why):
    """σ = 0.03 u, 400 draws: the mean offset in x is more than three standard errors from zero with the default grid
    and, by as much, with the grid a quarter of a cell further right, but less than two with it as far to the left."""
    result, names = {}, ("as it does", "a quarter of a cell to the right", "a quarter of a cell to the left")
    for nudge in (0.0, 0.25, -0.25):
        ends = []
        for seed in FRESH:
            scene = ndt_room(seed=seed)
            cells = build(scene.target[None], 1.0, offset=np.array([nudge, 0.0]))
            ends.append(climb(cells, scene.source, np.zeros(2)).places[-1][0])
        result[nudge] = float(np.mean(ends)), float(np.std(ends, ddof=1) / 20)
    why(
        "where the grid lies",
        {
            name: f"{mean:.4f} ± {error:.4f} u in x on average".replace("-", "−")
            for name, (mean, error) in zip(names, result.values(), strict=True)
        },
    )
    assert result[0.0][0] < -3.0 * result[0.0][1]
    assert result[0.25][0] < -3.0 * result[0.25][1]
    assert abs(result[0.25][0] - result[0.0][0]) < result[0.0][1]
    assert abs(result[-0.25][0]) < 2.0 * result[-0.25][1]


# The climb


@cache
def rooms(noise=0.03):
    """Source and target of 25 draws of the room."""
    scenes = [ndt_room(seed=seed, noise=noise) for seed in SEEDS]
    return np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])


def arrivals(pose):
    """How many poses are within 2° and 0.1 u of the truth, which is the identity."""
    truth = Pose.identity(batch=pose.batch)
    return int(((np.degrees(rre(pose, truth)) < 2.0) & (rte(pose, truth) < 0.1)).sum())


def after_climb(pose, size, wider=1.0):
    """The poses after 45 steps on cells of one size, with every Gaussian widened by a factor, and the share of look-ups
    at the start that score below 0.01."""
    source, target = rooms()
    problem = Problem(source, target, np.ones(source.shape[:2]), pose, np.arange(len(source)))
    state = ndt.start(problem, ndt.NdtOptions(cells=size, max_shift=0.5, max_turn=0.2))
    cells = replace(state.maps[0], precision=state.maps[0].precision / wider**2)
    moved = pose.apply(source)
    at = evaluate(cells, moved, moved.mean(axis=1), np.arange(len(source)))
    state = replace(state, maps=(cells,), at=at, objective=-at.score)
    for _ in range(45):
        state = ndt.step(state)
    return state.pose, float((at.values < 0.01).mean())


START = Pose.from_angle(np.full(25, np.radians(25.0)), 1.4 * DOWN_RIGHT)


def test_the_width_of_the_gaussians_is_the_reach(why):
    """The figure's start, 25 draws, cells of 0.8 u: with the Gaussians as measured one run arrives, and nine in ten
    look-ups at the start score below a hundredth. With Gaussians eight times as wide all arrive."""
    (usual, faint), (wide, _) = after_climb(START, 0.8), after_climb(START, 0.8, 8.0)
    why(
        "how wide the Gaussians are, in cells of 0.8 u",
        {"as measured": f"{arrivals(usual)} of 25 arrive", "eight times as wide": f"{arrivals(wide)} of 25 arrive"},
    )
    assert arrivals(usual) == 1
    assert faint == pytest.approx(0.9, abs=0.02)
    assert arrivals(wide) == 25


def test_narrow_gaussians_take_the_reach_of_large_cells(why):
    """The same start on cells of 3.2, 1.6 and 0.8 u: all 25 arrive, but at most six if the Gaussians of the first two
    levels are a quarter as wide."""
    counts = []
    for wider in (1.0, 0.25):
        pose = START
        for size in (3.2, 1.6):
            pose, _ = after_climb(pose, size, wider)
        counts.append(arrivals(after_climb(pose, 0.8)[0]))
    why(
        "how wide the Gaussians of the two coarse levels are",
        {"as measured": f"{counts[0]} of 25 arrive", "a quarter as wide": f"{counts[1]} of 25 arrive"},
    )
    assert counts[0] == 25
    assert counts[1] <= 6


def test_noise_moves_the_summit_off_the_truth(why):
    """Started at the truth on cells of 0.8 u, 22 of 25 draws leave it for a higher score with noise of 0.03 u, and none
    does without noise."""
    counts = {}
    for noise in (0.03, 0.0):
        source, target = rooms(noise)
        run = register(source, target, "ndt", start=Pose.identity(batch=(25,)), cells=0.8, **CAPS)
        truth = evaluate(build(target, 0.8, grids=4), source, source.mean(axis=1)).score
        counts[noise] = int((-run.objective > truth + 1e-9).sum())
    why("the noise", {"0.03 u": f"{counts[0.03]} of 25 leave the truth", "none": f"{counts[0.0]} of 25"})
    assert counts[0.03] == 22
    assert counts[0.0] == 0


def test_the_first_level_loses_the_good_start(why):
    """One grid, started 5° and 0.2 u off: the run over 4.8, 2.4 and 1.2 u ends more than 10° away, the run over 2.4 and
    1.2 u less than 1° away."""
    scene, start = ndt_room(), Pose.from_angle(np.radians(5.0), 0.2 * DOWN_RIGHT)
    errors = {}
    for cells in ((4.8, 2.4, 1.2), (2.4, 1.2)):
        pose = register(scene.source, scene.target, "ndt", start=start, cells=cells, grids=1, **CAPS).pose
        errors[cells] = float(np.degrees(rre(pose, scene.truth)))
    why("the first level", {f"{cells[0]:g} u": f"{error:.1f}° off" for cells, error in errors.items()})
    assert errors[4.8, 2.4, 1.2] > 10.0
    assert errors[2.4, 1.2] < 1.0
