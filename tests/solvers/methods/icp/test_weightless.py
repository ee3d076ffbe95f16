"""Source rows with zero weight may lie anywhere: neither the answer nor the stop depends on them."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.drives import Drive, telecom_loop
from solvers.metrics import rre, rte
from solvers.odometry import match, prepare
from solvers.scenes import room, room_start
from solvers.verify import evidence

METHODS = ("icp", "capped-icp", "kiss-threshold-icp", "fast-robust-icp", "point-to-plane", "gicp")
START = Pose.from_angle(0.05)


@pytest.mark.parametrize("distance", [1e3, 1e6])
@pytest.mark.parametrize("method", METHODS)
def test_rows_without_weight_change_nothing(method: str, distance: float) -> None:
    """One such row, or as many as there are others, a thousand or a million units away."""
    rng = np.random.default_rng(2)
    p = rng.normal(size=(80, 2)) * (3.0, 2.0)
    q = Pose.from_angle(0.1, (0.4, -0.3)).apply(p) + 0.01 * rng.normal(size=p.shape)
    alone = register(p, q, method, start=START)
    for count in (1, 80):
        cloud = np.vstack([p, np.full((count, 2), distance)])
        weights = np.repeat([1.0, 0.0], [80, count])
        result = register(cloud, q, method, start=START, weights=weights)
        assert (result.status, result.steps) == (alone.status, alone.steps)
        np.testing.assert_allclose(result.pose.matrix, alone.pose.matrix, atol=1e-7)


@pytest.mark.parametrize("distance", [1e2, 1e4, 1e6])
@pytest.mark.parametrize("method", ["icp", "point-to-plane", "gicp"])
def test_a_point_beyond_the_gate_changes_nothing(method: str, distance: float) -> None:
    """It is in no pair, so pose, steps and condition do not depend on how far away it is."""
    scene = room("clean")
    alone = register(scene.source, scene.target, method, start=room_start(20.0, 0.8), gate=2.6)
    stray = np.vstack([scene.source, [[distance, -distance]]])
    result = register(stray, scene.target, method, start=room_start(20.0, 0.8), gate=2.6)
    assert alone.status is Status.CONVERGED
    assert (result.status, result.steps) == (alone.status, alone.steps)
    np.testing.assert_allclose(result.pose.matrix, alone.pose.matrix, atol=1e-7)
    conditions = [getattr(run.states[0], "system", run.states[0]).condition for run in (alone, result)]
    np.testing.assert_allclose(conditions[1], conditions[0], rtol=1e-6)


@pytest.mark.parametrize("distance", [1e2, 1e4])
@pytest.mark.parametrize("method", ["ndt", "ndt-d2d", "mmd", "gmmreg", "soft-annealed", "capped-icp", "filterreg"])
def test_a_stray_target_point_decides_no_default_length(method: str, distance: float) -> None:
    """The defaults follow from the rest of the target, and so does the end of the run, to within the noise: the stray
    still has a share in the soft methods' sums."""
    scene, start = room("clean"), room_start(10.0, 0.3)
    alone = register(scene.source, scene.target, method, start=start).pose
    result = register(scene.source, np.vstack([scene.target, [[distance, 0.0]]]), method, start=start).pose
    assert np.degrees(rre(result, alone)) < 0.3
    assert rte(result, alone) < 0.03


@pytest.mark.parametrize("far", [100.0, 1000.0])
def test_a_stray_source_point_keeps_mmd_near_its_start(far: float) -> None:
    """As its docstring warns: started 10° off it ends within 1°, but with a point added far away 5° off or more."""
    scene, start = room("noise"), room_start(10.0, 0.3)
    alone = register(scene.source, scene.target, "mmd", start=start).pose
    result = register(np.vstack([scene.source, [[far, -far]]]), scene.target, "mmd", start=start).pose
    assert np.degrees(rre(alone, scene.truth)) < 1.0
    assert np.degrees(rre(result, scene.truth)) > 5.0


def test_evidence_takes_no_part_in_what_it_does_not_explain() -> None:
    """A source point far from every target point leaves `weakest` unchanged; the share falls by that point."""
    scene = room("clean")
    alone = evidence(scene.source, scene.target, scene.truth)
    for distance in (1e2, 1e6):
        estimate = evidence(np.vstack([scene.source, [[distance, 0.0]]]), scene.target, scene.truth)
        np.testing.assert_allclose(estimate.weakest, alone.weakest, rtol=1e-6)
        m = len(scene.source)
        np.testing.assert_allclose(estimate.share, alone.share * m / (m + 1))


def test_a_weight_near_zero_is_nearly_none() -> None:
    """A far row with a weight of 1e-30 gives the same run, up to rounding, as no such row."""
    scene = room("clean")
    cloud, weights = np.vstack([scene.source, [[1e4, 0.0]]]), np.r_[np.ones(len(scene.source)), 1e-30]
    for method in ("point-to-plane", "gicp"):
        alone = register(scene.source, scene.target, method, start=room_start(20.0, 0.8))
        result = register(cloud, scene.target, method, start=room_start(20.0, 0.8), weights=weights)
        assert (result.status, result.steps) == (alone.status, alone.steps)
        np.testing.assert_allclose(result.pose.matrix, alone.pose.matrix, atol=1e-7)


def test_a_match_does_not_depend_on_the_other_scans_of_its_drive() -> None:
    """The first two scans have few echoes, and are padded to the length of the third if there is one."""
    whole = telecom_loop()
    k = 60  # on the move
    ranges = np.array(whole.ranges[k : k + 3])
    ranges[:2, 60:] = np.inf
    results = []
    for n in (2, 3):
        seconds, motion = whole.seconds[k : k + n], whole.motion[k : k + n]
        drive = Drive(seconds, motion, ranges[:n], whole.bearings, whole.mount)
        results.append(match(prepare(drive), [1], [0], drive.motion[[1]]))
    two, three = results
    np.testing.assert_allclose(two.pose.matrix, three.pose.matrix, atol=1e-9)
    np.testing.assert_allclose(two.weakest, three.weakest, rtol=1e-6)
    np.testing.assert_array_equal(two.share, three.share)
    assert two.believed == three.believed
