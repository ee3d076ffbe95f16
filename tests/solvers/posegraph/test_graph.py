"""Optimising a graph: closed forms of a loop, the choice of the fixed node, wrong loops, and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose, Status
from solvers.posegraph import KERNELS, THRESHOLD, Edges, advance, begin, chi_squared, optimise
from tests.solvers.posegraph.graphs import INFORMATION, chained, noisy_streets, streets, with_noise, with_wrong_loop


def distance(poses: Pose, truth: Pose) -> float:
    """The RMS distance of the nodes from their true places."""
    return float(np.sqrt(np.square(poses.t - truth.t).sum(axis=1).mean()))


def relative(poses: Pose) -> np.ndarray:
    """Each node's pose relative to the one before."""
    return poses[:-1].inverse().compose(poses[1:]).matrix


def test_exact_measurements_give_the_true_poses_back():
    truth, edges, _ = streets()
    rng = np.random.default_rng(1)
    start = Pose.from_angle(truth.angle + rng.normal(scale=0.2, size=60), truth.t + rng.normal(scale=0.3, size=(60, 2)))
    assert optimise(start, edges, fixed=[0, 5]).total > 1.0  # two nodes fixed at wrong start poses
    result = optimise(Pose(np.r_[truth.R[:1], start.R[1:]], np.r_[truth.t[:1], start.t[1:]]), edges)
    assert result.status is Status.CONVERGED
    assert result.total < 1e-18
    np.testing.assert_allclose(result.poses.matrix, truth.matrix, atol=1e-10)


@settings(deadline=None)
@given(
    st.integers(2, 7),
    st.floats(-0.5, 0.5),
    st.lists(st.floats(0.1, 100.0), min_size=7, max_size=7),
)
def test_a_straight_loop_shares_its_excess_by_the_inverse_of_the_information(legs, excess, information):
    """Out along a line and back: every leg takes `excess · (1/Ωₖ) / Σ (1/Ω)`; equal information, equal parts."""
    lengths = np.array([1.0] * legs + [-1.0] * legs)
    lengths[-1] += excess
    e = 2 * legs
    weight = np.resize(information, e)
    nodes = np.arange(e)
    readings = Pose.from_angle(np.zeros(e), np.column_stack([lengths, np.zeros(e)]))
    edges = Edges(nodes, (nodes + 1) % e, readings, weight[:, None, None] * np.eye(3))
    start = chained(readings[: e - 1], Pose.identity())
    result = optimise(start, edges)
    # The legs must sum to zero, so each is changed by its share of −excess.
    share = -excess / weight / (1.0 / weight).sum()
    took = np.roll(result.poses.t[:, 0], -1) - result.poses.t[:, 0] - lengths
    np.testing.assert_allclose(took, share, atol=1e-7)
    np.testing.assert_allclose(result.total, excess**2 / (1.0 / weight).sum(), atol=1e-7)


@settings(deadline=None)
@given(st.integers(3, 30), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
def test_a_regular_ring_closes_at_its_closed_form_optimum(n, turn, length):
    """n equal edges, each measured as a step ahead and a turn, form by symmetry a regular polygon at the optimum: each
    takes an n-th of the excess turn, and the steps, now sides of a polygon that closes by itself, keep their length. So
    the optimum is known: χ² is n · ω (turn / n)², whatever the length."""
    nodes = np.arange(n)
    step = 1.0 + length
    edges = Edges(
        nodes, (nodes + 1) % n, Pose.from_angle(np.full(n, (2 * np.pi + turn) / n), np.tile([step, 0.0], (n, 1))),
        INFORMATION,
    )  # fmt: skip
    ring = Pose.from_angle(np.full(n - 1, 2 * np.pi / n), np.tile([step, 0.0], (n - 1, 1)))
    result = optimise(chained(edges.relative[: n - 1], Pose.identity()), edges)
    assert result.total <= n * INFORMATION[2, 2] * (turn / n) ** 2 * (1 + 1e-9) + 1e-12
    np.testing.assert_allclose(result.poses.matrix, chained(ring, Pose.identity()).matrix, atol=1e-6)


def test_a_ring_wound_twice_rests_at_another_minimum():
    """All turns are twice too large and all edges err alike: the run converges there, and its large χ² shows it."""
    single, double = (
        chained(Pose.from_angle(np.full(11, turn), [[1.0, 0.0]] * 11), Pose.identity())
        for turn in (np.pi / 6, np.pi / 3)
    )
    i = np.arange(12)
    edges = Edges.between(single, i, (i + 1) % 12, INFORMATION)
    assert optimise(single, edges).total < 1e-9
    wound = optimise(double, edges)
    assert wound.status == Status.CONVERGED
    assert wound.total > 100.0 * (3 * 12 - 3 * 11)


def test_progress_is_told_after_every_step():
    _, start, edges, _ = noisy_streets()
    calls: list[tuple[int, int]] = []
    result = optimise(start, edges, max_steps=50, progress=lambda *counts: calls.append(counts))
    # It converges without another step.
    assert calls == [(min(k, result.steps), 50) for k in range(1, result.steps + 2)]
    calls.clear()
    optimise(result.poses, edges, max_steps=50, progress=lambda *counts: calls.append(counts))
    assert calls == [(0, 50)]
    calls.clear()
    optimise(start, edges, max_steps=1, progress=lambda *counts: calls.append(counts))
    assert calls == [(1, 1)]  # capped


@settings(deadline=None)
@given(st.integers(3, 9), st.floats(-1.0, 1.0))
def test_turns_on_the_spot_share_their_excess_evenly(n, excess):
    """A full circle in n turns, measured `excess` too large in total: each takes an n-th of it."""
    nodes = np.arange(n)
    turns = Pose.from_angle(np.full(n, (2 * np.pi + excess) / n), np.zeros((n, 2)))
    edges = Edges(nodes, (nodes + 1) % n, turns, INFORMATION)
    result = optimise(chained(turns[: n - 1], Pose.identity()), edges)
    np.testing.assert_allclose(result.total, n * INFORMATION[2, 2] * (excess / n) ** 2, atol=1e-6)
    took = Pose(relative(result.poses)[:, :2, :2], np.zeros(2)).angle
    np.testing.assert_allclose(np.exp(1j * took), np.exp(2j * np.pi / n), atol=1e-9)


def test_the_end_is_a_minimum():
    """At the end the objective has no slope, by finite differences, under every kernel."""
    _, start, edges, loops = noisy_streets()
    for kernel in KERNELS:
        result = optimise(start, edges, kernel=kernel, robust=loops, threshold=1.5)
        assert result.status is Status.CONVERGED

        def objective(poses: Pose, kernel: str = kernel) -> float:
            return begin(poses, edges, kernel=kernel, robust=loops, threshold=1.5).objective

        h = 1e-5
        for node in (7, 30):
            for axis in range(3):
                ends = []
                for sign in (1.0, -1.0):
                    t, angle = result.poses.t.copy(), result.poses.angle.copy()
                    if axis < 2:
                        t[node, axis] += sign * h
                    else:
                        angle[node] += sign * h
                    ends.append(objective(Pose.from_angle(angle, t)))
                slope, bend = (ends[0] - ends[1]) / (2 * h), (ends[0] + ends[1] - 2 * result.objective) / h**2
                assert abs(slope) < 1e-5 * abs(bend)
        assert (np.diff(result.history.objective) < 0.0).all()


def test_the_fixed_node_is_a_choice_of_coordinates():
    """Fixing another node gives the same relative poses and the same χ²."""
    _, start, edges, _ = noisy_streets()
    first, second = (optimise(start, edges, fixed=node) for node in (0, 23))
    np.testing.assert_allclose(relative(first.poses), relative(second.poses), atol=1e-8)
    np.testing.assert_allclose(first.chi2, second.chi2, atol=1e-6)
    assert np.array_equal(second.poses.t[23], start.t[23])


@given(st.floats(-3.0, 3.0), st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)))
@settings(deadline=None, max_examples=10)
def test_a_moved_start_gives_the_moved_result(angle, shift):
    _, start, edges, _ = noisy_streets(n=20)
    whole = Pose.from_angle(angle, shift)
    moved_result, result = optimise(whole.compose(start), edges), optimise(start, edges)
    np.testing.assert_allclose(moved_result.poses.matrix, whole.compose(result.poses).matrix, atol=1e-7)
    assert moved_result.steps == result.steps


def test_metres_or_millimetres():
    """Another unit of length, with matching information, changes nothing but the unit."""
    _, start, edges, loops = noisy_streets()
    scale = np.diag([1e-3, 1e-3, 1.0])
    in_mm = Edges(
        edges.i, edges.j, Pose(edges.relative.R, 1e3 * edges.relative.t), scale @ edges.information @ scale
    )
    result = optimise(start, edges, kernel="dcs", robust=loops)
    scaled_result = optimise(Pose(start.R, 1e3 * start.t), in_mm, kernel="dcs", robust=loops)
    np.testing.assert_allclose(scaled_result.poses.t, 1e3 * result.poses.t, atol=1e-4)
    np.testing.assert_allclose(scaled_result.chi2, result.chi2, rtol=1e-5, atol=1e-8)


def test_the_expected_sum_of_squares_is_the_number_of_redundant_measurements():
    """Three per edge minus three per free node, as in least squares; 25 draws, to three standard deviations."""
    totals = [optimise(start, edges).total for _, start, edges, _ in map(noisy_streets, range(25))]
    _, _, edges, _ = noisy_streets()
    free = 3 * len(edges) - 3 * 59
    assert abs(np.mean(totals) - free) < 3.0 * np.sqrt(2.0 * free / 25)


@pytest.mark.parametrize(("i", "j"), [(3, 40), (0, 59), (10, 50)])
def test_a_wrong_loop_bends_the_map_and_a_kernel_lets_go_of_it(i, j):
    """One edge places a crossing on another, 3 to 4 u away, among 31 right loops."""
    truth, start, edges, loops = noisy_streets()
    right = distance(optimise(start, edges).poses, truth)
    wrong, among = with_wrong_loop(edges, loops, i, j, Pose.identity())
    assert np.linalg.norm(truth.t[i] - truth.t[j]) > 2.9
    assert distance(optimise(start, wrong).poses, truth) > 6.0 * right
    for kernel, weight in (("cauchy", 2e-3), ("dcs", 1e-4)):
        result = optimise(start, wrong, kernel=kernel, robust=among)
        assert distance(result.poses, truth) < 1.1 * right, kernel
        assert result.weights[-1] < weight, kernel
        assert result.weights[:-1].min() > 0.6, kernel


def test_a_kernel_leaves_the_edges_alone_that_it_is_not_told_of():
    _, start, edges, loops = noisy_streets()
    wrong, among = with_wrong_loop(edges, loops, 3, 40, Pose.identity())
    among[-1] = False
    assert optimise(start, wrong, kernel="dcs", robust=among).weights[-1] == 1.0
    plain = optimise(start, wrong, kernel="dcs", robust=np.zeros(len(wrong), dtype=bool))
    np.testing.assert_allclose(plain.poses.t, optimise(start, wrong).poses.t, atol=1e-7)


def test_step_by_step_is_the_same_run():
    _, start, edges, _ = noisy_streets()
    result, run = optimise(start, edges), begin(start, edges)
    for k, objective in enumerate(result.history.objective):
        assert (run.steps, run.objective) == (k, objective)
        assert np.array_equal(run.poses.t, result.history.poses.t[k])
        before, run = run, advance(run)
        assert before.steps == k
    assert run.done
    assert advance(run) is run


def test_what_is_optimal_takes_no_step_and_what_may_take_none_says_so():
    truth, start, edges, _ = noisy_streets(n=20)
    result = optimise(truth, Edges.between(truth, edges.i, edges.j, INFORMATION))
    assert (result.status, result.steps) == (Status.CONVERGED, 0)
    capped = optimise(start, edges, max_steps=1)
    assert (capped.status, capped.steps, capped.reason) == (Status.CAPPED, 1, "the cap of 1 steps was reached")
    assert optimise(start, edges, max_steps=0).status is Status.CAPPED
    assert optimise(start, edges, fixed=range(20)).reason == "every node is fixed"
    lonely = optimise(Pose.identity(batch=(1,)), edges[:0])
    assert (lonely.status, lonely.total) == (Status.CONVERGED, 0.0)


def test_numbers_without_bounds_end_without_nan():
    """If the start's errors cannot be squared, the run is degenerate; far starts and steep information end finitely."""
    edges = Edges([0, 1, 2], [1, 2, 0], Pose.from_angle([1.0, 2.0, 3.0], np.full((3, 2), 1.0)), 1e80 * np.eye(3))
    for size, expected in ((1e140, {Status.DEGENERATE}), (1e6, set(Status) - {Status.RUNNING, Status.DEGENERATE})):
        result = optimise(Pose.from_angle([0.0, 3.0, -2.0], [[0.0, 0.0], [size, 0.0], [0.0, -size]]), edges)
        assert result.status in expected
        assert np.isfinite(result.poses.t).all()
        assert not np.isnan(result.chi2).any()


@settings(deadline=None, max_examples=40)
@given(st.data())
def test_any_graph_ends_in_numbers_and_never_above_its_start(data):
    n = data.draw(st.integers(2, 6))
    reals = st.floats(-1e4, 1e4)
    extra = data.draw(st.lists(st.tuples(st.integers(0, n - 1), st.integers(1, n - 1)), max_size=5))
    pairs = [(k, k + 1) for k in range(n - 1)] + [(a, (a + b) % n) for a, b in extra]
    poses = data.draw(st.lists(st.tuples(reals, reals, reals), min_size=n, max_size=n).map(np.array))
    e = len(pairs)
    readings = data.draw(st.lists(st.tuples(reals, reals, reals), min_size=e, max_size=e).map(np.array))
    powers = data.draw(st.lists(st.tuples(*[st.integers(-4, 6)] * 3), min_size=e, max_size=e))
    information = np.array([np.diag(10.0 ** np.array(row)) for row in powers])
    edges = Edges(
        [a for a, _ in pairs], [b for _, b in pairs], Pose.from_angle(readings[:, 2], readings[:, :2]), information
    )
    start = Pose.from_angle(poses[:, 2], poses[:, :2])
    kernel = data.draw(st.sampled_from(KERNELS))
    result = optimise(start, edges, kernel=kernel, max_steps=20)
    assert np.isfinite(result.poses.t).all()
    assert np.isfinite(result.chi2).all()
    assert ((result.weights >= 0.0) & (result.weights <= 1.0)).all()
    assert result.objective <= result.history.objective[0]
    assert np.array_equal(result.poses.t[0], start.t[0])


def test_a_graph_of_which_a_step_cannot_be_computed_is_degenerate() -> None:
    """Its information vanishes in floating point: finding no better step does not mean convergence."""
    poses = Pose.from_angle(np.zeros(2), np.zeros((2, 2)))
    edges = Edges([0], [1], Pose.from_angle([1.0], [[1.0, 0.0]]), 1e-320 * np.eye(3))
    result = optimise(poses, edges)
    assert (result.status, result.reason) == (Status.DEGENERATE, "a step is beyond floating point")
    assert not result.status


def raises(words: str, call, **changes) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        call(**changes)


def test_what_is_no_graph_is_refused():
    poses = Pose.from_angle(np.zeros(3), np.zeros((3, 2)))
    edges = Edges.between(poses, [0, 1], [1, 2], np.eye(3))

    def run(**changes) -> None:
        optimise(**{"poses": poses, "edges": edges} | changes)

    raises("edges: 1 node is joined to no fixed node, the first of them 2", run, edges=edges[:1])
    raises("edges: 2 nodes are joined to no fixed node, the first of them 0", run, edges=edges[1:][:0], fixed=1)
    raises("edges.j: entry 1 names node 2, but the nodes go from 0 to 1", run, poses=poses[:2])
    raises("poses: expected shape (n,)", run, poses=Pose.identity())
    raises("poses: is empty", run, poses=Pose.identity(batch=(0,)), edges=edges[:0])
    raises("poses.scale", run, poses=Pose.from_angle(np.zeros(3), np.zeros((3, 2)), 2.0))
    raises("poses: moves points in 3 dimensions, expected motions of the plane", run, poses=Pose.identity(3, (3,)))
    raises("poses: expected a Pose, got NoneType", run, poses=None)
    raises("poses: expected a Pose, got ndarray", run, poses=np.eye(3)[None])
    raises("edges: expected Edges, got list", run, edges=[])
    raises("fixed: entry 0 names node 3", run, fixed=3)
    raises("fixed: entry 0 names node -1", run, fixed=-1)
    raises("fixed: is empty", run, fixed=[])
    raises("fixed: expected a node", run, fixed=0.5)
    raises("fixed: expected a node", run, fixed=[[0, 1]])
    raises("fixed: rows of unequal length", run, fixed=[[0], [1, 2]])
    raises("kernel: 'hubber' is unknown, did you mean 'huber'?", run, kernel="hubber")
    raises("robust: expected one bool an edge", run, robust=[0, 1])
    raises("robust: rows of unequal length", run, robust=[[True], [True, False]])
    raises("threshold", run, threshold=0.0)
    raises("max_steps: must be at least 0", run, max_steps=-1)
    raises("tolerance", run, tolerance=np.nan)
    raises("progress: expected a function, got 3", run, progress=3, max_steps=0)


def test_a_run_is_begun_by_the_options_that_it_has():
    poses = Pose.identity(batch=(2,))
    edges = Edges.between(poses, [0], [1], np.eye(3))
    raises("run: expected a GraphRun, got NoneType", lambda: advance(None))
    for wrong in ("progress", "kernal"):
        with pytest.raises(TypeError, match=rf"^begin\(\) got an unexpected keyword argument '{wrong}'"):
            begin(poses, edges, **{wrong: None})


def test_what_is_no_edge_is_refused():
    good = {"i": [0], "j": [1], "relative": Pose.identity(batch=(1,)), "information": np.eye(3)}

    def run(**changes) -> None:
        Edges(**good | changes)

    raises("j: edge 0 joins node 0 to itself", run, j=[0])
    raises("i: expected non-negative integers of at most 63 bits, but there is -1", run, i=[-1])
    raises("i: expected non-negative integers of at most 63 bits, but there is 9223372036854775808", run, i=[2**63])
    raises("i: expected integers", run, i=[0.5])
    raises("j: expected as many nodes as i has, 1, got 2", run, j=[1, 2])
    raises("relative: expected poses of shape (1,)", run, relative=Pose.identity())
    raises("relative.t: 1 of 2 numbers is not finite", run, relative=Pose.trusted([np.eye(2)], [[np.nan, 0.0]]))
    raises("information: expected shape (1, 3, 3) or (3, 3), got (2, 2)", run, information=np.eye(2))
    raises("edge 0 is not positive definite; if a direction is free, add", run, information=np.diag([1.0, 0.0, 1.0]))
    raises("the matrix of edge 0 is not positive definite", run, information=-np.eye(3))
    raises("edge 0 is not positive definite; if a direction is free, add a", run, information=np.ones((3, 3)))
    raises("the matrix of edge 0 is not symmetric", run, information=np.eye(3) + np.eye(3, k=1))
    raises("is not finite", run, information=np.full((3, 3), np.inf))
    raises("expected real numbers", run, information="one")
    raises("information: expected real numbers, got dtype complex128", run, information=(1.0 + 1.0j) * np.eye(3))
    raises("information: rows of unequal length", run, information=[[1.0], [0.0, 1.0]])
    raises("parts: is empty", lambda: Edges.joined([]))
    raises("parts: expected a sequence of Edges, got 3", lambda: Edges.joined(3))
    raises("parts[0]: expected Edges, got int", lambda: Edges.joined([3]))
    raises("j: entry 0 names node 4", lambda: Edges.between(Pose.identity(batch=(2,)), [0], [4], np.eye(3)))
    two = Pose.identity(batch=(2,))
    raises("information: rows of unequal length", lambda: Edges.between(two, [0], [1], [[1.0], [0.0, 1.0]]))


def test_edges_are_taken_and_joined_and_cannot_be_written_to():
    _, edges, loops = streets(20)
    union = Edges.joined([edges[~loops], edges[loops]])
    assert np.array_equal(union.information, edges.information)
    assert np.array_equal(union.relative.t, edges.relative.t)
    assert len(edges[0]) == 1
    for array in (edges.i, edges.j, edges.information):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_threshold_is_the_ninety_five_percent_point():
    """Checked on 200,000 errors drawn with the information's own covariance."""
    errors = np.random.default_rng(0).normal(size=(200_000, 3))
    assert abs((np.square(errors).sum(axis=1) < THRESHOLD**2).mean() - 0.95) < 0.002


def test_disturbed_edges_have_the_residual_they_are_given():
    truth, edges, _ = streets(20)
    noise = np.full((len(edges), 3), 0.1)
    expected = np.einsum("ea,ab,eb->e", noise, INFORMATION, noise)
    np.testing.assert_allclose(chi_squared(truth, with_noise(edges, noise)), expected)


def test_a_conflict_elsewhere_does_not_end_the_run_before_a_node_is_at_rest():
    """Two edges conflict by 200 u; node 2, on another edge, starts 0.9 u off."""
    relative = Pose.from_angle(np.zeros(3), [[0.0, 0.0], [200.0, 0.0], [1.0, 0.0]])
    edges = Edges([0, 0, 1], [1, 1, 2], relative, np.stack([1e10 * np.eye(3), 1e10 * np.eye(3), np.eye(3)]))
    start = Pose.from_angle(np.zeros(3), [[0.0, 0.0], [100.0, 0.0], [101.9, 0.0]])
    result = optimise(start, edges)
    assert result.status
    np.testing.assert_allclose(result.poses.t[:, 0], [0.0, 100.0, 101.0], atol=1e-5)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_the_stop_does_not_depend_on_the_unit(unit):
    _, start, edges, _ = noisy_streets(3)
    plain = optimise(start, edges, tolerance=1e-2)
    scale = np.diag([1.0 / unit, 1.0 / unit, 1.0])
    twin = Edges(edges.i, edges.j, Pose(edges.relative.R, unit * edges.relative.t), scale @ edges.information @ scale)
    result = optimise(Pose(start.R, unit * start.t), twin, tolerance=1e-2)
    assert result.steps == plain.steps
    np.testing.assert_allclose(result.poses.t / unit, plain.poses.t, atol=1e-6)
