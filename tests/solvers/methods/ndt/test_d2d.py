"""Distribution-to-distribution NDT: the score against its sum, derivatives against differences, the run."""

from dataclasses import replace

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.methods.ndt import d2d_score, ndt, ndt_map
from solvers.methods.ndt.score import evaluate
from solvers.metrics import rre
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def clouds_of_cells(rng, b=2):
    """Maps of small clouds whose cells overlap in many different ways."""
    clouds = rng.normal(0.0, 1.0, (2, b, 80, 2))
    return ndt_map.build(clouds[0], 0.9), ndt_map.build(clouds[1], 1.1, grids=4)


def test_the_d2d_score_is_its_sum_over_all_pairs(rng):
    """Agrees with a plain double loop using the combined covariance R S Rᵀ + Σ, inverted by LAPACK."""
    source, target = clouds_of_cells(rng)
    poses = Pose.from_angle([0.7, -2.0], [[0.3, 0.1], [-0.2, 0.4]])
    result = d2d_score.evaluate(source, target, poses, poses.t)
    for k in range(2):
        total = 0.0
        for i in np.flatnonzero(source.kept[k]):
            terms = []
            for j in np.flatnonzero(target.kept[k]):
                S, Q = (np.linalg.inv(m.precision[k, c]) for m, c in ((source, i), (target, j)))
                q = poses.R[k] @ source.mean[k, i] + poses.t[k] - target.mean[k, j]
                terms.append(np.exp(-0.5 * q @ np.linalg.solve(poses.R[k] @ S @ poses.R[k].T + Q, q)))
            assert result.values[k, 0, i] == pytest.approx(sum(terms), rel=1e-10)
            assert result.cells[k, 0, i] == np.flatnonzero(target.kept[k])[np.argmax(terms)]
            total += sum(terms)
        assert result.score[k] == pytest.approx(total, rel=1e-11)


def test_the_d2d_score_has_no_jumps_and_the_points_score_has():
    """On a line of translations through the room's truth, sampled ten and a hundred times as finely, the largest change
    between neighbours falls with the spacing if cells meet cells. If points meet cells, it stays that of a point
    leaving its cell."""
    scene = room("clean", seed=40)
    target, source = ndt_map.build(scene.target[None], 1.2), ndt_map.build(scene.source[None], 1.2)
    largest = {"cells": [], "points": []}
    for count in (200, 2000, 20_000):
        along = np.column_stack([np.linspace(-0.5, 0.5, count + 1), np.zeros(count + 1)])
        scores = {"cells": [], "points": []}
        for t in np.array_split(along, count // 200):
            rows = np.zeros(len(t), dtype=np.int64)
            poses = Pose.from_angle(np.zeros(len(t)), t)
            scores["cells"].append(d2d_score.evaluate(source, target, poses, t, rows).score)
            scores["points"].append(evaluate(target, scene.source + t[:, None], t, rows, derivatives=False).score)
        for kind, values in scores.items():
            curve = np.concatenate(values)
            largest[kind].append(np.abs(np.diff(curve)).max() / curve.max())
    assert largest["cells"][1] < 0.12 * largest["cells"][0]
    assert largest["cells"][2] < 0.12 * largest["cells"][1]
    assert min(largest["points"][1:]) > 0.3 * largest["points"][0]
    assert largest["points"][2] > 30.0 * largest["cells"][2]


@pytest.mark.parametrize("about", ["pose", "centroid"])
def test_d2d_derivatives_agree_with_differences(rng, about):
    """Gradient and Hessian, with the covariances turned by R, against central differences: at any pose, since nothing
    is looked up."""
    for _ in range(6):
        source, target = clouds_of_cells(rng, 3)
        poses = Pose.from_angle(rng.uniform(-3.0, 3.0, 3), rng.uniform(-0.7, 0.7, (3, 2)))
        pivot = poses.t if about == "pose" else poses.apply(source.mean).mean(axis=1)

        def at(step, source=source, target=target, poses=poses, pivot=pivot):
            neighbours = ndt.moved_by(poses, np.broadcast_to(step, (3, 3)), pivot)
            return d2d_score.evaluate(source, target, neighbours, pivot + step[:2])

        h, result = 1e-5, at(np.zeros(3))
        pairs = [(at(s), at(-s)) for s in h * np.eye(3)]
        gradient = np.stack([-(a.score - b.score) / (2 * h) for a, b in pairs], axis=1)
        hessian = np.stack([(a.gradient - b.gradient) / (2 * h) for a, b in pairs], axis=1)
        np.testing.assert_allclose(result.gradient, gradient, rtol=1e-6, atol=1e-7 * np.abs(gradient).max())
        np.testing.assert_allclose(result.hessian, hessian, rtol=1e-6, atol=1e-7 * np.abs(hessian).max())


def test_d2d_does_not_care_how_both_clouds_are_turned(rng):
    """Turning the target's Gaussians together with the pose changes nothing: the covariances turn the right way."""
    source, target = clouds_of_cells(rng, 1)
    pose = Pose.from_angle([0.4], [[0.2, -0.1]])
    turn = Pose.from_angle([2.1], [[5.0, -3.0]])
    R = turn.R[0]
    turned_cells = replace(target, mean=turn.apply(target.mean), covariance=R @ target.covariance @ R.T)
    a = d2d_score.evaluate(source, target, pose, pose.t)
    b = d2d_score.evaluate(source, turned_cells, turn.compose(pose), pose.t)
    np.testing.assert_allclose(a.score, b.score, rtol=1e-11)


def test_d2d_finds_the_truth_from_nearby_and_from_a_large_motion():
    """Over 25 seeds of the noisy room, started 8° and 0.25 u off a truth of 150°, at least 23 end within 3°."""
    scenes = [room("noise", seed=seed) for seed in SEEDS]
    truth = Pose.from_angle(np.radians(150.0), (3.0, -2.0))
    result = register(
        np.stack([s.source for s in scenes]), truth.apply(np.stack([s.target for s in scenes])), "ndt-d2d",
        start=truth.compose(room_start(8.0, 0.25)), cells=(2.4, 1.2), max_shift=0.5,
    )  # fmt: skip
    assert (rre(result.pose, truth) < np.radians(3.0)).sum() >= 23
    assert (result.status == Status.CONVERGED).all()


def test_a_d2d_batch_is_its_single_runs():
    scenes = [room("combo", seed=seed) for seed in SEEDS[:5]]
    source, target = (np.stack([getattr(s, x) for s in scenes]) for x in ("source", "target"))
    options = {"start": room_start(25.0, 0.7), "cells": (2.4, 1.2), "max_shift": 0.5}
    batch = register(source, target, "ndt-d2d", **options)
    for i in range(5):
        alone = register(source[i], target[i], "ndt-d2d", **options)
        assert alone.steps == batch.steps[i]
        np.testing.assert_allclose(alone.pose.matrix, batch.pose.matrix[i], rtol=1e-12, atol=1e-12)


def test_d2d_says_which_cloud_has_no_cell():
    good = room("noise")
    for source, target, words in ((np.eye(2), good.target, "source"), (good.source, np.eye(2), "target")):
        result = register(source, target, "ndt-d2d")
        assert result.status is Status.DEGENERATE
        assert result.reason.startswith(words)


def test_a_step_that_no_cell_follows_is_taken_back():
    """Two points at 1e100 make cells that any step leaves; the sums over no pairs at all would still be finite."""
    strays = [[1e100, 0.0], [1e100, 0.6], [-1.6, 1e100], [-0.1, 1e100]]
    cluster = [[-0.4, -0.14], [-0.15, 0.6], [0.96, -0.02], [-0.97, 1.3], [-0.7, 1.3], [-0.3, -0.8], [-0.2, -0.7]]
    source = np.array([*strays, *cluster])
    for shift in ([0.0, 0.0], [-850.0, -476.0], [1e6, 0.0]):
        result = register(source, source + np.array(shift), "ndt-d2d")
        assert result.status in (Status.DEGENERATE, Status.STALLED, Status.CONVERGED)
        assert np.isfinite(result.pose.matrix).all()


@pytest.mark.parametrize("distance", [1e2, 1e4, 1e6])
@pytest.mark.parametrize("method", ["ndt", "ndt-d2d"])
def test_a_stray_point_sets_no_unit(method, distance):
    """A source point far beyond the map meets no cell. The centre and radius used to judge small steps leave it out, so
    the run is the same as without it."""
    scene, start = room("clean"), room_start(5.0, 0.3)
    alone = register(scene.source, scene.target, method, start=start)
    result = register(np.vstack([scene.source, [[distance, -distance]]]), scene.target, method, start=start)
    assert alone.status is Status.CONVERGED
    assert (result.status, result.steps) == (alone.status, alone.steps)
    np.testing.assert_allclose(result.pose.matrix, alone.pose.matrix, atol=1e-9)


@pytest.mark.parametrize("distance", [50.0, 1e3, 1e5])
@pytest.mark.parametrize("method", ["ndt", "ndt-d2d"])
def test_strays_of_the_target_hide_none_of_the_source(method, distance):
    """Both clouds with a far return in the same direction, as the largest range of a laser gives: the run is the same
    as without."""
    scene, start = room("clean"), room_start(5.0, 0.3)
    alone = register(scene.source, scene.target, method, start=start)
    far = [[distance, -distance]]
    result = register(np.vstack([scene.source, far]), np.vstack([scene.target, far]), method, start=start)
    assert (result.status, result.steps) == (alone.status, alone.steps)
    np.testing.assert_allclose(result.pose.matrix, alone.pose.matrix, atol=1e-9)


def test_a_cloud_that_starts_far_off_is_no_stray():
    """If every point starts beyond the target's surroundings, all of them count for centre and radius."""
    scene, start = room("clean"), Pose.from_angle(0.0, (1e3, 0.0))
    state = register(scene.source, scene.target, "ndt", start=start).states[0]
    np.testing.assert_allclose(state.centre[0], scene.source.mean(axis=0))
