"""What a result, a single pose and a start that was rounded are in Python's own terms."""

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.core.edges import Edges
from solvers.scenes.rooms import room


@pytest.fixture(scope="module")
def scene():
    return room("clean")


@pytest.mark.parametrize("d", [2, 3])
def test_a_start_whose_matrix_was_rounded_is_a_rigid_motion(rng, random_pose, d):
    """To float32 and to seven digits; one that is scaled in truth is told with its scale."""
    points, start = rng.standard_normal((30, d)), random_pose(rng, d)
    for rounded in (start.matrix.astype(np.float32), np.round(start.matrix, 7)):
        found = register(points, start.apply(points), start=rounded)
        assert found.pose.scale == 1.0
        assert np.abs(found.pose.matrix - start.matrix).max() < 1e-6
        if d == 2:
            assert Edges([0], [1], Pose.from_matrix(rounded[None]), np.eye(3)).relative.scale == [1.0]
    with pytest.raises(ValueError, match=r"^start.scale: scale the source first.* at scale 1, not 1.00001$"):
        register(points, points, start=Pose(start.R, start.t, 1.00001))


def test_a_result_is_true_where_its_status_is(scene):
    """One that has found nothing is false; a batch has no one answer; a single pose is no sequence of any."""
    lost = register(scene.source, scene.target, gate=1e-9)
    assert (bool(lost), lost.status) == (False, Status.DEGENERATE)
    assert bool(register(scene.source, scene.target)) is True
    batch = register([scene.source] * 2, [scene.target] * 2)
    with pytest.raises(ValueError, match=r"batch of shape \(2,\) is neither true nor false; ended"):
        bool(batch)
    for each in (lost.pose, register(scene.source, scene.target).covariance):
        with pytest.raises(TypeError, match="a single pose has no rows"):
            list(each)
    assert len(list(batch.pose)) == 2
