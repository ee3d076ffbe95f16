"""Residuals and their derivatives, and the kernels' weights and losses."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose
from solvers.posegraph import KERNELS, Edges, chi_squared, jacobians, residuals
from solvers.posegraph.errors import moved
from solvers.posegraph.kernels import loss, weights

angles = st.floats(-3.0, 3.0)
lengths = st.floats(-10.0, 10.0)
motions = st.lists(st.tuples(lengths, lengths, angles), min_size=3, max_size=3).map(np.array)


def poses_of(values: np.ndarray) -> Pose:
    return Pose.from_angle(values[:, 2], values[:, :2])


@settings(deadline=None)
@given(motions)
def test_the_residual_is_the_motion_left_over(values):
    """E = Z⁻¹ Tᵢ⁻¹ Tⱼ, computed by composing poses."""
    poses = poses_of(values)
    edges = Edges([0], [1], poses[2:], np.eye(3))
    error = edges.relative.inverse().compose(poses[:1].inverse().compose(poses[1:2]))
    result = residuals(poses, edges)
    np.testing.assert_allclose(result[:, :2], error.t, atol=1e-12)
    np.testing.assert_allclose(np.exp(1j * result[:, 2]), np.exp(1j * error.angle), atol=1e-12)
    assert (np.abs(result[:, 2]) <= np.pi).all()


@settings(deadline=None)
@given(motions)
def test_the_derivatives_are_those_of_differences(values):
    poses = poses_of(values)
    edges = Edges([0], [1], poses[2:], np.eye(3))
    h = 1e-6
    for node, J in enumerate(jacobians(poses, edges)):
        for axis in range(3):
            step = np.zeros((3, 3))
            step[node, axis] = h
            difference = residuals(moved(poses, step), edges) - residuals(moved(poses, -step), edges)
            difference[:, 2] = (difference[:, 2] + np.pi) % (2 * np.pi) - np.pi  # across the seam of the angle
            np.testing.assert_allclose(difference[0] / (2 * h), J[0, :, axis], atol=2e-7 * (1.0 + np.abs(J).max()))


@settings(deadline=None)
@given(motions, st.tuples(lengths, lengths, angles))
def test_moving_all_changes_no_residual(values, whole):
    poses = poses_of(values)
    edges = Edges([0, 1], [1, 2], poses[1:], np.eye(3))
    copies = poses_of(np.array([whole])).compose(poses)
    before, after = residuals(poses, edges), residuals(copies, edges)
    np.testing.assert_allclose(after[:, :2], before[:, :2], atol=1e-11)
    np.testing.assert_allclose(np.exp(1j * after[:, 2]), np.exp(1j * before[:, 2]), atol=1e-11)


def test_two_radians_by_information_and_length():
    poses = Pose.from_angle([0.0, 2.0], [[0.0, 0.0], [3.0, 4.0]])
    edges = Edges([0], [1], Pose.identity(batch=(1,)), np.diag([1.0, 1.0, 10.0]))
    np.testing.assert_allclose(chi_squared(poses, edges), [9.0 + 16.0 + 40.0])


@pytest.mark.parametrize("call", [residuals, jacobians, chi_squared])
def test_what_is_no_graph_has_no_errors(call):
    poses = Pose.identity(batch=(3,))
    edges = Edges.between(poses, [0, 1], [1, 2], np.eye(3))
    for words, nodes, links in (
        ("edges.j: entry 1 names node 2, but the nodes go from 0 to 1", poses[:2], edges),
        ("poses: expected shape (n,), got ()", Pose.identity(), edges),
        ("poses: moves points in 3 dimensions", Pose.identity(3, (3,)), edges),
        ("poses.scale: expected rigid motions, of scale 1", Pose(poses.R, poses.t, 2.0), edges),
        ("poses: expected a Pose, got ndarray", poses.matrix, edges),
        ("edges: expected Edges, got NoneType", poses, None),
    ):
        with pytest.raises(ValueError, match=f"^{re.escape(words)}"):
            call(nodes, links)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_weight_is_the_slope_of_its_loss(kernel):
    x, h = np.geomspace(1e-3, 1e4, 60), 1e-6
    x = x[np.abs(x - 4.0) > 1e-2]
    slope = (loss(kernel, x * (1 + h), 2.0) - loss(kernel, x * (1 - h), 2.0)) / (2 * h * x)
    np.testing.assert_allclose(weights(kernel, x, 2.0), slope, atol=1e-6)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_loss_is_the_sum_of_its_weights(kernel):
    """Integrated from no error on: it starts at zero and has no step, at the threshold of 2 σ neither."""
    x = np.linspace(0.0, 25.0, 100_001)
    w = weights(kernel, x, 2.0)
    total = np.append(0.0, np.cumsum(0.5 * (w[1:] + w[:-1]) * np.diff(x)))
    np.testing.assert_allclose(loss(kernel, x, 2.0), total, atol=1e-6)


@pytest.mark.parametrize("kernel", KERNELS[1:])
def test_small_errors_count_in_full_and_infinite_ones_for_nothing(kernel):
    assert weights(kernel, np.array([0.0]), 2.0) == 1.0
    assert loss(kernel, np.array([1e-12]), 2.0) == pytest.approx(1e-12)
    assert weights(kernel, np.array([np.inf]), 2.0) == 0.0
    falling = weights(kernel, np.linspace(0.0, 1e3, 500), 2.0)
    assert (np.diff(falling) <= 0.0).all()


def test_dynamic_covariance_scaling_in_the_numbers_of_its_paper():
    """The weight is s², where s = min(1, 2Φ/(Φ + χ²)); no edge costs more than 3Φ."""
    np.testing.assert_allclose(weights("dcs", np.array([0.5, 1.0, 3.0, 9.0]), 1.0), [1.0, 1.0, 0.25, 0.04])
    assert loss("dcs", np.array([1e12]), 2.0) == pytest.approx(12.0)
