"""FilterReg and its filters: moments against exact sums, the variance by definition, roles swapped against CPD."""

import dataclasses

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, metrics, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.soft.cpd import CpdOptions, responsibilities
from solvers.methods.soft.filterreg import STAGES, FilterRegOptions
from solvers.numerics import kernel_filters
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

# The filters' errors, measured on the room at σ = 0.12 to 1.1 u: the largest relative error of m⁰, and the largest
# error of a target m¹/m⁰ in units of σ. The exact sums beside them are exact up to rounding.
ERROR = {"exact": (1e-12, 1e-12), "grid": (0.005, 0.004), "lattice": (0.15, 0.12)}


def problem(source, target):
    weights = np.ones((1, len(source)))
    return Problem(source[None], target[None], weights, Pose.identity(2, (1,)), np.zeros(1, dtype=np.int64))


def exact(points, queries, sigma):
    """m⁰, m¹/m⁰ and m²/m⁰ from the definition."""
    K = np.exp(-np.square(queries[:, None] - points).sum(axis=2) / (2.0 * sigma**2))
    mass = K.sum(axis=1)
    return mass, K @ points / mass[:, None], K @ np.square(points).sum(axis=1) / mass


@pytest.mark.parametrize("kind", kernel_filters.KINDS)
@pytest.mark.parametrize("sigma", [0.12, 0.3, 1.1])
def test_moments_against_exact_sums(kind, sigma):
    """Each filter's moments at the moving points agree with exact sums to within its known errors; the weighted mean
    square distance, from which the variance is computed, is never negative."""
    s = room("clean")
    result = kernel_filters.build(kind, s.target, sigma)
    answer = result.query(s.source)
    mass, mean, _ = exact(s.target - result.centre, s.source - result.centre, sigma)
    wrong_mass, wrong_target = ERROR[kind]
    assert np.abs(answer.mass / mass - 1.0).max() < wrong_mass
    target = answer.first / answer.mass[:, None]
    assert np.linalg.norm(target - mean, axis=1).max() < wrong_target * sigma
    x = s.source - result.centre
    squares = np.square(x).sum(axis=1) - 2.0 * (x * target).sum(axis=1) + answer.second / answer.mass
    expected = np.square(x).sum(axis=1) - 2.0 * (x * mean).sum(axis=1) + exact(s.target - result.centre, x, sigma)[2]
    assert np.all(squares > -1e-12)
    assert np.sqrt(np.mean((squares - expected) ** 2)) < max(wrong_target, 1e-10) * np.mean(expected)


@pytest.mark.parametrize(
    ("kind", "largest", "typical"), [("exact", 1e-12, 1e-12), ("grid", 0.006, 0.001), ("lattice", 0.2, 0.03)]
)
def test_kernel_errors(kind, largest, typical):
    """The largest and the typical error of a filter's effective kernel against a Gaussian of height 1, in any unit:
    under 0.6 % for the grid, under 20 % for the lattice, and neither is exact."""
    for sigma in (1.0, 1e-3):
        worst, mean = kernel_filters.kernel_error(kind, sigma)
        assert worst < largest
        assert mean < typical
        assert kind == "exact" or worst > 0.1 * largest


@pytest.mark.parametrize("kind", ["grid", "lattice"])
def test_a_filters_kernel_has_the_right_mass_and_variance(kind):
    """Summed over the plane a filter's kernel gives 2πσ², and its variance is σ² in every direction."""
    sigma = 0.5
    rng = np.random.default_rng(3)
    points = rng.uniform(-3.0, 3.0, (300, 2))
    result = kernel_filters.build(kind, points, sigma)
    step = 0.11 * sigma
    axis = np.arange(-7.0, 7.0, step)
    queries = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    answer = result.query(queries)
    assert answer.mass.sum() * step**2 / len(points) == pytest.approx(2.0 * np.pi * sigma**2, rel=1e-3)
    # Cov(query) under the filtered density is Cov(points) + σ² I.
    p = answer.mass / answer.mass.sum()
    spread = (queries * p[:, None]).T @ queries - np.outer(p @ queries, p @ queries)
    own = np.cov(points.T, bias=True)
    np.testing.assert_allclose((spread - own) / sigma**2, np.eye(2), atol=0.05)


@pytest.mark.parametrize("kind", ["grid", "lattice"])
def test_splat_keeps_the_values(kind):
    """Splatting preserves mass and keeps first moments in place; blurring preserves the sums."""
    points = np.random.default_rng(4).standard_normal((50, 2))
    result = kernel_filters.build(kind, points, 0.3)
    centred = points - result.centre
    np.testing.assert_allclose(result.splat[:, 0].sum(), 50.0)
    places = result.places(result.splat_codes) - result.centre
    np.testing.assert_allclose(result.splat[:, 0] @ places, centred.sum(axis=0), atol=1e-12)
    np.testing.assert_allclose(result.splat[:, 1:3].sum(axis=0), centred.sum(axis=0))
    area = result.side**2 * (1.0 if kind == "grid" else np.sqrt(0.75))
    sums = result.values.sum(axis=0) * area / (2.0 * np.pi * 0.09)
    np.testing.assert_allclose(sums, result.splat.sum(axis=0), atol=1e-9)
    assert np.all(np.diff(result.codes) > 0)
    assert len(result.codes) > len(result.splat_codes)


@pytest.mark.parametrize("size", [7, 1500])
@pytest.mark.parametrize("kind", kernel_filters.KINDS)
def test_filters_of_many_clouds_are_those_of_each(kind, size):
    """To the bit, for clouds in a group of many and for clouds that are a group by themselves."""
    rng = np.random.default_rng(6)
    extents = np.array([1e-3, 1.0, 50.0, 1.0, 1e6])
    clouds = rng.standard_normal((5, size, 2)) * extents[:, None, None] + rng.standard_normal((5, 1, 2))
    queries, sigma = clouds[:, ::-2] + 0.1 * extents[:, None, None], extents * [0.3, 0.02, 1.0, 5.0, 0.1]
    filters = kernel_filters.build_each(kind, clouds, sigma)
    every = kernel_filters.query_each(filters, queries)
    for i, (cloud, width, places) in enumerate(zip(clouds, sigma, queries, strict=True)):
        alone = kernel_filters.build(kind, cloud, float(width))
        for name in (each.name for each in dataclasses.fields(alone)):
            np.testing.assert_array_equal(getattr(filters[i], name), getattr(alone, name), err_msg=name)
        answer = alone.query(places)
        np.testing.assert_array_equal(every.mass[i], answer.mass)
        np.testing.assert_array_equal(every.first[i], answer.first)
        np.testing.assert_array_equal(every.second[i], answer.second)
    with pytest.raises(ValueError, match=r"^sigma: .* got 1e-09$"):
        kernel_filters.build_each(kind, clouds, np.where(np.arange(5) == 3, 1e-9, sigma))


@pytest.mark.parametrize("kind", ["grid", "lattice"])
def test_a_query_beyond_the_lattice_has_no_mass(kind):
    result = kernel_filters.build(kind, np.random.default_rng(4).standard_normal((50, 2)), 0.3)
    answer = result.query(np.array([[100.0, 0.0], [-1e200, 1e200], [0.0, 1e9], [3.0, -1e6]]))
    np.testing.assert_array_equal(answer.mass, 0.0)
    np.testing.assert_array_equal(answer.first, 0.0)


def test_a_filter_that_would_be_too_fine_is_refused():
    with pytest.raises(ValueError, match=r"^sigma: "):
        kernel_filters.build("grid", np.array([[0.0, 0.0], [1e9, 0.0]]), 1.0)
    with pytest.raises(ValueError, match=r"^kind: "):
        kernel_filters.build("tree", np.eye(2), 1.0)


@pytest.mark.parametrize("volume", [None, 36.0])
def test_every_state_is_what_the_definition_says(volume):
    """Targets, weights, likelihood and estimated variance along a run agree with sums over all pairs."""
    s = room("outliers")
    options = FilterRegOptions(filter="exact", clutter=0.25, volume=volume)
    batch = begin(METHODS["filterreg"], problem(s.source, s.target), options)
    offsets = s.target - s.target.mean(axis=0)
    n, V = len(s.target), volume or 6.0 * np.square(offsets).sum(axis=1).mean()
    for _ in range(6):
        state = batch.state()
        sigma, x = state.sigma[0], batch.pose().apply(s.source[None])[0]
        mass, mean, second = exact(s.target, x, sigma)
        c = 2.0 * np.pi * sigma**2 * 0.25 * n / (0.75 * V)
        W = mass / (mass + c)
        np.testing.assert_allclose(state.mass[0], mass, rtol=1e-9)
        np.testing.assert_allclose(state.targets[0], mean, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(state.weights[0], W, rtol=1e-9)
        density = 0.25 / V + 0.75 / n * mass / (2.0 * np.pi * sigma**2)
        np.testing.assert_allclose(state.objective[0], -np.log(density).sum(), rtol=1e-9)
        batch = advance(batch)
        # σ² = Σ W (‖x‖² − 2 x·m¹/m⁰ + m²/m⁰) / (d ΣW) with d = 2, not 3, and the points moved.
        x = batch.pose().apply(s.source[None])[0]
        squares = np.square(x).sum(axis=1) - 2.0 * (x * mean).sum(axis=1) + second
        np.testing.assert_allclose(batch.state().sigma[0] ** 2, W @ squares / (2.0 * W.sum()), rtol=1e-9)


def test_the_roles_are_swapped_against_cpd():
    """CPD's responsibilities with the clouds exchanged: weights are its row sums, targets its soft targets."""
    s = room("clean")
    state = begin(
        METHODS["filterreg"], problem(s.source, s.target), FilterRegOptions("exact", first=0.5, volume=36.0)
    ).state()
    reverse = begin(
        METHODS["cpd-rigid"], problem(s.target, s.source), CpdOptions(clutter=0.25, volume=36.0, sigma=0.5)
    ).state()
    P = responsibilities(reverse)  # (target points, source points)
    np.testing.assert_allclose(state.weights[0], P.sum(axis=0), rtol=1e-9)
    np.testing.assert_allclose(state.targets[0], P.T @ s.target / P.sum(axis=0)[:, None], rtol=1e-9)
    np.testing.assert_allclose(state.objective, reverse.objective, rtol=1e-9)


def test_with_exact_sums_the_likelihood_grows_from_a_near_start():
    """The twist step minimises a linearised sum of squares, so descent is not guaranteed; with exact sums, an estimated
    σ and a start within reach, the negative log-likelihood still falls at every step."""
    s = room("outliers")
    result = register(s.source, s.target, "filterreg", filter="exact", start=room_start(20.0, 0.5))
    assert np.all(np.diff(result.history.objective) <= 1e-9)


@pytest.mark.parametrize("kind", kernel_filters.KINDS)
@pytest.mark.parametrize("variance", ["estimated", "scheduled"])
def test_large_motions_are_found_from_near_them(kind, variance):
    s = room("clean")
    truth = Pose.from_angle(np.radians(-150.0), (4.0, -3.0))
    start = Pose.from_angle(np.radians(-130.0), (3.8, -2.9))
    result = register(s.source, truth.apply(s.target), "filterreg", start=start, filter=kind, variance=variance)
    assert metrics.rre(result.pose, truth) < np.radians(0.5)
    assert metrics.point_error(result.pose, truth, s.source) < 0.05


def test_twists_compose_to_the_pose():
    """Each step turns by the twist's ω about the weighted centroid, then moves by its v; composed, they are the
    pose."""
    s = room("clean")
    batch = begin(METHODS["filterreg"], problem(s.source, s.target), FilterRegOptions(first=1.0))
    for _ in range(4):
        before, batch = batch.state(), advance(batch)
        vx, vy, omega = batch.state().twist[0]
        W, x = before.weights[0], before.moved[0]
        centre = W @ x / W.sum()
        moved = (x - centre) @ Pose.from_angle(omega).R.T + centre + [vx, vy]
        np.testing.assert_allclose(batch.state().moved[0], moved, atol=1e-10)
        # Gauss-Newton about the centroid: ω = Σ W a × r / Σ W ‖a‖², v = mean residual.
        a, r = x - centre, before.targets[0] - x
        assert omega == pytest.approx(W @ (a[:, 0] * r[:, 1] - a[:, 1] * r[:, 0]) / (W @ np.square(a).sum(axis=1)))
        np.testing.assert_allclose([vx, vy], W @ r / W.sum(), atol=1e-12)
    assert len(STAGES) == 4


@pytest.mark.parametrize(("variance", "share"), [("estimated", 0.001), ("scheduled", 0.03)])
def test_the_widths_that_nobody_gives_are_those_of_the_documentation(variance, share):
    """A schedule begins at 0.3 of the target's RMS radius, an estimated σ at the RMS difference over all pairs; the
    last is 0.001 or 0.03 of that radius, and never above a first σ that is given."""
    s = room("clean")
    radius = np.sqrt(np.square(s.target - s.target.mean(axis=0)).sum(axis=1).mean())
    pairs = np.sqrt(np.square(s.source[:, None] - s.target).sum(axis=2).mean() / 2.0)
    first = {"estimated": pairs, "scheduled": 0.3 * radius}[variance]
    options = {"filter": "exact", "variance": variance}
    state = begin(METHODS["filterreg"], problem(s.source, s.target), FilterRegOptions(**options)).state()
    assert state.sigma[0] == pytest.approx(first)
    assert state.last[0] == pytest.approx(share * radius)
    small = 0.5 * share * radius
    state = begin(METHODS["filterreg"], problem(s.source, s.target), FilterRegOptions(**options, first=small)).state()
    assert state.sigma[0] == state.last[0] == pytest.approx(small)


def test_a_filter_is_made_anew_only_when_sigma_has_changed():
    """At the last σ of a schedule all steps share one filter; before that, every step has its own."""
    s = room("clean")
    batch = begin(METHODS["filterreg"], problem(s.source, s.target), FilterRegOptions(variance="scheduled", last=0.9))
    filters = [batch.state().filters[0]]
    while not batch.done:
        batch = advance(batch)
        if batch.state().filters[0] is not filters[-1]:
            filters.append(batch.state().filters[0])
    widths = [f.sigma for f in filters]
    assert np.all(np.diff(widths) < 0.0)
    assert widths[-1] == 0.9
    assert len(filters) < batch.steps[0]


def test_a_batch_is_its_single_runs():
    scenes = [room("combo", seed=seed) for seed in SEEDS[:4]]
    source, target = np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])
    for kind in ("lattice", "exact"):
        batch = register(source, target, "filterreg", start=room_start(30.0), max_steps=15, filter=kind)
        for k in range(4):
            alone = register(source[k], target[k], "filterreg", start=room_start(30.0), max_steps=15, filter=kind)
            assert alone.steps == batch.steps[k]
            np.testing.assert_allclose(batch.matrix[k], alone.matrix, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", kernel_filters.KINDS)
def test_scenes_that_determine_nothing(kind):
    """Equal source points leave the turn free; two points, a single fixed point, no overlap: a status, never NaN."""
    s = room("clean")
    equal = register(np.full((4, 2), 0.3), s.target, "filterreg", filter=kind, max_steps=300)
    assert equal.status in (Status.DEGENERATE, Status.CAPPED)
    if equal.status == Status.DEGENERATE:
        assert "free" in equal.reason
    single = register(s.source, [[0.1, 0.2]], "filterreg", filter=kind, max_steps=300)
    assert np.isfinite(single.matrix).all()
    two = np.array([[0.0, 0.0], [2.0, 0.0]])
    pair = register(two, Pose.from_angle(0.3, (0.1, 0.2)).apply(two), "filterreg", filter=kind, variance="scheduled")
    assert metrics.point_error(pair.pose, Pose.from_angle(0.3, (0.1, 0.2)), two) < 0.05
    failure = register(s.source, s.target + 100.0, "filterreg", filter=kind, first=0.5, volume=36.0)
    assert failure.status == Status.DEGENERATE
    assert "clutter explains every moving point" in failure.reason


def test_all_outliers_and_a_circle(rng):
    source, target = rng.uniform(-5.0, 5.0, (2, 60, 2))
    assert register(source, target, "filterreg").status in (Status.CONVERGED, Status.CAPPED)
    f = 2.0 * np.pi * np.arange(60) / 60.0
    circle = np.column_stack([np.cos(f), np.sin(f)])
    circle_result = register(circle, Pose.from_angle(2.0).apply(circle), "filterreg")
    assert metrics.rre(circle_result.pose, Pose.from_angle(2.0)) > np.radians(30.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("filter", "grids"), ("variance", "fixed"), ("first", 0.0), ("last", -1.0), ("shrink", 0.0), ("clutter", 0.0),
        ("clutter", 1.0), ("volume", 0.0), ("tolerance", -1.0),
    ],
)  # fmt: skip
def test_options_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"^{name}: "):
        register(np.eye(2), np.eye(2), "filterreg", **{name: value})


@pytest.mark.parametrize("setting", ["clean", "combo"])
def test_on_ordinary_scans_it_comes_to_rest(setting):
    """Ten rooms from 20° and 0.3 u with defaults: every run converges, and the median in fewer than 50 steps. If the
    lattice cannot tell a new σ from the previous one, the previous one is kept."""
    scenes = [room(setting, seed=seed) for seed in SEEDS[:10]]
    source, target = (np.stack([getattr(s, name) for s in scenes]) for name in ("source", "target"))
    result = register(source, target, "filterreg", start=room_start(20.0, 0.3))
    assert (result.status == Status.CONVERGED).all()
    assert np.median(result.steps) < 50
    batch, rests = begin(METHODS["filterreg"], problem(source[0], target[0])), 0
    while not batch.done:
        before = batch.state().sigma[0]
        batch = advance(batch)
        change = abs(batch.state().sigma[0] / before - 1.0)
        assert change == 0.0 or change > 0.01
        rests += change == 0.0
    assert rests >= 1
