"""The normal equations, damped as between two steps, and who solves them."""

from __future__ import annotations

import numpy as np
import pytest

from solvers.posegraph import linear
from solvers.posegraph.errors import derivatives
from tests.solvers.posegraph.graphs import noisy_streets


@pytest.mark.parametrize("sparse", [False, pytest.param(True, marks=pytest.mark.native)])
@pytest.mark.parametrize("columns", [1, 4])
def test_a_damped_system_is_solved_as_by_the_dense_matrix(sparse: bool, columns: int):
    """Not at a minimum, where hardly any damping is left."""
    if sparse:
        pytest.importorskip("scipy")
    n, rng = 25, np.random.default_rng(7)
    _, poses, edges, _ = noisy_streets(n=n)
    by_i, by_j = derivatives(poses, edges)
    dense = np.zeros((n, 3, n, 3))
    for i, j, A, B, information in zip(edges.i, edges.j, by_i, by_j, edges.information, strict=True):
        J = np.zeros((3, n, 3))
        J[:, i], J[:, j] = A, B
        dense += np.einsum("anb,ac,cmd->nbmd", J, information, J)
    whole = dense.reshape(3 * n, 3 * n)
    # As strong as the diagonal, and each entry its own.
    damping = np.diagonal(whole).reshape(n, 3) * rng.uniform(0.5, 2.0, (n, 3))
    b = rng.normal(size=(n, 3, columns))
    free = np.delete(np.arange(n), [0, 7])
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    expected = np.zeros((3 * n, columns))
    damped = whole + np.diag(damping.ravel())
    expected[rows] = np.linalg.solve(damped[np.ix_(rows, rows)], b.reshape(3 * n, columns)[rows])
    plan = linear.plan(n, edges.i, edges.j, np.isin(np.arange(n), [0, 7]), sparse)
    parts = linear.blocks(by_i, by_j, edges.information, np.zeros((len(edges), 3)))
    x = linear.factor(plan, edges.i, edges.j, *parts[:3], damping)(b)
    np.testing.assert_allclose(x.reshape(3 * n, columns), expected, rtol=1e-9, atol=1e-15)


@pytest.mark.native
def test_scipy_solves_from_300_free_nodes_on():
    pytest.importorskip("scipy")
    for free, expected in ((299, False), (300, True)):
        nodes = np.arange(free)
        assert linear.plan(free + 1, nodes, nodes + 1, np.arange(free + 1) == 0).sparse is expected
