"""Collinear pairs: the family of optima, whose members have equal residuals, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose, fit_rigid, register
from solvers.collinear import poses_about_line
from solvers.metrics import residuals

TURNS = np.radians(np.arange(-180.0, 180.0, 15.0))
COMPONENTS = st.floats(-1.0, 1.0).map(lambda x: round(x, 3))
VECTORS = st.tuples(COMPONENTS, COMPONENTS, COMPONENTS).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.1)


def squares(pose, p, q):
    return (residuals(pose, p, q) ** 2).sum(axis=-1)


@settings(max_examples=40, deadline=None)
@given(VECTORS, VECTORS, VECTORS, st.floats(0.0, 0.4))
def test_all_fit_equally_well_and_none_better(direction, other, place, noise):
    """The sum of squares is the same for every turn; tilting any of these poses slightly, either way, raises it."""
    a = np.array([-1.0, 0.3, 0.9, 2.0])
    source = place + a[:, None] * direction
    target = a[:, None] * other + noise * np.random.default_rng(3).standard_normal((4, 3))
    poses = poses_about_line(source, target, TURNS)
    sums = squares(poses, source, target)
    np.testing.assert_allclose(sums, sums[0], rtol=1e-9, atol=1e-20)
    np.testing.assert_allclose(np.linalg.det(poses.R), 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.R @ poses.R.swapaxes(-1, -2) - np.eye(3), 0.0, atol=1e-12)
    centre = target.mean(axis=0)
    for axis in np.eye(3):
        for turn in (1e-3, -1e-3):
            tilt = Pose.from_rotvec(turn * axis)
            beside = Pose(tilt.R, centre - tilt.R @ centre).compose(poses)
            assert (squares(beside, source, target) >= sums * (1.0 - 1e-9) - 1e-20).all()


def test_with_a_fourth_pair_off_the_line_the_fit_takes_one_of_them():
    """Exact pairs on a line and one off it: the closed form's pose is in the family, at the fourth pair's angle."""
    source = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 0.7, 0.0]])
    truth = Pose.from_rotvec((0.4, -1.1, 0.8), (0.2, 0.3, -1.0))
    target = truth.apply(source)
    fit = fit_rigid(source, target)
    np.testing.assert_allclose(fit.pose.matrix, truth.matrix, atol=1e-12)
    poses = poses_about_line(source[:3], target[:3], np.linspace(-np.pi, np.pi, 3601))
    gaps = np.linalg.norm(poses.apply(source[3:])[:, 0] - target[3], axis=-1)
    assert gaps.min() < 0.7 * np.radians(0.1)
    assert gaps.max() == pytest.approx(1.4, abs=1e-5)


@pytest.mark.parametrize("v", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (-1.0, 1e-9, 0.0), (-1.0, 1e-16, 0.0)])
def test_the_least_turn_is_the_angle_between_the_lines(v):
    """For equal, opposite and nearly opposite directions, the rotation is exactly the angle between them."""
    a = np.array([[-1.0], [0.0], [2.0]])
    u, v = np.array([1.0, 0.0, 0.0]), np.array(v) / np.linalg.norm(v)
    pose = poses_about_line(a * u, a * v)
    np.testing.assert_allclose(pose.apply(a * u), a * v, atol=1e-12)
    assert pose.angle == pytest.approx(np.arctan2(np.linalg.norm(np.cross(u, v)), u @ v), abs=1e-12)


def test_the_turn_is_about_the_line_from_its_first_point_on():
    """A quarter turn is about the line from first to last point; with the rows reversed, it turns the other way."""
    line = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 3.0]])
    point = np.array([[1.0, 0.0, 0.0]])
    for rows, to in ((line, 1.0), (line[::-1], -1.0)):
        quarter = poses_about_line(rows, rows, np.pi / 2)
        np.testing.assert_allclose(quarter.apply(point), [[0.0, to, 0.0]], atol=1e-12)


@pytest.mark.parametrize(
    ("source", "target", "words"),
    [
        (np.eye(3), np.eye(3), "source: expected different points in a line"),
        (np.zeros((3, 3)), np.eye(3), "source: expected different points in a line"),
        (np.outer([0.0, 1.0, 2.0], [1.0, 0.0, 0.0]), np.ones((3, 3)), "target"),
        (np.outer([-1.0, 0.0, 1.0], [1.0, 0.0, 0.0]), np.outer([1.0, 0.0, 1.0], [0.0, 1.0, 0.0]), "target"),
        (np.zeros((2, 3, 3)), np.zeros((2, 3, 3)), "one cloud"),
        (np.zeros((3, 2)), np.zeros((3, 2)), "source"),
    ],
)
def test_what_has_no_line_is_refused(source, target, words):
    with pytest.raises(ValueError, match=words):
        poses_about_line(source, target)


@pytest.mark.parametrize("size", [1e-280, 1e-170, 1e149])
def test_clouds_of_any_size_have_a_line(size):
    """Squares of such coordinates would underflow or overflow; the turn is still that of clouds of size one."""
    line, upright = (np.outer([0.0, 1.0, 3.0], axis) for axis in ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    pose = poses_about_line(size * line, size * upright, 0.3)
    np.testing.assert_allclose(pose.R, poses_about_line(line, upright, 0.3).R, atol=1e-12)
    np.testing.assert_allclose(pose.apply(size * line) / size, upright, atol=1e-12)


def test_what_is_no_angle_is_refused_by_name():
    line = np.outer([0.0, 1.0, 3.0], [1.0, 0.0, 0.0])
    for wrong, text in ((np.nan, "nan is not finite"), (None, "expected real numbers"), ("a", "expected real numbers")):
        with pytest.raises(ValueError, match=f"^angle: {text}"):
            poses_about_line(line, line, wrong)


@pytest.mark.parametrize("origin", [0.0, 5e6])
def test_what_the_fit_calls_collinear_has_its_poses(origin):
    """This holds even for rounded coordinates: far from the origin, or in single precision."""
    line = np.linspace([0.0, 0.0, 0.0], [1.0, 0.7, 0.3], 10) + origin
    if not origin:
        line = line.astype(np.float32).astype(float)
    result = register(line, line + 1.0, "kabsch")
    assert "collinear" in result.reason
    poses = poses_about_line(line, line + 1.0, [0.0, 1.0])
    assert np.abs(poses.apply(line) - (line + 1.0)).max() < 1e-6 * max(origin, 1.0)


@pytest.mark.parametrize("origin", [(5e10, 5e10, 5e10), (-5e10, -5e10, -5e10), (0.0, -5e10, 0.0)])
def test_a_line_far_away_is_one_up_to_the_rounding_of_its_points(origin):
    """On either side of the origin: there the points are known to 4e-6 u, and lie farther than 1e-7 off their line."""
    line = np.linspace([0.0, 0.0, 0.0], [1.0, 0.7, 0.3], 10) + origin
    poses = poses_about_line(line, line + 1.0, [0.0, 1.0])
    assert np.abs(poses.apply(line) - (line + 1.0)).max() < 1e-15 * np.abs(origin).max()
    with pytest.raises(ValueError, match="in a line"):
        poses_about_line(line + np.outer(np.arange(10) % 2, [0.0, 0.0, 0.1]), line, 0.0)
