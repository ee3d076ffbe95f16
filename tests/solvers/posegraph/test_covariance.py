"""Marginal covariances against the dense inverse, closed forms and simulation; sparse against elimination."""

from __future__ import annotations

import builtins
import re
import sys

import numpy as np
import pytest

from solvers import Pose, Status
from solvers.posegraph import Edges, jacobians, linear, marginals, optimise
from tests.solvers.posegraph.graphs import INFORMATION, chained, noisy_streets


def dense_information(poses: Pose, edges: Edges) -> np.ndarray:
    """JᵀΩJ over all nodes, from its definition."""
    n = poses.batch[0]
    whole = np.zeros((3 * n, 3 * n))
    for i, j, A, B, omega in zip(edges.i, edges.j, *jacobians(poses, edges), edges.information, strict=True):
        J = np.zeros((3, 3 * n))
        J[:, 3 * i : 3 * i + 3], J[:, 3 * j : 3 * j + 3] = A, B
        whole += J.T @ omega @ J
    return whole


def test_they_are_blocks_of_the_dense_inverse():
    _, start, edges, _ = noisy_streets(n=25)
    poses = optimise(start, edges).poses
    free = np.delete(np.arange(75), np.r_[0:3, 21:24])
    inverse = np.zeros((75, 75))
    inverse[np.ix_(free, free)] = np.linalg.inv(dense_information(poses, edges)[np.ix_(free, free)])
    result = marginals(poses, edges, np.arange(25), fixed=[0, 7])
    expected = [inverse[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] for k in range(25)]
    np.testing.assert_allclose(result, expected, rtol=1e-8, atol=1e-14)
    assert (result[7] == 0.0).all()


@pytest.mark.parametrize("sparse", [False, pytest.param(True, marks=pytest.mark.native)])
def test_where_every_node_is_fixed_all_covariances_are_zero(sparse: bool):
    if sparse:
        pytest.importorskip("scipy")
    poses, _, edges, _ = noisy_streets(n=10)
    assert (marginals(poses, edges, [0, 3, 3], fixed=range(10), sparse=sparse) == 0.0).all()


def test_a_chain_spreads_as_it_is_simulated():
    """The ends of 4,000 noisy chains of five steps with a turn, with angles small enough for the first-order theory."""
    positions = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 1.0], [3.0, 2.0], [3.0, 3.0]]
    truth = Pose.from_angle([0.0, 0.0, 0.5, 1.0, 1.5, 1.5], positions)
    spread = np.array([0.05, 0.02, 0.01])
    nodes = np.arange(5)
    edges = Edges.between(truth, nodes, nodes + 1, np.diag(spread**-2.0))
    expected = marginals(truth, edges, [5])[0]
    noise = np.random.default_rng(3).normal(size=(5, 4000, 3)) * spread
    end = truth[0]
    for k in range(5):
        end = end.compose(edges.relative[k]).compose(Pose.from_angle(noise[k, :, 2], noise[k, :, :2]).inverse())
    sample = np.cov(np.column_stack([end.t, end.angle]).T)
    size = np.sqrt(np.diagonal(expected))
    np.testing.assert_allclose(sample / np.outer(size, size), expected / np.outer(size, size), atol=0.08)


def test_a_loop_halves_what_is_not_known_of_its_middle():
    """Turns on the spot: two chains of n turns, one to each side, reach the middle in parallel."""
    turns = Pose.from_angle(np.full(8, np.pi / 4), np.zeros((8, 2)))
    nodes = np.arange(8)
    loop = Edges(nodes, (nodes + 1) % 8, turns, INFORMATION)
    poses = chained(turns[:7], Pose.identity())
    chain, closed = (marginals(poses, edges, [4])[0, 2, 2] for edges in (loop[:7], loop))
    assert closed == pytest.approx(0.5 * chain)


def test_information_that_numbers_cannot_tell_apart_is_refused():
    """10⁻³⁰ is lost beside 10¹⁰⁰, so the sum is singular; optimising damps it and ends with finite poses."""
    poses = Pose.from_angle(np.zeros(3), [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]])
    edges = Edges.between(poses, [0, 1], [1, 2], np.array([1e-30 * np.eye(3), 1e100 * np.eye(3)]))
    with pytest.raises(ValueError, match="information differs beyond double precision"):
        marginals(poses, edges, [2])
    start = Pose(poses.R, poses.t + np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.0]]))
    result = optimise(start, edges)
    assert np.isfinite(result.poses.t).all()
    assert result.total < result.history.objective[0]


def test_a_weight_scales_the_information():
    _, start, edges, _ = noisy_streets(n=20)
    half = Edges(edges.i, edges.j, edges.relative, 0.25 * edges.information)
    np.testing.assert_allclose(
        marginals(start, edges, [3, 19], weights=np.full(len(edges), 0.25)), marginals(start, half, [3, 19]), rtol=1e-9
    )


def test_what_cannot_be_asked_is_refused():
    _, start, edges, _ = noisy_streets(n=20)
    for words, call in (
        ("nodes: expected integers of shape (k,)", lambda: marginals(start, edges, 3)),
        ("nodes: expected integers of shape (k,)", lambda: marginals(start, edges, [1.0])),
        ("nodes: rows of unequal length", lambda: marginals(start, edges, [[1], [2, 3]])),
        ("nodes: is empty", lambda: marginals(start, edges, [])),
        ("nodes: entry 1 names node 20", lambda: marginals(start, edges, [0, 20])),
        ("weights: expected one positive weight", lambda: marginals(start, edges, [1], weights=[0] * len(edges))),
    ):
        with pytest.raises(ValueError, match=re.escape(words)):
            call()


@pytest.mark.native
def test_scipy_gives_what_elimination_gives():
    """They agree on poses, χ², steps and covariances, with and without a kernel."""
    pytest.importorskip("scipy")
    _, start, edges, loops = noisy_streets()
    for kernel in ("none", "cauchy"):
        first, second = (optimise(start, edges, kernel=kernel, robust=loops, sparse=sparse) for sparse in (False, True))
        np.testing.assert_allclose(first.poses.matrix, second.poses.matrix, atol=1e-8)
        np.testing.assert_allclose(first.chi2, second.chi2, atol=1e-6)
        assert first.steps == second.steps
    nodes = [1, 30, 59]
    np.testing.assert_allclose(
        marginals(start, edges, nodes, sparse=False), marginals(start, edges, nodes, sparse=True), rtol=1e-7
    )


@pytest.mark.native
@pytest.mark.parametrize("seed", range(4))
def test_least_squares_of_scipy_ends_at_the_same_poses(seed):
    """A general optimiser on residuals rewritten with complex numbers, with information of any shape. It replaces
    public graphs with published optima, none of which is at hand that may be kept here; closed forms are tested in
    `test_graph`."""
    optimize = pytest.importorskip("scipy.optimize")
    _, start, edges, _ = noisy_streets(seed, n=15)
    shape = np.random.default_rng(seed).normal(size=(len(edges), 3, 3)) + 4.0 * np.eye(3)
    edges = Edges(edges.i, edges.j, edges.relative, shape @ edges.information @ shape.swapaxes(1, 2))
    root = np.linalg.cholesky(edges.information).swapaxes(1, 2)
    z = edges.relative.t @ [1, 1j]

    def errors(x: np.ndarray) -> np.ndarray:
        t, turn = np.r_[start.t[0] @ [1, 1j], x[:28:2] + 1j * x[1:28:2]], np.exp(1j * np.r_[start.angle[0], x[28:]])
        rotation = np.exp(1j * edges.relative.angle)
        shift = ((t[edges.j] - t[edges.i]) / turn[edges.i] - z) / rotation
        angle = np.angle(turn[edges.j] / turn[edges.i] / rotation)
        return np.einsum("eab,eb->ea", root, np.stack([shift.real, shift.imag, angle], axis=1)).ravel()

    parameters = np.r_[start.t[1:].ravel(), start.angle[1:]]
    outcome = optimize.least_squares(errors, parameters, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    result = optimise(start, edges)
    assert result.total == pytest.approx(2.0 * outcome.cost, rel=1e-9)
    np.testing.assert_allclose(result.poses.t[1:].ravel(), outcome.x[:28], atol=1e-6)


@pytest.mark.native
def test_a_large_graph_without_scipy_is_eliminated_and_too_large_a_one_is_refused(monkeypatch):
    real = builtins.__import__

    def without(name, *rest):
        if name.startswith("scipy"):
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    n = linear.SPARSE + 2
    nodes = np.arange(n - 1)
    truth = Pose.from_angle(np.zeros(n), np.column_stack([np.arange(n), np.zeros(n)]))
    edges = Edges.between(truth, nodes, nodes + 1, INFORMATION)
    start = Pose(truth.R, truth.t + [[0.0, 0.0]] + np.arange(n)[:, None] * [0.01, 0.02])
    assert optimise(start, edges).total < 1e-9
    with pytest.raises(ValueError, match="more than 3000, which take scipy; install it"):
        linear.plan(3002, np.arange(3001), np.arange(3001) + 1, np.arange(3002) == 0)


@pytest.mark.native
def test_who_has_scipy_is_told_to_let_it_solve_too_large_a_graph():
    pytest.importorskip("scipy")
    n = 3002
    poses = Pose.from_angle(np.zeros(n), np.column_stack([np.arange(n), np.zeros(n)]))
    edges = Edges.between(poses, np.arange(n - 1), np.arange(1, n), INFORMATION)
    with pytest.raises(ValueError, match=r"^poses: 3001 free nodes are more than 3000, .*; pass sparse=None"):
        optimise(poses, edges, sparse=False)
    assert optimise(poses, edges).status is Status.CONVERGED


def test_nodes_asked_for_together_have_the_covariances_of_each_alone():
    """More nodes than are solved for at once, in a loop of 150."""
    n = 150
    turn = np.full(n, 2.0 * np.pi / n)
    poses = Pose.from_angle(np.arange(n) * turn, np.zeros((n, 2)))
    steps = Pose.from_angle(turn, (1.0, 0.0))
    ring = Edges(np.arange(n), np.roll(np.arange(n), -1), steps, np.diag([100.0, 100.0, 400.0]))
    batch = marginals(poses, ring, np.arange(n))
    for k in (0, 1, 63, 64, 65, 128, 149):
        np.testing.assert_allclose(batch[k], marginals(poses, ring, [k])[0], rtol=1e-9, atol=1e-15)


def test_whether_scipy_solves_is_yes_or_no(monkeypatch):
    """True also requires scipy."""
    poses = Pose.from_angle(np.zeros(2), [[0.0, 0.0], [1.0, 0.0]])
    edges = Edges.between(poses, [0], [1], np.eye(3))
    for call in (optimise, lambda *graph, sparse: marginals(*graph, [1], sparse=sparse)):
        for wrong in ("no", 1):
            with pytest.raises(ValueError, match=r"^sparse: expected True or False"):
                call(poses, edges, sparse=wrong)
    for name in ("scipy", "scipy.sparse", "scipy.sparse.linalg"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ValueError, match=r"^sparse: True takes scipy; install it, or pass sparse=None"):
        optimise(poses, edges, sparse=True)
    assert optimise(poses, edges, sparse=False).status == Status.CONVERGED
