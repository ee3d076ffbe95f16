"""One damped Newton step: how damping makes the matrix definite, and how a cap affects the descent."""

import numpy as np
import pytest

from solvers.numerics import newton

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def test_damping_makes_the_matrix_definite_and_the_step_a_descent(rng):
    """For a positive definite Hessian, λ is 0 and the step is Newton's; otherwise H + λI is positive definite and the
    step still goes down."""
    root = rng.standard_normal((50, 3, 3))
    good = root @ root.swapaxes(1, 2) + 0.1 * np.eye(3)
    g = rng.standard_normal((50, 3))
    step, damping = newton.damped_step(g, good)
    assert not damping.any()
    np.testing.assert_allclose(step, -np.linalg.solve(good, g[..., None])[..., 0], rtol=1e-9, atol=1e-12)
    bad = good - 3.0 * np.eye(3) * np.linalg.eigvalsh(good)[:, 1, None, None]
    step, damping = newton.damped_step(g, bad)
    assert (damping > 0.0).all()
    assert (np.linalg.eigvalsh(bad)[:, 0] < 0.0).all()
    assert (np.linalg.eigvalsh(bad + damping[:, None, None] * np.eye(3))[:, 0] > 0.0).all()
    assert ((g * step).sum(axis=1) < 0.0).all()


def test_capping_the_parts_of_a_step_separately_can_climb():
    """One common factor keeps a descent direction; clipping length and angle separately can turn it into an ascent."""
    g, step = np.array([[1.0, 0.0, 2.0]]), np.array([[3.0, 0.0, -1.7]])
    along = step[0] / np.linalg.norm(step)
    hessian = np.outer(g, g) / -(g * step).sum() + np.eye(3) - np.outer(along, along)
    assert np.linalg.eigvalsh(hessian).min() > 0.0
    np.testing.assert_allclose(np.linalg.solve(hessian, -g[0]), step[0], atol=1e-12)
    assert (g * step).sum() < 0.0
    sizes = (np.array([3.0 / 0.5]), np.array([1.7 / 0.2]))
    shift, turn = (newton.capped(step, (size,)) for size in sizes)
    parts = np.column_stack([shift[:, :2], turn[:, 2:]])
    assert (g * parts).sum() > 0.0
    common = newton.capped(step, sizes)
    assert (g * common).sum() < 0.0
    np.testing.assert_allclose(common, step / 8.5)


def test_a_common_factor_keeps_every_descent(rng):
    """For a thousand gradients and positive definite Hessians, the step capped as a whole still descends."""
    roots, g = rng.standard_normal((1000, 3, 3)), rng.standard_normal((1000, 3))
    hessian = roots @ roots.transpose(0, 2, 1) + 1e-3 * np.eye(3)
    step = np.linalg.solve(hessian, -g[..., None])[..., 0]
    limits = (np.linalg.norm(step[:, :2], axis=1) / 0.5, np.abs(step[:, 2]) / 0.2)
    capped = newton.capped(step, limits)
    assert (np.maximum(*limits) > 1.0).sum() > 500
    assert ((g * capped).sum(axis=1) < 0.0).all()


def test_zero_or_infinite_curvature_makes_no_step():
    step, damping = newton.damped_step(np.ones((2, 3)), np.stack([np.zeros((3, 3)), np.full((3, 3), np.inf)]))
    np.testing.assert_array_equal(step, np.broadcast_to(-np.ones(3), (2, 3)) * 0.0)
    assert not damping.any()
