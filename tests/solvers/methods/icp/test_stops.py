"""When a run of nearest points stops: not for apparent rest, and not before everything that can be fitted is."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.icp import surface_icp
from solvers.methods.icp.icp import ONE_PARTNER
from solvers.scenes import room

START = Pose.from_angle(np.radians(25.0), (0.6, -0.4))


def clouds(count: int = 25, m: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """`count` noisy corners, each seen twice: both clouds are (count, m, 2)."""
    rng = np.random.default_rng(5)
    side = rng.uniform(0.0, 4.0, (2, count, m // 2))
    corner = np.concatenate([np.stack([side[0], 0 * side[0]], -1), np.stack([0 * side[1], side[1]], -1)], axis=1)
    return corner + 0.05 * rng.normal(size=corner.shape), corner + 0.05 * rng.normal(size=corner.shape)


def problem_of(source: np.ndarray, target: np.ndarray, start: Pose) -> Problem:
    b = len(source)
    starts = Pose.trusted(np.broadcast_to(start.R, (b, 2, 2)), np.broadcast_to(start.t, (b, 2)), np.ones(b))
    return Problem(source, target, np.ones(source.shape[:2]), starts, np.zeros(b, dtype=np.int64))


@pytest.mark.parametrize("method", ["icp", "point-to-plane"])
def test_an_rms_has_come_to_rest_only_over_as_many_pairs(method: str) -> None:
    """While a gate adds and drops pairs, an equal RMS belongs to other pairs."""
    source, target = clouds()
    problem = problem_of(source, target, START)
    options = METHODS[method].options(gate=0.5, rms_tolerance=0.2)
    batch = begin(METHODS[method], problem, options)
    counts = [batch.state().pairing.count]
    while not batch.done:
        batch = advance(batch)
        counts.append(batch.state().pairing.count)
    rows = np.flatnonzero(batch.state().reason == "the RMS has come to rest")
    assert len(rows) > 10
    for i in rows:
        k = int(batch.steps[i])
        assert counts[k][i] == counts[k - 1][i]


def test_a_fit_without_a_rotation_does_not_come_to_rest_by_its_rms() -> None:
    """With two points around the one that both are paired with, only their middle can be fitted, and the RMS hardly
    changes."""
    ends = np.array([[-50.0, 0.0], [50.0, 0.0]])
    lone = np.array([[0.0, 1.0], [0.0, 1e4]])
    result = register(ends, lone, "icp", rms_tolerance=0.5)
    assert result.status == Status.DEGENERATE
    assert "rotation" in result.reason


def test_the_smallest_share_kept_is_one_pair() -> None:
    source, target = (cloud[0] for cloud in clouds(1))
    problem = problem_of(source[None], target[None], Pose.identity())
    state = begin(METHODS["trimmed-icp"], problem, METHODS["trimmed-icp"].options(keep=0.001)).state()
    assert state.pairing.count.tolist() == [1]


def test_along_a_corridor_the_other_directions_are_fitted_first() -> None:
    """Two parallel walls leave the slide free; this is reported only once turn and distance are right."""
    along = np.linspace(-4.0, 4.0, 41)
    walls = np.concatenate([np.stack([along, np.full(41, y)], axis=1) for y in (-1.0, 1.0)])
    result = register(walls, walls, "point-to-plane", start=Pose.from_angle(np.radians(12.0), (0.0, 0.3)))
    assert result.status == Status.DEGENERATE
    assert result.steps > 1
    assert abs(np.degrees(result.pose.angle)) < 1e-3
    assert abs(result.pose.t[1]) < 1e-3


@pytest.mark.parametrize("method", ["icp", "trimmed-icp", "capped-icp", "fast-robust-icp"])
def test_clouds_in_other_units_are_told_so(method):
    """A source in the wrong unit, a thousand times too small, has one nearest target point for all; a target of equal
    points is reported as before."""
    scene = room("clean")
    result = register(1e-3 * scene.source, scene.target, method)
    assert (result.status, result.reason) == (Status.DEGENERATE, ONE_PARTNER)
    equal = register(scene.source, np.full((9, 2), 0.7), "icp")
    assert "all target points with weight are equal" in equal.reason


@pytest.mark.parametrize("seed", range(40, 45))
def test_gicp_is_told_of_other_units_although_its_surfaces_hold_the_turn(seed: int) -> None:
    """The covariances give a full-rank system even for a single shared partner. In a batch only such problems are
    degenerate, in either unit, even beside a run that cycles."""
    scene = room("noise", seed=seed)
    sources = np.stack([scene.source, 1e-3 * scene.source, scene.source])
    targets = np.stack([scene.target, scene.target, 1e3 * scene.target])
    result = register(sources, targets, "gicp")
    alone = register(scene.source, scene.target, "gicp")
    assert result.status[0] == alone.status != Status.DEGENERATE
    assert np.array_equal(result.matrix[0], alone.matrix)
    assert result.status[1:].tolist() == [Status.DEGENERATE] * 2
    assert result.reason[1:].tolist() == [surface_icp.ONE_PARTNER] * 2


def test_one_target_point_is_told_as_such_and_not_as_another_unit() -> None:
    scene = room("clean")
    result = register(scene.source, np.full((9, 2), 0.7), "gicp")
    assert result.reason == "all target points are equal: the rotation is undefined"
    assert register(scene.source[:1], scene.target, "gicp").reason != surface_icp.ONE_PARTNER
