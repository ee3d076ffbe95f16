"""Source rows without weight may lie anywhere: neither answer nor stop depends on them."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import Pose, register
from solvers.drives import Drive, telecom_loop
from solvers.odometry import match, prepare

METHODS = ("icp", "capped-icp", "kiss-threshold-icp", "fast-robust-icp", "point-to-plane", "gicp")
START = Pose.from_angle(0.05)


@pytest.mark.parametrize("far", [1e3, 1e6])
@pytest.mark.parametrize("method", METHODS)
def test_rows_without_weight_change_nothing(method: str, far: float) -> None:
    """As many as there are others, or one, a thousand and a million units away."""
    rng = np.random.default_rng(2)
    p = rng.normal(size=(80, 2)) * (3.0, 2.0)
    q = Pose.from_angle(0.1, (0.4, -0.3)).apply(p) + 0.01 * rng.normal(size=p.shape)
    alone = register(p, q, method, start=START)
    for count in (1, 80):
        padded = np.vstack([p, np.full((count, 2), far)])
        weights = np.repeat([1.0, 0.0], [80, count])
        found = register(padded, q, method, start=START, weights=weights)
        assert (found.status, found.steps) == (alone.status, alone.steps)
        np.testing.assert_allclose(found.pose.matrix, alone.pose.matrix, atol=1e-7)


def test_a_match_does_not_depend_on_the_other_scans_of_its_drive() -> None:
    """The first two scans have few echoes and are padded to the length of the third, if that is there."""
    whole = telecom_loop()
    k = 60  # on the move
    ranges = np.array(whole.ranges[k : k + 3])
    ranges[:2, 60:] = np.inf
    found = []
    for n in (2, 3):
        seconds, motion = whole.seconds[k : k + n], whole.motion[k : k + n]
        drive = Drive(seconds, motion, ranges[:n], whole.bearings, whole.mount)
        found.append(match(prepare(drive), [1], [0], drive.motion[[1]]))
    two, three = found
    np.testing.assert_allclose(two.pose.matrix, three.pose.matrix, atol=1e-9)
    np.testing.assert_allclose(two.weakest, three.weakest, rtol=1e-6)
    np.testing.assert_array_equal(two.share, three.share)
    assert two.believed == three.believed
