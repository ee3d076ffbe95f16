"""Association marginals: exact without loops, and an approximation of stated error with them."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import METHODS, Pose, Status, register
from solvers.methods.soft.belief_propagation import BpOptions, bp_marginals, exact_marginals, marginal_matrix
from solvers.methods.soft.radius_pairs import scores, within_reach
from solvers.metrics import rre, rte
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

RACE = {"first": 1.1, "last": 0.12, "tolerance": 5e-4}


def _all_associations(psi, miss):
    """The marginals by enumerating every association, with weights as the module's text defines them."""
    m, n = psi.shape
    marginals, whole = np.zeros((m, n)), 0.0
    for choice in product(range(-1, n), repeat=m):
        columns = [j for j in choice if j >= 0]
        if len(set(columns)) < len(columns):
            continue
        weight = np.prod([miss if j < 0 else psi[i, j] for i, j in enumerate(choice)])
        whole += weight
        for i, j in enumerate(choice):
            if j >= 0:
                marginals[i, j] += weight
    return marginals / whole


@pytest.mark.parametrize(("m", "n"), [(1, 1), (1, 5), (4, 1), (3, 3), (4, 3), (3, 5)])
def test_the_enumeration_is_the_sum_over_all_associations(rng, m, n):
    psi = rng.uniform(0.0, 1.5, (m, n)) * (rng.uniform(size=(m, n)) < 0.8)
    assert np.allclose(exact_marginals(psi, 0.3), _all_associations(psi, 0.3), rtol=1e-12, atol=1e-15)


def _random_tree(rng, m, n):
    """Scores whose positive entries, as edges between rows and columns, form a forest: edges that would close a loop
    are left out."""
    psi, group = np.zeros((m, n)), np.arange(m + n)
    for e in rng.permutation(m * n):
        i, j = divmod(int(e), n)
        a, b = group[i], group[m + j]
        if a != b:
            group[group == a] = b
            psi[i, j] = rng.uniform(0.01, 3.0)
    return psi


def test_messages_are_exact_on_trees(rng):
    """On forty random spanning trees of 6 rows and 7 columns, the marginals equal the enumeration's to 1e-12."""
    for _ in range(40):
        psi = _random_tree(rng, 6, 7)
        assert np.count_nonzero(psi) == 12
        assert np.allclose(bp_marginals(psi, 0.12, 14), exact_marginals(psi, 0.12), rtol=0.0, atol=1e-12)
    chain = np.eye(8) + np.eye(8, k=-1)  # 15 pairs in a row: a message from one end reaches the other after 7 sweeps
    exact = exact_marginals(chain, 0.12)
    assert BpOptions().sweeps == 6
    assert np.abs(bp_marginals(chain, 0.12, 7) - exact).max() < 1e-12
    assert 0.0045 < np.abs(bp_marginals(chain, 0.12, BpOptions().sweeps) - exact).max() < 0.0055


def _largest_error(draws, miss, sweeps):
    """The largest error of the marginals of matrices (k, n, n) of positive scores, joined into one block matrix so that
    no pair connects two of them."""
    k, n, _ = draws.shape
    blocks, own = np.zeros((k, n, k, n)), np.arange(k)
    blocks[own, :, own] = draws
    result = bp_marginals(blocks.reshape(k * n, k * n), miss, sweeps).reshape(blocks.shape)[own, :, own]
    return np.abs(result - [exact_marginals(psi, miss) for psi in draws]).max()


def test_on_loops_they_are_an_approximation_of_stated_error(rng):
    """Gaussian scores at 2 × 2 leave an error of about 0.1; larger matrices, with more but longer loops, less."""
    worst = {}
    for n in (2, 3, 5):
        draws = np.exp(-0.5 * np.square(2.0 * rng.standard_normal((300, n, n))))
        worst[n] = _largest_error(draws, 0.12, 200)
    assert BpOptions().miss == 0.12
    assert worst[2] == pytest.approx(0.1, abs=0.01)
    assert 0.01 < max(worst[3], worst[5]) < worst[2]
    for miss, error in ((0.01, 0.27), (0.001, 0.38)):
        draws = np.exp(-0.5 * np.square(2.0 * rng.standard_normal((300, 2, 2))))
        assert _largest_error(draws, miss, 400) == pytest.approx(error, abs=0.005)
    equal = np.geomspace(0.01, 100.0, 40)[:, None, None] * np.ones((2, 2))
    assert _largest_error(equal, 0.12, 200) > 0.03


def test_messages_come_to_rest_and_marginals_are_probabilities(rng):
    """More sweeps eventually change nothing; no row or column is used more than once, up to rounding."""
    psi = np.exp(-0.5 * rng.uniform(0.0, 9.0, (12, 9)))
    p, q = bp_marginals(psi, 0.12, 300), bp_marginals(psi, 0.12, 301)
    assert np.abs(p - q).max() < 1e-12
    assert (p >= 0.0).all()
    assert (p.sum(axis=1) <= 1.0 + 1e-12).all()
    assert (p.sum(axis=0) <= 1.0 + 1e-9).all()


@settings(max_examples=150, deadline=None, derandomize=True, database=None)
@given(st.integers(0, 10**6), st.sampled_from(["spread", "line", "grid", "outliers"]))
def test_screening_loses_no_pair(seed, kind):
    """Reaches from a fifth to a hundredth of the extent, pairs exactly at the reach, far outliers: none is missed."""
    rng = np.random.default_rng(seed)
    b, m, n = rng.integers(1, 5, 3) * [1, 12, 25]
    moved, target = 3.0 * rng.standard_normal((b, m, 2)), 2.0 * rng.standard_normal((b, n, 2))
    if kind == "line":
        target[..., 1] = 0.5
    if kind == "grid":
        moved, target = np.rint(moved * 2.0) / 2.0, np.rint(target * 2.0) / 2.0
    if kind == "outliers":
        moved[:, 0], target[:, 0] = 1e6, -1e5
    reach = np.ptp(target, axis=1).max(axis=1) / rng.integers(5, 100, b) if kind != "grid" else np.full(b, 0.5)
    result = within_reach(moved, target, reach)
    squares = np.square(moved[:, :, None, 0] - target[:, None, :, 0]) + np.square(
        moved[:, :, None, 1] - target[:, None, :, 1]
    )
    k, i, j = np.nonzero(squares <= np.square(reach)[:, None, None])
    assert np.array_equal(result.row, i + m * k)
    assert np.array_equal(result.column, j + n * k)
    assert np.array_equal(result.squares, squares[k, i, j])


@pytest.mark.parametrize("d", [2, 3])
def test_pairs_within_reach_are_all_listed(rng, d):
    """The screened list equals that from all distances, in order, in batches and far from the origin."""
    for distance in (0.0, 1e7):
        moved, target = rng.standard_normal((3, 20, d)) + distance, rng.standard_normal((3, 30, d)) + distance
        reach = np.array([0.3, 1.0, 1e-9])
        result = within_reach(moved, target, reach)
        squares = np.square(moved[:, :, None] - target[:, None]).sum(axis=-1)
        k, i, j = np.nonzero(squares <= np.square(reach)[:, None, None])
        assert np.array_equal(result.row, i + 20 * k)
        assert np.array_equal(result.column, j + 30 * k)
        assert np.allclose(result.squares, squares[k, i, j], rtol=1e-13)
        values = rng.uniform(size=len(i))
        assert np.allclose(result.row_sums(values), np.bincount(result.row, values, 60), rtol=1e-13)
        assert np.allclose(result.column_sums(values), np.bincount(result.column, values, 90), rtol=1e-13)
        psi = scores(result, 20, np.array([0.5, 1.0, 2.0]))
        assert np.allclose(psi, np.exp(-squares[k, i, j] / 2.0 / np.square(np.array([0.5, 1.0, 2.0])[k])), rtol=1e-12)


def test_what_a_state_shows_belongs_together():
    """Soft targets, support and objective come from the marginals at the state's own pose and width."""
    scene = room("combo", seed=53)
    result = register(scene.source, scene.target, "association-bp", start=room_start(20.0, 0.5), max_steps=7, **RACE)
    state = result.states[0]
    p = marginal_matrix(state)
    assert np.allclose(p.sum(axis=1), state.support[0], atol=1e-12)
    assert np.allclose(p.sum(axis=0), state.taken[0], atol=1e-12)
    rows = p.sum(axis=1) > 0.0
    assert np.allclose((p @ scene.target)[rows] / p.sum(axis=1)[rows, None], state.soft[0, rows], atol=1e-12)
    moved = result.pose.apply(scene.source)
    squares = np.square(np.linalg.norm(moved[:, None] - scene.target[None], axis=2))
    psi = np.where(squares <= np.square(4.0 * state.sigma[0]), np.exp(-squares / (2.0 * state.sigma[0] ** 2)), 0.0)
    assert np.allclose(bp_marginals(psi, 0.12, 6), p, atol=1e-12)
    used = state.support[0] >= 0.15
    gap = np.square(moved - state.soft[0]).sum(axis=1)
    assert state.objective[0] == pytest.approx((state.support[0] * gap)[used].sum(), rel=1e-10)
    assert state.sigma[0] == pytest.approx(1.1 * 0.9**7)


def test_a_large_motion_comes_back(rng):
    """For equal clouds, turned by 200° and moved, the pose is found from a start 10° off."""
    source = rng.uniform(-3.0, 3.0, (60, 2)) + 5.0
    truth = Pose.from_angle(np.radians(200.0), (2.0, -4.0))
    start = Pose.from_angle(np.radians(10.0)).compose(truth)
    target = truth.apply(source)
    centre = target.mean(axis=0)
    start = Pose(start.R, centre - start.R @ source.mean(axis=0) + 0.2)
    result = register(source, target, "association-bp", start=start, first=1.0, last=0.02)
    assert result.status is Status.CONVERGED
    assert rre(result.pose, truth) < 1e-6
    assert rte(result.pose, truth) < 1e-5


def test_the_room_batched_and_one_by_one():
    """From 45° the clean room is found on all 6 seeds; a batch gives what single runs give, to 1e-12."""
    scenes = [room("clean", seed=seed) for seed in SEEDS[:6]]
    result = register(
        np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), "association-bp",
        start=room_start(), **RACE,
    )  # fmt: skip
    assert (rre(result.pose, Pose.identity()) < np.radians(1.0)).all()
    assert (rte(result.pose, Pose.identity()) < 0.1).all()
    for k in (0, 5):
        alone = register(scenes[k].source, scenes[k].target, "association-bp", start=room_start(), **RACE)
        assert np.abs(alone.pose.matrix - result.pose.matrix[k]).max() < 1e-12
        assert alone.steps == result.steps[k]


@pytest.mark.parametrize("method", ["association-bp", "hypothesis-mixture"])
def test_degenerate_scenes_are_said(method):
    """Without overlap no point has support; coincident points leave the rotation open; others are undisturbed."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.7], [0.0, 0.7]])
    source = np.stack([square, square, np.full((4, 2), 0.2)])
    target = np.stack([square + 100.0, square + 0.05, square])
    result = register(source, target, method, first=0.5, last=0.1)
    assert result.status[0] == Status.DEGENERATE
    assert "support" in result.reason[0]
    assert result.status[1] == Status.CONVERGED
    assert np.abs(result.pose.apply(source)[1] - target[1]).max() < 1e-2
    assert result.status[2] in (Status.DEGENERATE, Status.CAPPED)
    assert np.isfinite(result.pose.matrix).all()


@pytest.mark.parametrize("method", ["association-bp", "hypothesis-mixture"])
@pytest.mark.parametrize("name", ["wall", "circle", "two", "junk"])
def test_awkward_scenes_end(rng, method, name):
    """One wall, a circle, two points or all outliers end with a finite pose and a status, without a warning."""
    wall = np.column_stack([np.linspace(-3.0, 3.0, 40), np.zeros(40)])
    angles = np.arange(50) * np.pi / 25.0
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    source, target = {
        "wall": (wall, wall + np.array([0.05, 0.1])),
        "circle": (circle, Pose.from_angle(0.3, (0.1, 0.0)).apply(circle)),
        "two": (np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.05, 0.1], [1.05, 0.1]])),
        "junk": (rng.uniform(-5.0, 5.0, (50, 2)), rng.uniform(-5.0, 5.0, (60, 2))),
    }[name]
    result = register(source, target, method)
    assert result.status != Status.RUNNING
    assert np.isfinite(result.pose.matrix).all()
    if name == "wall":
        assert np.abs(result.pose.apply(source)[:, 1] - 0.1).max() < 1e-3


@settings(max_examples=50, deadline=None, derandomize=True, database=None)
@given(
    st.lists(
        st.lists(st.sampled_from([0.0, 1.0, -1.0, 1e-150, 5e-324, 1e8, 1e150, -1e150, 0.3]), min_size=2, max_size=2),
        min_size=1, max_size=5,
    ),
    st.sampled_from(["association-bp", "hypothesis-mixture"]),
    st.sampled_from([{}, {"first": 1e-100, "last": 1e-100}, {"first": 1e100}, {"shrink": 1.0}, {"miss": 1e12}]),
)  # fmt: skip
def test_any_clouds_end_with_a_status_and_a_finite_pose(points, method, options):
    cloud = np.array(points)
    result = register(cloud, cloud[::-1] * 0.5, method, **options)
    assert result.status in (Status.CONVERGED, Status.STALLED, Status.CAPPED, Status.DEGENERATE)
    assert (result.status == Status.DEGENERATE) <= bool(result.reason)
    assert np.isfinite(result.pose.matrix).all()
    assert np.isfinite(result.objective)


@pytest.mark.parametrize(
    "wrong",
    [{"first": 0.0}, {"last": -1.0}, {"shrink": 0.0}, {"shrink": 1.5}, {"reach": 0.0}, {"miss": 0.0}, {"sweeps": 0},
     {"last": 2.0, "first": 1.0}],
)
def test_wrong_options_are_named(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        BpOptions(**wrong)
    assert METHODS["association-bp"].options is BpOptions


def test_wrong_scores_are_named():
    for wrong in (np.zeros(3), -np.ones((2, 2)), np.array([[1.0, -1e-9]]), np.full((2, 2), np.nan), np.zeros((0, 2))):
        with pytest.raises(ValueError, match="scores"):
            bp_marginals(wrong)
    with pytest.raises(ValueError, match="16 columns"):
        exact_marginals(np.ones((2, 17)))
    with pytest.raises(ValueError, match="miss"):
        bp_marginals(np.ones((2, 2)), 0.0)
