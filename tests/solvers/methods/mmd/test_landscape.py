"""Landscapes over translations: they equal the plain definition at every node, and paths descend on them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import Pose, Status, register
from solvers.methods.mmd.capped_landscape import capped_field
from solvers.methods.mmd.landscape import mmd_field
from solvers.numerics.fourier_features import mean_features
from solvers.scenes.rooms import room

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

SCENE = room("combo", seed=66)


def _definition(turned, target, cap, t):
    """(1/M) Σ min(min_j ‖x_i + t − y_j‖², τ²), with every distance written out."""
    squares = np.square(turned[:, None] + t - target[None]).sum(axis=-1)
    return np.minimum(squares.min(axis=1), cap**2).mean()


def test_the_mmd_map_is_the_objective_at_every_node(rng):
    """The product of phases equals the squared distance of the mean features of clouds that are actually moved."""
    turned = Pose.from_angle(0.3).apply(SCENE.source)
    w = rng.standard_normal((20, 2)) / 0.8
    field = mmd_field(turned, SCENE.target, w)
    xs, ys = np.linspace(-2.0, 1.0, 5), np.linspace(-1.0, 3.0, 4)
    grid = field.grid(xs, ys)
    fixed = mean_features(SCENE.target[None], w[None])
    for i, y in enumerate(ys):
        for j, x in enumerate(xs):
            moving = mean_features(turned[None] + [x, y], w[None])
            expected = np.square(moving - fixed).sum()
            assert grid[i, j] == pytest.approx(expected, abs=1e-13)
            assert field.values([x, y]) == pytest.approx(expected, abs=1e-13)
    start = register(
        turned, SCENE.target, "mmd", start=Pose.from_angle(0.0, (1.0, -1.0)), lengths=(0.8,), count=20, max_steps=0
    )
    second = mmd_field(turned, SCENE.target, start.detail("frequencies") / 0.8)
    assert second.values([1.0, -1.0]) == pytest.approx(start.objective, rel=1e-12)


@pytest.mark.parametrize("squares", [1, 500, 2**13])
@pytest.mark.parametrize("cap", [0.05, 0.5, 2.6, 30.0])
def test_the_capped_map_is_the_definition(cap, squares):
    """The look-up misses no neighbour: it agrees with all distances within the cap, beyond it and far outside, however
    many squares there are."""
    turned = Pose.from_angle(-0.2).apply(SCENE.source)
    field = capped_field(turned, SCENE.target, cap, squares=squares)
    xs, ys = np.linspace(-3.0, 14.0, 8), np.linspace(-2.5, 60.0, 7)
    grid = field.grid(xs, ys)
    for i, y in enumerate(ys):
        for j, x in enumerate(xs):
            assert grid[i, j] == pytest.approx(_definition(turned, SCENE.target, cap, [x, y]), rel=1e-13)


@settings(max_examples=80, deadline=None, derandomize=True, database=None)
@given(st.integers(0, 10**6), st.sampled_from([0.3, 1.0, 8.0]), st.sampled_from(["spread", "line", "equal", "grid"]))
def test_the_nearest_is_the_nearest_and_ties_go_to_the_lowest(seed, cap, kind):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 60))
    target = {
        "spread": rng.standard_normal((n, 2)),
        "line": np.column_stack([rng.standard_normal(n), np.zeros(n)]),
        "equal": np.zeros((n, 2)),
        "grid": rng.integers(-2, 3, (n, 2)).astype(np.float64),
    }[kind]
    points = np.concatenate([2.0 * rng.standard_normal((40, 2)), rng.integers(-4, 5, (40, 2)) / 2.0])
    field = capped_field(points, target, cap)
    rows, squares = field.nearest(points[:, 0], points[:, 1])
    d = np.square(points[:, None, 0] - target[:, 0]) + np.square(points[:, None, 1] - target[:, 1])
    assert np.array_equal(squares, np.minimum(d.min(axis=1), cap**2))
    near = d.min(axis=1) <= cap**2
    assert np.array_equal(rows[near], d.argmin(axis=1)[near])
    assert (rows[~near] == n).all()


def test_the_gated_path_descends_on_exactly_the_capped_objective():
    """From a hundred starts the capped objective never rises, and ends where a further step is zero."""
    field = capped_field(SCENE.source, SCENE.target, 1.2)
    ticks = np.linspace(-3.0, 3.0, 10)
    starts = np.stack(np.meshgrid(ticks, ticks), axis=-1)
    path = field.path(starts, max_steps=200)
    assert path.points.shape[1:] == (10, 10, 2)
    assert np.array_equal(path.points[0], starts)
    assert (np.diff(path.objective, axis=0) <= 1e-14).all()
    assert (path.status == Status.CONVERGED).all()
    for i, j in ((0, 0), (4, 5), (9, 3)):
        end = path.points[-1, i, j]
        assert path.objective[-1, i, j] == pytest.approx(
            _definition(SCENE.source, SCENE.target, 1.2, end), rel=1e-12
        )
        assert np.array_equal(path.points[path.steps[i, j], i, j], end)
        squares = np.square(SCENE.source[:, None] + end - SCENE.target[None]).sum(axis=-1)
        used = squares.min(axis=1) <= 1.2**2
        offset = SCENE.target[squares.argmin(axis=1)] - SCENE.source - end
        assert np.abs(offset[used].mean(axis=0)).max() < 2e-6
        alone = field.path(starts[i, j], max_steps=200)
        assert np.abs(alone.points[-1] - end).max() < 1e-12
        assert alone.steps == path.steps[i, j]


def test_the_mmd_path_descends_to_a_stationary_point(rng):
    """Levenberg-Marquardt in t never raises the objective, and ends where its slope is zero."""
    w = rng.standard_normal((32, 2)) / 0.9
    field = mmd_field(SCENE.source, SCENE.target, w)
    starts = np.array([[0.7, 0.3], [-1.0, 0.2], [2.5, -2.0], [0.0, 0.0]])
    path = field.path(starts, max_steps=300, tolerance=1e-8)
    assert (np.diff(path.objective, axis=0) <= 0.0).all()
    for k in range(len(starts)):
        assert path.status[k] in (Status.CONVERGED, Status.STALLED)
        end = path.points[-1, k]
        slope = [(field.values(end + e) - field.values(end - e)) / 2e-5 for e in 1e-5 * np.eye(2)]
        assert np.abs(slope).max() < 1e-6
        alone = field.path(starts[k], max_steps=300, tolerance=1e-8)
        assert np.abs(alone.points[-1] - end).max() < 1e-12
    assert np.linalg.norm(path.points[-1, 3]) < 0.4


def test_a_path_says_how_it_ended():
    """With too few steps a path is capped; with nothing within the cap it is degenerate and stays where it was."""
    field = capped_field(SCENE.source, SCENE.target, 1.0)
    assert field.path([1.0, 1.0], max_steps=2).status == Status.CAPPED
    path = field.path([[500.0, 0.0], [0.1, 0.0]])
    assert path.status.tolist() == [Status.DEGENERATE, Status.CONVERGED]
    assert path.points[-1, 0].tolist() == [500.0, 0.0]
    assert path.objective[-1, 0] == 1.0
    w = np.ones((3, 2))
    assert mmd_field(SCENE.source, SCENE.target, w).path([1.0, 1.0], max_steps=1).status == Status.CAPPED


def test_another_turned_source_needs_no_new_look_up():
    """The look-up depends on target and cap only: replacing the source in a field gives that source's field."""
    turned = Pose.from_angle(1.0).apply(SCENE.source)
    field = replace(capped_field(SCENE.source, SCENE.target, 1.0), turned=turned)
    assert field.values([0.5, 0.5]) == capped_field(turned, SCENE.target, 1.0).values([0.5, 0.5])


@pytest.mark.parametrize("scale", [1e-150, 1e-8, 1e8, 1e150])
def test_huge_and_tiny_clouds(scale):
    cloud = scale * np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.2]])
    for cap in (1e-100, 1.0, 1e100):
        field = capped_field(cloud, cloud, cap)
        assert field.values([0.0, 0.0]) == 0.0
        assert np.isfinite(field.path([0.1 * scale, 0.0]).points).all()
    assert np.isfinite(mmd_field(cloud, cloud, np.ones((4, 2)) / scale).path([0.1 * scale, 0.0]).points).all()


def test_what_is_no_input_is_named():
    cloud = np.zeros((3, 2))
    for wrong, name in (((np.zeros((3, 3)), cloud, 1.0), "turned"), ((cloud, cloud, -1.0), "cap")):
        with pytest.raises(ValueError, match=name):
            capped_field(*wrong)
    with pytest.raises(ValueError, match="frequencies"):
        mmd_field(cloud, cloud, np.ones(3))
    with pytest.raises(ValueError, match="start"):
        capped_field(cloud, cloud, 1.0).path([1.0])
    with pytest.raises(ValueError, match="xs"):
        capped_field(cloud, cloud, 1.0).grid([np.nan], [0.0])


FIELDS = {
    "mmd": mmd_field(SCENE.source, SCENE.target, np.eye(2)),
    "capped": capped_field(SCENE.source, SCENE.target, 0.5),
}


@pytest.mark.parametrize("field", list(FIELDS))
@pytest.mark.parametrize("wrong", [[np.nan, 1.0], [np.inf, 0.0], [0.0, 0.0, 0.0], 1.0, "ab"])
def test_a_field_has_values_and_paths_at_finite_translations(field, wrong):
    with pytest.raises(ValueError, match=r"^t: expected "):
        FIELDS[field].values(wrong)
    with pytest.raises(ValueError, match=r"^start: expected "):
        FIELDS[field].path(wrong)


@pytest.mark.parametrize("field", list(FIELDS))
@pytest.mark.parametrize("wrong", [np.zeros((2, 3)), 0.0, [], "ab", [0.0, np.nan]])
def test_a_map_has_a_row_of_columns_and_one_of_rows(field, wrong):
    with pytest.raises(ValueError, match=r"^xs: "):
        FIELDS[field].grid(wrong, [0.0])
    with pytest.raises(ValueError, match=r"^ys: "):
        FIELDS[field].grid([0.0], wrong)


@pytest.mark.parametrize(
    ("field", "name", "wrong"),
    [
        *((field, name, -1) for field in FIELDS for name in ("max_steps", "tolerance")),
        *((field, "max_steps", 1.5) for field in FIELDS),
        *(("mmd", "damping", wrong) for wrong in (np.nan, -1.0, "a")),
    ],
)
def test_a_path_takes_numbers_that_are_not_negative(field, name, wrong):
    with pytest.raises(ValueError, match=f"^{name}: "):
        FIELDS[field].path([0.0, 0.0], **{name: wrong})


def test_a_field_does_not_change_with_the_arrays_that_it_was_made_of(rng):
    clouds = rng.standard_normal((2, 30, 2))
    frequencies = rng.standard_normal((8, 2))
    fields = [capped_field(*clouds, 0.5), mmd_field(*clouds, frequencies)]
    before = [field.values([0.1, 0.2]) for field in fields]
    clouds += 1.0
    clouds[1] *= 2.0
    frequencies *= 3.0
    assert [field.values([0.1, 0.2]) for field in fields] == before


@pytest.mark.parametrize("form", ["mmd", "capped"])
def test_no_starts_have_an_empty_path(form, rng):
    """As a filter may leave none; the path has their shape, as for any other."""
    cloud = rng.uniform(-1.0, 1.0, (12, 2))
    field = capped_field(cloud, cloud, 1.0) if form == "capped" else mmd_field(cloud, cloud, cloud)
    path = field.path(np.zeros((0, 2)))
    assert path.status.shape == path.steps.shape == (0,)
    assert path.points.shape[1:] == (0, 2)
