"""NDT with an outlier share: its two constants, derivatives against differences, and its effect on a score."""

from dataclasses import replace

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, register
from solvers.methods.ndt import d2d_score, ndt, ndt_map
from solvers.methods.ndt.mixture import constants
from solvers.methods.ndt.score import evaluate, score_map
from solvers.metrics import rre, rte
from solvers.scenes.rooms import room, room_start

SHARES = (0.05, 0.55, 0.9)
pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("share", [5e-324, 1e-310, 5e-308])
def test_the_smallest_share_of_all_has_constants(share):
    """The ratio of the densities overflows; its logarithm does not."""
    gain, sharpness = constants(share)
    log_ratio = float(np.log(10.0) - np.log(share))
    assert gain == pytest.approx(log_ratio, rel=1e-12)
    assert sharpness == pytest.approx(-2.0 * np.log1p(-0.5 / log_ratio), rel=1e-9)


@pytest.mark.parametrize("share", SHARES)
def test_the_gaussian_meets_the_mixtures_logarithm_at_three_places(share):
    """d₁ exp(−½ d₂ e) + d₃ equals −log(c₁ exp(−½ e) + c₂) at e = 0, at e = 1 and far away, and falls in between; −d₁
    and d₂ are positive, and eq. 6.8 with c₁ = 10 (1 − p), c₂ = p gives the same two numbers."""
    gain, sharpness = constants(share)
    c1, c2 = 10.0 * (1.0 - share), share
    for e in (0.0, 1.0, 2000.0):
        expected = -np.log(c1 * np.exp(-0.5 * e) + c2)
        assert -gain * np.exp(-0.5 * sharpness * e) - np.log(c2) == pytest.approx(expected, abs=1e-9)
    d3 = -np.log(c2)
    d1 = -np.log(c1 + c2) - d3
    d2 = -2.0 * np.log((-np.log(c1 * np.exp(-0.5) + c2) - d3) / d1)
    assert (gain, sharpness) == (pytest.approx(-d1), pytest.approx(d2))
    assert gain > 0.0
    assert 0.0 < sharpness < 1.0


def test_the_plain_score_is_the_limit_of_all_outliers():
    """d₂ rises with the share, up to one. As the share goes to zero, so does d₂, and −d₁ d₂ goes to one: squared
    distances."""
    shares = np.array([1e-300, 1e-9, 0.01, 0.1, 0.3, 0.55, 0.8, 0.99, 1.0 - 1e-9])
    gains, sharpnesses = np.array([constants(p) for p in shares]).T
    assert np.all(np.diff(sharpnesses) > 0.0)
    assert sharpnesses[-1] == pytest.approx(1.0, abs=1e-7)
    assert sharpnesses[0] < 2e-3
    assert gains[0] * sharpnesses[0] == pytest.approx(1.0, abs=2e-3)
    assert constants(None) == (1.0, 1.0)


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("grids", [1, 4])
def test_the_score_is_that_of_wider_cells(share, grids):
    """It is −d₁ times the plain score of cells whose covariances are divided by d₂, with its derivatives; a map of
    translations has the same score."""
    scene = room("combo", seed=53)
    cells = ndt_map.build(scene.target[None], 1.2, grids=grids)
    gain, sharpness = constants(share)
    wide = replace(cells, precision=sharpness * cells.precision)
    points, pivot = scene.source + np.array([0.2, -0.1]), np.array([[0.3, 0.4]])
    result, plain = evaluate(cells, points[None], pivot, outliers=share), evaluate(wide, points[None], pivot)
    for name in ("score", "gradient", "hessian", "values"):
        assert np.allclose(getattr(result, name), gain * getattr(plain, name), rtol=1e-12, atol=1e-12)
    grid = score_map(cells, scene.source, np.array([0.2, 0.5]), np.array([-0.1]), outliers=share)
    assert grid[0, 0] == pytest.approx(result.score[0], rel=1e-12)


@pytest.mark.parametrize("share", SHARES)
def test_derivatives_agree_with_differences(rng, share):
    """Gradient and Hessian by (tx, ty, φ) for points in cells, against central differences where no point changes its
    cell."""
    scene, h, count = room("combo"), 2e-6, 0
    cells = ndt_map.build(scene.target[None], 1.2, grids=4)
    while count < 6:
        pose = Pose.from_angle(rng.uniform(-0.4, 0.4), rng.uniform(-0.8, 0.8, 2))
        pivot, points = pose.apply(scene.source).mean(axis=0), scene.source[rng.permutation(len(scene.source))[:25]]

        def score(step, pose=pose, pivot=pivot, points=points):
            neighbour = ndt.moved_by(Pose(pose.R[None], pose.t[None]), np.asarray(step)[None], pivot[None])[0]
            return evaluate(cells, neighbour.apply(points)[None], (pivot + step[:2])[None], outliers=share)

        result = score(np.zeros(3))
        pairs = [(score(s), score(-s)) for s in h * np.eye(3)]
        if not all(np.array_equal(result.cells, x.cells) for pair in pairs for x in pair):
            continue
        count += 1
        gradient = np.array([-(a.score[0] - b.score[0]) / (2 * h) for a, b in pairs])
        hessian = np.array([(a.gradient[0] - b.gradient[0]) / (2 * h) for a, b in pairs])
        np.testing.assert_allclose(result.gradient[0], gradient, atol=1e-7 * np.abs(gradient).max())
        np.testing.assert_allclose(result.hessian[0], hessian, atol=1e-6 * np.abs(hessian).max())


@pytest.mark.parametrize("share", SHARES)
def test_cells_against_cells(rng, share):
    """The sum over all pairs of cells with both constants, against a plain double loop, and its derivatives against
    differences."""
    clouds = rng.normal(0.0, 1.0, (2, 1, 80, 2))
    source, target = ndt_map.build(clouds[0], 0.9), ndt_map.build(clouds[1], 1.1, grids=4)
    pose = Pose.from_angle([0.7], [[0.3, 0.1]])
    gain, sharpness = constants(share)
    total = 0.0
    for i in np.flatnonzero(source.kept[0]):
        for j in np.flatnonzero(target.kept[0]):
            S, Q = (np.linalg.inv(m.precision[0, c]) for m, c in ((source, i), (target, j)))
            q = pose.R[0] @ source.mean[0, i] + pose.t[0] - target.mean[0, j]
            e = q @ np.linalg.solve(pose.R[0] @ S @ pose.R[0].T + Q, q)
            total += gain * np.exp(-0.5 * sharpness * e)

    def at(step):
        neighbour = ndt.moved_by(pose, np.asarray(step)[None], pose.t)
        return d2d_score.evaluate(source, target, neighbour, pose.t + step[:2], outliers=share)

    h, result = 1e-5, at(np.zeros(3))
    assert result.score[0] == pytest.approx(total, rel=1e-11)
    pairs = [(at(s), at(-s)) for s in h * np.eye(3)]
    gradient = np.array([-(a.score[0] - b.score[0]) / (2 * h) for a, b in pairs])
    hessian = np.array([(a.gradient[0] - b.gradient[0]) / (2 * h) for a, b in pairs])
    np.testing.assert_allclose(result.gradient[0], gradient, rtol=1e-6, atol=1e-7 * np.abs(gradient).max())
    np.testing.assert_allclose(result.hessian[0], hessian, rtol=1e-6, atol=1e-7 * np.abs(hessian).max())


@pytest.mark.parametrize("method", ["ndt", "ndt-d2d"])
def test_the_run_with_a_share_finds_the_room_in_any_unit(method):
    """From 10° and 0.3 u, the usual implementation's share finds the clean room in units, milliunits and kilounits."""
    scene, start = room("clean", seed=40), room_start(10.0, 0.3)
    ends = []
    for unit in (1e-3, 1.0, 1e3):
        result = register(
            unit * scene.source, unit * scene.target, method, start=Pose(start.R, unit * start.t),
            cells=(2.4 * unit, 1.2 * unit), outliers=0.55,
        )  # fmt: skip
        assert result.status in (Status.CONVERGED, Status.STALLED)
        assert np.degrees(rre(result.pose, scene.truth)) < 2.0
        assert rte(result.pose, scene.truth) < 0.2 * unit
        ends.append(np.append(result.pose.t / unit, float(result.pose.angle)))
    assert np.abs(np.array(ends) - ends[1]).max() < 1e-6


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, float("nan"), "half", True])
def test_a_share_is_between_nothing_and_all(share):
    for method in ("ndt", "ndt-d2d"):
        with pytest.raises(ValueError, match=r"^outliers: "):
            METHODS[method].options(outliers=share)


@pytest.mark.parametrize("share", [0.0, 1.0, 2.0, -1.0, "half"])
def test_the_score_takes_a_share_between_nothing_and_all(share):
    scene = room("clean")
    cells = ndt_map.build(scene.target[None], 0.8)
    with pytest.raises(ValueError, match=r"^outliers: expected a "):
        evaluate(cells, scene.source[None], np.zeros((1, 2)), outliers=share)
    with pytest.raises(ValueError, match=r"^outliers: expected a "):
        score_map(cells, scene.source, np.zeros(1), np.zeros(1), outliers=share)
