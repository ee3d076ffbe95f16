"""Several poses as one batch."""

import numpy as np
import pytest

from solvers import Pose
from solvers.posegraph import Edges, concatenated, optimise, stacked
from solvers.uncertainty import spread_of

ONE, OTHER = Pose.identity(), Pose.from_angle(0.5, (1.0, 2.0), 2.0)


def test_poses_side_by_side_and_one_after_the_other(rng, random_pose):
    a, b = random_pose(rng, 3, (2, 4), scaled=True), random_pose(rng, 3, (2, 4), scaled=True)
    poses = stacked((a, b))
    assert poses.batch == (2, 2, 4)
    assert poses[0] == a
    assert poses[1] == b
    row = concatenated([a, b, a[:0]])
    assert row.batch == (4, 4)
    assert row[:2] == a
    assert row[2:] == b
    assert stacked([ONE, OTHER]).scale.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: stacked([]), "poses: is empty"),
        (lambda: stacked(ONE), "poses: expected a sequence of poses, got Pose"),
        (lambda: stacked([ONE, np.eye(3)]), "poses: expected a Pose, got ndarray; Pose.from_matrix"),
        (lambda: stacked([ONE, Pose.identity(3)]), r"poses: number 0 is of shape \(\) in 2 dimensions, number 1 "),
        (lambda: stacked([ONE, ONE, Pose.identity(batch=(2,))]), "poses: number 0 .* number 2 of"),
        (lambda: concatenated(()), "parts: is empty"),
        (lambda: concatenated([ONE]), "parts: number 0 is a single pose; stacked joins single poses"),
        (lambda: concatenated([Pose.identity(batch=(1,)), Pose.identity(3, (1,))]), "parts: number 0 .* in 3"),
    ],
)
def test_what_does_not_make_a_batch_is_refused(call, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        call()


def test_a_list_of_poses_is_told_how_to_become_one():
    legs = Edges([0], [1], Pose.identity(batch=(1,)), np.eye(3))
    for call in (lambda poses: optimise(poses, legs), lambda poses: spread_of(poses, centre=(0, 0), radius=1.0)):
        for poses in ([ONE, ONE], (ONE, ONE)):
            with pytest.raises(ValueError, match=r"^poses: expected a Pose, got \w+ of poses; solvers\.posegraph\.st"):
                call(poses)
        call(stacked([ONE, Pose.from_angle(0.0, (0.1, 0.0))]))
