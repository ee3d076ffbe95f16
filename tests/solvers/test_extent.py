"""Clouds as small and large as float64 allows, and clouds without extent: the right pose, or a status with a reason."""

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.core.extent import EQUAL, LEAST_EXTENT, at_one_place
from solvers.core.validate import LARGEST
from solvers.verify import usual_reach

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

SHAPE = np.random.default_rng(0).standard_normal((30, 2))
TRUTH = Pose.from_angle(0.1, (0.1, -0.05))


def power(exponent):
    """The power of two nearest to a power of ten: in such a unit every coordinate keeps the same digits."""
    return 2.0 ** round(exponent / np.log10(2.0))


def in_unit(method, unit):
    """A cloud registered to a moved copy of itself, in this unit."""
    return register(unit * SHAPE, unit * TRUTH(SHAPE), method, max_steps=20)


@pytest.mark.parametrize("method", METHODS)
def test_the_pose_or_the_reason(method):
    """From 1e-129 to 1e149 the pose is that in unit scale. In narrower clouds squares lose their digits, so they are
    degenerate for methods that need squares."""
    plain = in_unit(method, 1.0)
    assert plain.status != Status.DEGENERATE
    narrow = (-131, -140, -150, -156, -162, -200, -300)
    copes = METHODS[method].any_extent
    for exponent in (*narrow, -129, -60, 60, 140, 149) if copes else (-129, -60, 60, 140, 149):
        unit = power(exponent)
        result = in_unit(method, unit)
        assert result.status == plain.status
        np.testing.assert_allclose(result.pose.R, plain.pose.R, atol=1e-6)
        np.testing.assert_allclose(result.pose.t / unit, plain.pose.t, atol=1e-6)
    for exponent in () if copes else narrow:
        failure = in_unit(method, power(exponent))
        assert failure.status == Status.DEGENERATE
        assert failure.reason.startswith("both clouds are less than 1e-130 u wide: multiply")
        assert failure.steps == 0
        assert np.array_equal(failure.matrix, np.eye(3))


@pytest.mark.parametrize("unit", [1e151, 1e200, 1e300])
def test_larger_is_refused(unit):
    assert LARGEST == 1e150
    with pytest.raises(ValueError, match=r"^source: beyond 1e\+150 squares overflow"):
        register(unit * SHAPE, unit * SHAPE)


def test_a_narrow_problem_leaves_its_batch_alone():
    """Beside a problem of width 1e-200 the others come out as if alone. A narrow source on a wide target is fine."""
    units = np.array([1.0, 1e-200, 3.0])[:, None, None]
    batch = register(units * SHAPE, units * TRUTH(SHAPE))
    assert batch.converged.tolist() == [True, False, True]
    assert np.array_equal(batch.matrix[0], register(SHAPE, TRUTH(SHAPE)).matrix)
    small = register(0.5 * LEAST_EXTENT * SHAPE, SHAPE, "similarity")
    assert small.status == Status.CONVERGED
    assert small.pose.scale == pytest.approx(2.0 / LEAST_EXTENT)


@pytest.mark.parametrize("method", METHODS)
def test_one_point_and_equal_points_are_degenerate(method):
    """For clouds that determine no rotation, every method reports a degenerate result and gives a reason."""
    for n in (1, 6):
        result = register(np.full((n, 2), 3.5), np.ones((n, 2)), method)
        assert result.status == Status.DEGENERATE
        assert result.reason
        assert np.isfinite(result.matrix).all()


PLACE = np.full((12, 2), (0.3, 0.1))
CLOUD = np.random.default_rng(0).standard_normal((12, 2))


@pytest.mark.parametrize("max_steps", [None, 0, 3])
@pytest.mark.parametrize("method", METHODS)
def test_points_at_one_place_leave_the_rotation_open_whatever_the_method(method, max_steps):
    """A source or target whose points are equal up to rounding, one or many, near the other cloud or on it, gives a
    degenerate result with a reason, and never counts as converged."""
    spot = PLACE * (1.0 + 2.0**-52 * np.random.default_rng(1).integers(-1, 2, PLACE.shape))
    pairs = [(PLACE, CLOUD), (CLOUD, PLACE), (spot, CLOUD), (CLOUD, spot), (PLACE, PLACE + 0.3), (PLACE, PLACE)]
    if not METHODS[method].paired:
        pairs += [(PLACE[:1], CLOUD), (CLOUD, PLACE[:1])]
    for source, target in pairs:
        result = register(source, target, method, start=Pose.from_angle(0.4, (0.1, 0.2)), max_steps=max_steps)
        assert result.status is Status.DEGENERATE
        assert result.reason
        assert not result
        assert np.isfinite(result.pose.matrix).all()


@pytest.mark.parametrize("unit", [2.0**-1000, 2.0**-30, 1.0, 2.0**400])
def test_what_lies_at_one_place_has_no_unit_and_no_origin(unit):
    """Points that only rounding separates lie at one place; a cloud a thousand times wider than rounding does not,
    however far from the origin it is."""
    for origin in (0.0, 1.0, 1e9):
        spot = unit * (origin + 0.3 + 2.0**-52 * (origin + 0.3) * np.array([[0.0, 1.0], [-1.0, 0.0], [1.0, 2.0]]))
        cloud = unit * (origin + 1e3 * 2.0**-52 * (origin + 1.0) * CLOUD)
        assert at_one_place(spot)
        assert not at_one_place(cloud)
        assert at_one_place(np.stack([spot, cloud[:3]])[None]).tolist() == [[True, False]]
        assert usual_reach(spot) == 1.0


@pytest.mark.parametrize("method", ["branch-and-bound", "correlative", "flow", "flow-from-source"])
def test_who_looks_for_equal_points_at_the_start_says_so_in_the_same_words(method):
    """Methods that check for equal points at the start give the same reason; a cloud a millimetre wide, ten thousand
    kilometres from the origin, still has a shape."""
    assert register(PLACE, CLOUD, method).reason == EQUAL.format("source")
    assert register(CLOUD, PLACE, method).reason == EQUAL.format("target")
    small = 1e7 + 1e-3 * np.stack([CLOUD, CLOUD])
    assert register(*small, method, max_steps=1).status != Status.DEGENERATE


@pytest.mark.parametrize("method", ["gicp", "filterreg", "mmd", "ndt", "icp", "cpd-rigid"])
def test_points_at_one_place_leave_the_rest_of_their_batch_alone(method):
    source, target = np.stack([CLOUD, PLACE, CLOUD, CLOUD]), np.stack([TRUTH(CLOUD), CLOUD, PLACE, CLOUD])
    batch = register(source, target, method)
    assert (batch.status == Status.DEGENERATE)[[1, 2]].all()
    for k in (0, 3):
        alone = register(source[k], target[k], method)
        assert (batch[k].status, batch[k].reason, batch[k].steps) == (alone.status, alone.reason, alone.steps)
        assert np.array_equal(batch[k].pose.matrix, alone.pose.matrix)
