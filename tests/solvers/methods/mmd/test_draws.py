"""MMD-Reg's frequencies: Laplace frequencies, redrawn for each stage, and different in number there."""

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.methods.mmd.mmd import MmdOptions
from solvers.numerics.fourier_features import mean_features, unit_frequencies
from solvers.scenes.rooms import room, room_start

LENGTHS = (2.4, 1.2, 0.6)
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


def states_of(scene, **options):
    """The states of a run over LENGTHS, including the start."""
    states = []
    register(
        scene.source, scene.target, "mmd", start=room_start(), seed=scene.seed, lengths=LENGTHS,
        callback=lambda k, state: states.append(state), **options,
    )  # fmt: skip
    return states


@pytest.mark.parametrize("d", [2, 3])
def test_the_laplace_jacobian_against_central_differences(rng, random_pose, d):
    """The residual's derivative by shift and turn, for frequencies some of which are large."""
    source, target = rng.standard_normal((25, d)) + 3.0, rng.standard_normal((30, d))
    pose = random_pose(rng, d)

    def at(R, t):
        return register(source, target, "mmd", start=Pose(R, t), max_steps=0, lengths=(1.1,), kernel="laplace", seed=5)

    result = at(pose.R, pose.t)
    J, ell, radius = result.detail("jacobian"), 1.1, result.detail("radius")
    fastest = np.linalg.norm(result.detail("frequencies"), axis=1).max()
    assert fastest > 10.0
    centre = pose.apply(source).mean(axis=0)
    planes = [(i, j) for i in range(d) for j in range(i + 1, d)]
    step = 1e-5 / fastest
    for a in range(d + len(planes)):
        values = []
        for h in (step, -step):
            R, t = np.eye(d), np.zeros(d)
            if a < d:
                t[a] = h * ell
            else:
                i, j = planes[a - d]
                angle = h * ell / radius
                R[i, i] = R[j, j] = np.cos(angle)
                R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
            values.append(at(R @ pose.R, R @ (pose.t - centre) + centre + t).detail("residual"))
        assert np.allclose((values[0] - values[1]) / (2.0 * step), J[:, a], atol=1e-8 * fastest)


def test_every_stage_draws_anew_where_it_is_told_to():
    """With `redraw` each stage has its own frequencies, the first those of the single draw, and the means are computed
    with them; without it, one draw serves all stages."""
    scene = room("combo", seed=53)
    for kernel in ("gaussian", "laplace", "cauchy"):
        for redraw in (False, True):
            states = states_of(scene, redraw=redraw, kernel=kernel)
            assert [float(s.length[0]) for s in states] == sorted((float(s.length[0]) for s in states), reverse=True)
            stages = {int(s.stage[0]): s for s in states}
            assert sorted(stages) == [0, 1, 2]
            for k, state in stages.items():
                z = unit_frequencies(np.array([scene.seed]), 32, 2, kernel, k if redraw else 0)
                assert np.array_equal(state.frequencies, z)
                w = z / LENGTHS[k]
                assert np.allclose(state.moving_mean, mean_features(state.pose.apply(scene.source), w), atol=1e-11)
                assert np.allclose(state.fixed_mean, mean_features(scene.target[None], w), atol=1e-11)


@pytest.mark.parametrize("redraw", [False, True])
def test_a_stage_has_as_many_frequencies_as_it_is_told(redraw):
    """Counts 8, 32, 16: each stage's features, objective and steps are those of a run with just that many."""
    scene, counts = room("combo", seed=66), (8, 32, 16)
    states = states_of(scene, redraw=redraw, count=counts)
    for k, count in enumerate(counts):
        of_stage = [s for s in states if s.stage[0] == k]
        z = unit_frequencies(np.array([scene.seed]), 32, 2, draw=k if redraw else 0)[:, :count]
        for state in of_stage:
            assert np.array_equal(state.frequencies[:, :count], z)
            assert not state.frequencies[:, count:].any()
            gap = mean_features(state.pose.apply(scene.source), z / LENGTHS[k])
            gap -= mean_features(scene.target[None], z / LENGTHS[k])
            assert state.objective[0] == pytest.approx(np.square(gap).sum(), abs=1e-14)
            assert np.allclose(state.residual.reshape(2, 32)[:, :count].ravel(), gap[0], atol=1e-12)
            assert not state.residual.reshape(2, 32)[:, count:].any()
            assert not state.jacobian.reshape(2, 32, 3)[:, count:].any()
    alone = states_of(scene, count=8)
    first = [s for s in states if s.stage[0] == 0]
    for state, expected in zip(first, alone, strict=False):
        assert np.allclose(state.pose.matrix, expected.pose.matrix, atol=1e-10)
        assert state.objective[0] == pytest.approx(expected.objective[0], rel=1e-9)


def test_alike_counts_are_one_count():
    """(32, 32, 32) equals 32, bit for bit; the default draws the same frequencies as ever."""
    scene = room("noise", seed=40)
    plain, several = (states_of(scene, count=c)[-1] for c in (32, (32, 32, 32)))
    assert np.array_equal(plain.pose.matrix, several.pose.matrix)
    assert np.array_equal(plain.frequencies[0], np.random.default_rng(40).standard_normal((32, 2)))


@pytest.mark.parametrize(
    ("degrees", "shift", "options"),
    [
        (10.0, 0.2, {"redraw": True}),
        (10.0, 0.2, {"kernel": "cauchy"}),
        (10.0, 0.2, {"redraw": True, "count": (8, 16, 32)}),
        (0.01, 0.001, {"kernel": "laplace"}),
    ],
)
def test_the_options_register_a_cloud_with_itself(degrees, shift, options, rng):
    """A cloud ends on itself, in the plane and in space, in a batch and alone. Laplace waves need a start closer than
    their shortest wavelength."""
    for d in (2, 3):
        target = rng.standard_normal((2, 80, d)) * ([3.0, 1.0, 2.0][:d])
        rotation = np.eye(d)
        rotation[:2, :2] = Pose.from_angle(np.radians(degrees)).R
        arguments = dict(start=Pose(rotation, np.full(d, shift)), lengths=LENGTHS, seed=1, **options)
        result = register(target, target, "mmd", **arguments)
        assert all(s in (Status.CONVERGED, Status.STALLED) for s in result.status)
        assert np.abs(result.pose.apply(target) - target).max() < 1e-3
        alone = register(target[1], target[1], "mmd", **arguments)
        assert np.abs(alone.pose.matrix - result.pose.matrix[1]).max() < 1e-9


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("kernel", {"kernel": "box"}),
        ("redraw", {"redraw": 1}),
        ("count", {"count": (32, 32)}),
        ("count", {"count": (8, 8), "lengths": (1.0, 0.5, 0.2)}),
        ("count", {"count": (8, 0), "lengths": (1.0, 0.5)}),
        ("count", {"count": ()}),
    ],
)
def test_wrong_options_are_named(name, options):
    with pytest.raises(ValueError, match=rf"^{name}: "):
        MmdOptions(**options)


@pytest.mark.parametrize("units", [(1e149, 1e-160), (1e-160, 1e149), (1e140, 1.0), (1.0, 1e-160)])
def test_a_phase_that_is_no_number_says_nothing(units):
    """For a source so many wavelengths wide that float64 cannot hold its phases, the run is degenerate, without error
    or warning."""
    cloud = np.random.default_rng(0).standard_normal((20, 2))
    result = register(units[0] * cloud, units[1] * cloud, "mmd")
    assert result.status is Status.DEGENERATE
    assert np.isfinite(result.pose.matrix).all()
