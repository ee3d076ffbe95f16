"""Whatever the input: a clear error that names the argument, or an answer without NaN, and never an endless loop."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers import METHODS, Pose, Result, Status, fit_planar, fit_rigid, register
from solvers.scenes import room

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

AWKWARD = [0.0, -0.0, 1.0, -1.0, 0.1, 3.0, 1e-8, 1e-150, -1e-150, 5e-324, 1e8, 1e150, -1e150, 1.0 + 2**-52]
NO_NUMBERS = [float("nan"), float("inf"), float("-inf"), 1e200, 1.7e308]
numbers = st.sampled_from(AWKWARD) | st.floats(-10.0, 10.0)
hostile = settings(max_examples=150, deadline=None, derandomize=True, database=None)


def clouds(n, d, values=numbers):
    return st.lists(st.lists(values, min_size=d, max_size=d), min_size=n, max_size=n).map(np.array)


@st.composite
def point_pairs(draw):
    d = draw(st.sampled_from([2, 2, 3, 4]))
    n = draw(st.integers(4 if d == 4 else 1, 6))  # fewer rows of four are taken for a transposed cloud
    source = draw(clouds(n, d))
    # Unrelated, equal, coincident and mirrored targets: each can be degenerate, or nearly so.
    target = draw(
        st.one_of(
            clouds(n, d),
            st.just(source),
            clouds(1, d).map(lambda cloud: np.repeat(cloud, n, axis=0)),
            st.just(source * np.r_[-1.0, np.ones(d - 1)]),
        )
    )
    weights = draw(st.none() | st.lists(st.sampled_from([0.0, 1.0, 2.5, 1e-150, 1e150]), min_size=n, max_size=n))
    return source, target, weights


def check(pose, status, reason, objective):
    assert status in set(Status) - {Status.RUNNING}
    assert (status == Status.DEGENERATE) <= bool(reason)
    assert np.isfinite(pose.R).all()
    assert np.isfinite(pose.t).all()
    assert np.isfinite(pose.scale)
    assert np.linalg.det(pose.R) == pytest.approx(1.0, abs=1e-12)
    assert not np.isnan(objective)


@hostile
@given(point_pairs(), st.booleans())
def test_any_finite_pairs_get_a_finite_answer(pairs, scale):
    """Coincident, collinear, mirrored, huge and tiny points: always a proper rotation or degenerate, never NaN."""
    source, target, weights = pairs
    for fit in [fit_rigid, fit_planar] if source.shape[1] == 2 else [fit_rigid]:
        result = fit(source, target, weights, scale=scale)
        check(result.pose, result.status, result.reason, result.cost)
        assert not np.isnan(result.singular_values).any()
        assert not np.isnan(result.condition)
    free = fit_rigid(source, target, weights, scale=scale, proper=False)
    assert np.isfinite(free.pose.matrix).all()
    assert free.cost <= fit_rigid(source, target, weights, scale=scale).cost * (1 + 1e-6) + 1e-300


@hostile
@given(point_pairs(), st.sampled_from(sorted(METHODS)))
def test_every_method_survives_any_finite_pairs(pairs, method):
    """Each method stops with a truthful status on whatever finite clouds it is given."""
    source, target, weights = pairs
    dims = METHODS[method].dims
    if dims is not None and source.shape[1] not in dims:
        with pytest.raises(ValueError, match="dimensions"):
            register(source, target, method)
        return
    result = register(source, target, method, weights=weights if METHODS[method].weighted else None)
    check(result.pose, result.status, result.reason, result.objective)
    assert result.steps <= METHODS[method].max_steps


@st.composite
def two_clouds(draw):
    """Two planar clouds, each sometimes in its own unit and of its own width, side by side or worlds apart."""
    units = st.sampled_from([1e-300, 1e-200, 1e-150, 1e-100, 1e-9, 1.0, 1e9, 1e100, 1e149])
    unit = draw(units)
    clouds_ = []
    for _ in range(2):
        points = draw(clouds(draw(st.integers(1, 6)), 2, st.sampled_from([0.0, 1.0, -1.0, 0.5]) | st.floats(-1.0, 1.0)))
        own = draw(st.just(unit) | units)
        clouds_.append(points * own * draw(st.sampled_from([1.0, 1.0, 1e-3])))
    shift = unit * np.array([draw(st.sampled_from([0.0, 1.0, 10.0, 1e3, 1e6, 1e12])), 0.0])
    return clouds_[0], (clouds_[1] + shift).clip(-1e150, 1e150)


@settings(hostile, max_examples=20)
@given(two_clouds())
def test_clouds_worlds_apart_and_in_any_unit_get_an_answer(both):
    """Clouds that are disjoint, within one cell, or a point beside a plain: each method stops with a finite pose."""
    for name, method in METHODS.items():
        if not method.paired:
            result = register(*both, name)
            check(result.pose, result.status, result.reason, result.objective)


@pytest.mark.parametrize("method", ["soft-annealed", "association-bp", "hypothesis-mixture"])
@pytest.mark.parametrize("unit", [1e-156, 1e-160, 1e-200])
def test_a_width_without_a_square_weighs_without_a_warning(method, unit):
    """If σ² underflows, the kernel is 1 for points at one place and 0 for all others."""
    target = unit * np.random.default_rng(3).standard_normal((6, 2))
    for source in (np.zeros((4, 2)), target):
        result = register(source, target, method)
        check(result.pose, result.status, result.reason, result.objective)


@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("fast-robust-icp", {"first": 8.0, "last": 1e-3}),
        ("soft-annealed", {"last": 1e-12, "shrink": 0.8, "least_support": 0.0}),
    ],
)
def test_a_weight_that_vanishes_is_zero_to_who_has_numpy_raise_errors_too(method, options):
    scene = room("noise")
    pair = scene.source[::3], scene.target[::3]
    expected = register(*pair, method, **options)
    with np.errstate(all="raise"):
        result = register(*pair, method, **options)
    assert result.pose == expected.pose


@pytest.mark.parametrize("method", [name for name in sorted(METHODS) if not METHODS[name].paired])
def test_a_source_that_is_a_point_beside_the_target(method):
    """With more than a hundred powers of ten between the clouds, the square of their ratio overflows."""
    rng = np.random.default_rng(3)
    result = register(1e-103 * rng.standard_normal((12, 2)), 1e100 * rng.standard_normal((15, 2)), method)
    check(result.pose, result.status, result.reason, result.objective)


JUNK = st.one_of(
    st.none(),
    st.text(max_size=3),
    st.integers(-3, 3),
    st.lists(st.integers(0, 3), max_size=3),
    st.lists(st.lists(st.integers(0, 3), max_size=3), max_size=3),
    clouds(3, 2, st.sampled_from(NO_NUMBERS + AWKWARD)),
    st.just(np.zeros((0, 2))),
    st.just(np.zeros((3, 0))),
    st.just(np.zeros((3, 1))),
    st.just(np.zeros((0, 3, 2))),
    st.just(np.ones((3, 2), dtype=complex)),
    st.just(np.ones((3, 2), dtype=bool)),
    st.just(np.array([["a", "b"]])),
    st.just(np.array([[None, 1.0]])),
    st.just({"x": 1}),
    st.just(object()),
)
NAMES = ["source", "target", "weights", "pairs", "start", "seed", "max_steps"]


def takers(name):
    """The methods that accept an argument of this name; the others refuse any value of it."""
    field = {"pairs": "paired", "weights": "weighted"}.get(name)
    return sorted(method for method, about in METHODS.items() if field is None or getattr(about, field))


@pytest.mark.parametrize("name", NAMES)
@settings(hostile, max_examples=60)
@given(JUNK, st.data())
def test_what_is_no_input_is_refused_by_name(name, junk, data):
    """Text, ragged lists, NaN, infinities and wrong shapes, passed as each argument of a method that accepts it, give a
    ValueError that begins with the argument's name, or a proper result."""
    method = data.draw(st.sampled_from(takers(name)))
    rng = np.random.default_rng(3)
    arguments = {"source": rng.standard_normal((3, 2)), "target": rng.standard_normal((3, 2)), name: junk}
    text, result = "", None
    try:
        result = register(method=method, **arguments)
    except ValueError as error:
        text = str(error)
    if result is None:
        # A valid source of another size is only noticed when it is compared with the target.
        assert text.startswith((f"{name}: ", "target: ") if name == "source" else f"{name}: ")
    else:
        assert isinstance(result, Result)
        assert np.isfinite(result.pose.matrix).all()


@pytest.mark.parametrize("value", NO_NUMBERS)
@pytest.mark.parametrize("name", ["source", "target", "weights"])
def test_a_single_bad_number_is_reported(name, value):
    """A single NaN, infinity or number too large to square is refused, and the message names the argument."""
    arguments = {"source": np.eye(3), "target": np.eye(3), "weights": np.ones(3)}
    arguments[name] = arguments[name].copy()
    arguments[name].flat[1] = value
    for solve in (fit_rigid, register):
        with pytest.raises(ValueError, match=rf"^{name}: .*(not finite|overflow)"):
            solve(**arguments)


@pytest.mark.parametrize("name", ["source", "target"])
def test_rows_that_are_not_finite_can_be_left_out_as_the_message_says(name):
    """A laser's beams without an echo are such rows."""
    cloud = np.vstack([np.eye(2), [[np.nan, np.nan], [0.0, np.inf]]])
    with pytest.raises(ValueError, match=rf"^{name}: 3 of 8 numbers are not finite; .* has the rows") as failure:
        register(**{"source": np.eye(2), "target": np.eye(2), name: cloud})
    remedy = str(failure.value).partition("; ")[2].partition(" has ")[0]
    rows = eval(remedy, {"numpy": np, name: cloud})
    assert rows.tolist() == np.eye(2).tolist()
    with pytest.raises(ValueError, match=rf"^{name}: .* are of unequal size: pass them as a list$"):
        register(**{"source": np.eye(2), "target": np.eye(2), name: np.stack([cloud, cloud])})


@hostile
@given(clouds(3, 2), clouds(3, 2))
def test_a_start_pose_never_matters_to_a_closed_form(source, target):
    """Whatever the start, even absurdly far off, a closed form's answer is the same, bit for bit."""
    a = register(source, target, "kabsch")
    b = register(source, target, "kabsch", start=Pose.from_angle(2.0, (1e100, -1e100)))
    assert np.array_equal(a.pose.matrix, b.pose.matrix)
    assert a.status == b.status
