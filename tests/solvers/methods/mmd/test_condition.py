"""MMD-Reg: the condition of its Hessian, with shifts and turns made comparable, against finite differences."""

from itertools import product

import numpy as np
import pytest

from solvers import Pose
from solvers.methods.mmd.derivative import derivatives, implicit_derivative
from solvers.numerics.fourier_features import unit_frequencies


def scene(rng):
    """An elongated cloud far from its origin, the same cloud moved, the pose that moves it, and frequencies for a
    length scale of 2 u."""
    source = rng.uniform(-1.0, 1.0, (30, 2)) * [4.0, 1.0] + [30.0, -20.0]
    pose = Pose.from_angle(0.7, (3.0, 5.0))
    return pose, source, pose.apply(source), unit_frequencies(np.array([3]), 40, 2)[0] / 2.0


def test_the_condition_is_that_of_motions_of_the_points(rng):
    """Shifts, and turns about the moved centroid by 1 u at the RMS radius: the second differences of the objective
    along them give the same condition."""
    pose, source, target, w = scene(rng)
    centre = target.mean(axis=0)
    radius = np.sqrt(np.mean(np.sum((source - source.mean(axis=0)) ** 2, axis=1)))
    h = 1e-3

    def objective(u):
        about = Pose.from_angle(u[2] / radius)
        motion = Pose.from_angle(u[2] / radius, centre - about.R @ centre + u[:2])
        return derivatives(motion.compose(pose), source, target, w).value

    H = np.empty((3, 3))
    for a, b in product(range(3), repeat=2):
        p, q = h * np.eye(3)[a], h * np.eye(3)[b]
        H[a, b] = (objective(p + q) - objective(p - q) - objective(q - p) + objective(-p - q)) / (4.0 * h * h)
    values = np.linalg.eigvalsh(H)
    assert implicit_derivative(pose, source, target, w).condition == pytest.approx(values[-1] / values[0], rel=1e-4)


@pytest.mark.parametrize("scale", [0.01, 1.0, 1000.0])
def test_the_condition_depends_on_neither_origin_nor_unit(rng, scale):
    pose, source, target, w = scene(rng)
    condition = implicit_derivative(pose, source, target, w).condition
    from_source, from_target = np.array([[7.0, 40.0], [-90.0, 2.0]])
    moved = Pose(pose.R, scale * (pose.t + from_target - pose.R @ from_source))
    answer = implicit_derivative(moved, scale * (source + from_source), scale * (target + from_target), w / scale)
    assert answer.condition == pytest.approx(condition, rel=1e-6)
