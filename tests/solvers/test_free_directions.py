"""Directions that a scene leaves free (walls, circles, planes, two points) are reported, and all others are found."""

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.metrics import rre, rte
from solvers.numerics import gauss_newton
from solvers.scenes.rooms import room, room_start

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
BOTH = pytest.mark.parametrize("method", ["point-to-plane", "gicp"])


def turn(angle):
    return Pose.from_angle(angle).R


def in_space(axis, angle):
    return gauss_newton.rotation(angle * np.asarray(axis, dtype=float) / np.linalg.norm(axis))


def surface_in_space(rng, n):
    """Points on two faces of a box and on a dome: they constrain every motion."""
    u = rng.uniform(-2.0, 2.0, (n, 2))
    faces = [
        np.column_stack([u[: n // 3], np.full(n // 3, -1.0)]),
        np.column_stack([np.full(n // 3, 2.0), u[n // 3 : 2 * (n // 3)] * [1.0, 0.5]]),
        np.column_stack([u[2 * (n // 3) :], 0.2 * (u[2 * (n // 3) :] ** 2).sum(axis=1)]),
    ]
    return np.vstack(faces)


def wall(n=60, d=2):
    rng = np.random.default_rng(2)
    points = rng.uniform(-3.0, 3.0, (n, d))
    points[:, -1] = 0.0
    return points


@BOTH
def test_a_corner_is_observable_and_found_from_a_large_motion(method):
    """The room from 45° and 1.43 u away: the truth is found to within the noise, and no direction is reported free."""
    scene = room("clean")
    result = register(scene.source, scene.target, method, start=room_start(), gate=2.6)
    assert result.status is Status.CONVERGED
    assert rre(result.pose, scene.truth) < np.radians(0.5)
    assert rte(result.pose, scene.truth) < 0.03
    assert not result.states[0].system.free.any()


def test_one_straight_wall_leaves_its_slide_free():
    """Point to plane on one wall turns and moves the scan onto it, and is degenerate: the slide along it is named."""
    tilt = turn(np.radians(30.0))
    start = Pose.from_angle(np.radians(-20.0), (0.7, 0.4))
    result = register(wall() @ tilt.T, wall() @ tilt.T, "point-to-plane", start=start)
    assert result.status is Status.DEGENERATE
    assert "slide along" in result.reason
    system = result.states[0].system
    np.testing.assert_allclose(np.abs(system.directions[0, :2, 0] @ tilt[:, 0]), 1.0, atol=1e-6)
    assert abs(system.directions[0, 2, 0]) < 1e-6
    assert system.condition[0] > 1e6
    # The observable part was still found: every moved point lies on the wall.
    assert np.abs(result.transform(wall() @ tilt.T) @ tilt[:, 1]).max() < 1e-9


def test_a_noisy_wall_says_how_weak_its_slide_is():
    """Noise tilts the normals, so the slide is not exactly free: the condition number and the weak direction still
    reveal it, and a run may require a direction to be held more firmly before it trusts it."""
    rng = np.random.default_rng(7)
    target = wall() + 0.02 * rng.standard_normal((60, 2))
    result = register(wall()[::2], target, "point-to-plane", start=Pose.from_angle(0.1, (0.3, 0.2)))
    system = result.states[0].system
    assert 10.0 < system.condition[0] < 1e6
    assert abs(system.directions[0, 0, 0]) > 0.99
    strict = register(wall()[::2], target, "point-to-plane", start=Pose.from_angle(0.1, (0.3, 0.2)), free_below=0.1)
    assert strict.status is Status.DEGENERATE
    assert "slide along" in strict.reason


def test_on_a_circle_the_turn_is_free():
    """Point to plane on a circle is degenerate: the turn about its centre is named as free, and the rest is found."""
    angle = 2.0 * np.pi * np.arange(48) / 48
    circle = 2.0 * np.column_stack([np.cos(angle), np.sin(angle)]) + [3.0, 1.0]
    result = register(circle, circle, "point-to-plane", start=Pose.from_angle(0.05, (0.2, -0.1)))
    assert result.status is Status.DEGENERATE
    assert "turn about (3.00, 1.00)" in result.reason
    start = Pose.from_angle(0.05, (0.2e-3, -0.1e-3))
    small = register(1e-3 * circle, 1e-3 * circle, "point-to-plane", start=start)
    assert "turn about (0.00300, 0.00100)" in small.reason
    np.testing.assert_allclose(np.linalg.norm(result.transform(circle) - [3.0, 1.0], axis=1), 2.0, atol=1e-3)


def test_a_plane_in_space_leaves_two_slides_and_a_turn_free():
    """A single plane determines three of the six motions in space; the scan ends on it, and the run is degenerate."""
    flat = wall(150, 3)
    R = in_space((1.0, 2.0, -0.5), 0.9)
    result = register(flat @ R.T, flat @ R.T, "point-to-plane", start=Pose(in_space((0, 1, 1), 0.2), (0.1, 0.2, 0.3)))
    assert result.status is Status.DEGENERATE
    assert result.states[0].system.free.tolist() == [[True, True, True, False, False, False]]
    assert "3 of 6" in result.reason
    assert np.abs(result.transform(flat @ R.T) @ R[:, 2]).max() < 1e-8


@BOTH
def test_in_space_a_large_motion_is_found(method, rng):
    """Three surfaces in space, turned by 140° and moved, started 20° off: the motion is recovered, with det R = 1."""
    points = surface_in_space(rng, 240)
    truth = Pose(in_space((0.3, -1.0, 0.5), np.radians(140.0)), (0.6, -0.3, 0.4))
    start = truth.compose(Pose(in_space((1.0, 1.0, -0.2), np.radians(20.0)), (0.1, 0.05, -0.1)))
    source = (points - truth.t) @ truth.R
    result = register(source, points, method, start=start)
    assert result.status is Status.CONVERGED
    np.testing.assert_allclose(result.pose.matrix, truth.matrix, atol=1e-4)
    assert np.linalg.det(result.pose.R) == pytest.approx(1.0, abs=1e-13)


@BOTH
@pytest.mark.parametrize(
    ("name", "source", "target", "options", "words"),
    [
        ("coincident", np.full((6, 2), 0.5), np.full((5, 2), -0.5), {}, ""),
        ("no overlap", room().source + 100.0, room().target, {"gate": 2.0}, "gate of 2 u"),
        ("one point", np.zeros((1, 2)), np.ones((1, 2)), {}, ""),
    ],
)
def test_hopeless_scenes_are_degenerate_and_leave_the_batch_alone(method, name, source, target, options, words):
    result = register([room().source, source], [room().target, target], method, **options)
    assert result.status[1] == Status.DEGENERATE
    assert words in result.reason[1]
    assert result.status[0] == Status.CONVERGED
    assert np.isfinite(result.pose.matrix).all()


def test_two_points_are_a_wall():
    two = np.array([[0.0, 0.0], [2.0, 0.0]])
    result = register(two, two + np.array([0.3, 0.2]), "point-to-plane")
    assert result.status is Status.DEGENERATE
    assert "slide along (1.00, 0.00)" in result.reason


def test_gicp_keeps_a_hundredth_of_its_hold_along_a_wall():
    """Canonical covariances keep some precision along the tangent, so on one wall GICP also determines the slide, from
    pairs that carry no information on it: a hundredth of the precision across. The condition number shows this, the
    status does not."""
    result = register(wall()[::2], wall(), "gicp", start=Pose.from_angle(0.1, (0.3, 0.2)))
    assert result.status is Status.CONVERGED
    system = result.states[0].system
    np.testing.assert_allclose(system.condition, 100.0, rtol=0.05)
    np.testing.assert_allclose(np.abs(system.directions[0, :, 0]), [1.0, 0.0, 0.0], atol=0.02)


def test_gicp_on_a_circle_holds_its_turn_at_a_hundredth():
    angle = 2.0 * np.pi * np.arange(48) / 48
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    system = register(circle, circle, "gicp", max_steps=0).states[0].system
    np.testing.assert_allclose(system.eigenvalues[0], [0.5, 25.25, 25.25], rtol=1e-9)
    np.testing.assert_allclose(np.abs(system.directions[0, :, 0]), [0.0, 0.0, 1.0], atol=1e-9)
