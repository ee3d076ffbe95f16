"""The exponential map of SE(2), its inverse, and the adjoint: group laws and the small-angle limit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose
from solvers.uncertainty import adjoint, exp, from_matrix, log, spread_of

ANGLE = st.floats(-3.1, 3.1)
LENGTH = st.floats(-50.0, 50.0)


def close(a, b):
    np.testing.assert_allclose(a.matrix, b.matrix, atol=1e-9)


@given(ANGLE, LENGTH, LENGTH)
def test_log_undoes_exp(angle, x, y):
    np.testing.assert_allclose(log(exp([angle, x, y])), [angle, x, y], atol=1e-8)


@given(ANGLE, LENGTH, LENGTH)
def test_half_a_twist_twice_is_the_whole(angle, x, y):
    half = exp(np.array([angle, x, y]) / 2.0)
    close(half.compose(half), exp([angle, x, y]))


@given(ANGLE, LENGTH, LENGTH, ANGLE, LENGTH, LENGTH)
def test_the_adjoint_takes_a_twist_to_the_other_side(angle, x, y, turn, a, b):
    pose = Pose.from_angle(turn, (a, b))
    twist = np.array([angle, x, y])
    close(pose.compose(exp(twist)), exp(adjoint(pose) @ twist).compose(pose))


def test_the_adjoint_of_a_composition_is_the_product():
    a, b = Pose.from_angle(0.7, (1.0, -2.0)), Pose.from_angle(-2.0, (0.3, 5.0))
    np.testing.assert_allclose(adjoint(a.compose(b)), adjoint(a) @ adjoint(b), atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-9, 1e-5])
def test_a_small_angle_is_no_division_by_nothing(angle):
    np.testing.assert_allclose(exp([angle, 2.0, 3.0]).t, [2.0, 3.0], atol=1e-4)
    np.testing.assert_allclose(log(exp([angle, 2.0, 3.0])), [angle, 2.0, 3.0], atol=1e-12)


def test_half_a_turn_has_a_twist():
    result = log(Pose.from_angle(np.pi, (2.0, 0.0)))
    assert np.isfinite(result).all()
    close(exp(result), Pose.from_angle(np.pi, (2.0, 0.0)))


def test_batches_are_their_single_twists():
    twists = np.random.default_rng(1).uniform(-2.0, 2.0, (4, 5, 3))
    poses = exp(twists)
    assert poses.batch == (4, 5)
    close(poses[2, 3], exp(twists[2, 3]))
    np.testing.assert_array_equal(log(poses)[1, 1], log(poses[1, 1]))


def test_what_is_no_twist_and_no_rigid_motion_of_the_plane_is_refused():
    for wrong in ([0.1, 0.2, 0.3, 0.4], 1.0, [0.0, np.nan, 0.0]):
        with pytest.raises(ValueError, match=r"^twist: "):
            exp(wrong)
    wrong = {
        "pose.scale: ": Pose.from_angle(0.1, scale=5.0),
        "pose: moves .*, a twist is planar": Pose.identity(3),
        "pose: exp": np.eye(3),
    }
    for message, pose in wrong.items():
        for tell in (log, adjoint):
            with pytest.raises(ValueError, match=f"^{message}"):
                tell(pose)


def test_poses_of_float32_are_rigid_motions_here_as_elsewhere():
    """Such a matrix's scale differs from 1 by rounding, which `register` and pose graphs take as 1."""
    exact = Pose.from_angle([0.5, 0.52, 0.51], [[1.0, 2.0], [1.1, 2.0], [1.0, 2.1]])
    coarse = Pose.from_matrix(exact.matrix.astype(np.float32))
    assert (np.asarray(coarse.scale) != 1.0).any()
    np.testing.assert_allclose(log(coarse), log(exact), atol=1e-6)
    np.testing.assert_allclose(adjoint(coarse), adjoint(exact), atol=1e-6)
    spread = from_matrix(np.diag([0.01, 0.04, 0.01]), coarse[0])
    assert spread.mean.scale == 1.0
    np.testing.assert_allclose(spread.along(coarse), spread.along(exact), atol=1e-6)
    ends = [spread_of(poses, centre=(0.0, 0.0), radius=1.0).whole for poses in (coarse, exact)]
    np.testing.assert_allclose(ends[0].deviations, ends[1].deviations, atol=1e-6)
    for pose in (Pose.from_angle(0.5, scale=2.0), Pose.from_angle(0.5, scale=1.00001)):
        with pytest.raises(ValueError, match="of scale 1, not"):
            log(pose)
        with pytest.raises(ValueError, match=r"^mean.scale: .*of scale 1, not"):
            from_matrix(np.eye(3), pose)
