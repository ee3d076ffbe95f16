"""A covariance: its quantiles, frames and regions, its free directions, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose, register
from solvers.geometry.rigid import fit_planar
from solvers.posegraph import Edges, chi_squared, residuals
from solvers.scenes.walls import single_wall
from solvers.uncertainty import Covariance, adjoint, covariance, exp, from_matrix, quantile, spread_of


def random_covariance(seed: int, mean: Pose | None = None, **more) -> Covariance:
    half = np.random.default_rng(seed).standard_normal((3, 3)) * 0.1
    mean = Pose.from_angle(0.8, (3.0, -1.0)) if mean is None else mean
    return from_matrix(half @ half.T, mean, centre=(0.5, 2.0), radius=2.5, **more)


@pytest.mark.parametrize(("freedom", "level", "table"), [
    (1, 0.95, 3.8414588), (2, 0.95, 5.9914645), (3, 0.95, 7.8147279), (3, 0.5, 2.3659739), (3, 0.99, 11.3448667),
])  # fmt: skip
def test_quantiles_are_those_of_the_tables(freedom, level, table):
    """Abramowitz & Stegun, table 26.8."""
    assert quantile(level, freedom) == pytest.approx(table, abs=2e-7)


@pytest.mark.parametrize(("freedom", "upper"), [(1, 51.0303356674973), (2, 55.4517744447956), (3, 59.1126508997502)])
def test_quantiles_keep_their_digits_at_the_ends(freedom, upper):
    """A rare event's, 2⁻⁴⁰, as scipy 1.17 gives it; near 0, the first term of the series (A&S 26.4.6)."""
    assert quantile(1.0 - 2.0**-40, freedom) == pytest.approx(upper, rel=1e-13)
    level = 1e-30
    first = {1: 0.5 * np.pi * level**2, 2: 2.0 * level, 3: (3.0 * level * np.sqrt(0.5 * np.pi)) ** (2.0 / 3.0)}
    assert quantile(level, freedom) == pytest.approx(first[freedom], rel=1e-12)


def test_a_quantile_holds_its_share_of_normal_draws():
    z = np.random.default_rng(3).standard_normal((200_000, 3))
    for freedom in (1, 2, 3):
        share = np.mean(np.square(z[:, :freedom]).sum(axis=1) <= quantile(0.9, freedom))
        assert share == pytest.approx(0.9, abs=4.0 * np.sqrt(0.09 / len(z)))


@given(st.integers(0, 2**31 - 1))
def test_the_matrix_comes_back(seed):
    half = np.random.default_rng(seed).standard_normal((3, 3))
    S = half @ half.T
    spread = from_matrix(S, Pose.from_angle(1.0, (2.0, 3.0)), centre=(4.0, -5.0), radius=1.7)
    np.testing.assert_allclose(spread.matrix, S, atol=1e-9 * np.abs(S).max() * 50)
    assert (np.diff(spread.deviations) <= 0.0).all()


@given(st.integers(0, 2**31 - 1))
def test_the_frame_changes_by_the_adjoint_and_the_regions_stay(seed):
    """For random covariances and poses: the matrix becomes Ad Σ Adᵀ and converts back; distances of poses are
    unchanged."""
    spread = random_covariance(seed)
    in_source = spread.to("source")
    A = adjoint(spread.mean.inverse())
    np.testing.assert_allclose(in_source.matrix, A @ spread.matrix @ A.T, rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(in_source.to("target").matrix, spread.matrix, rtol=1e-9, atol=1e-12)
    pose = spread.sample(1, seed=seed % 1000)[0]
    assert in_source.distance(pose) == pytest.approx(spread.distance(pose), rel=1e-6)


def test_information_is_the_inverse():
    spread = random_covariance(4)
    np.testing.assert_allclose(spread.information @ spread.matrix, np.eye(3), atol=1e-8)


def test_other_units_change_lengths_and_nothing_else():
    half = np.random.default_rng(5).standard_normal((3, 3)) * 0.01
    S, km = half @ half.T, np.diag([1.0, 1e3, 1e3])
    spread = from_matrix(S, Pose.from_angle(0.3, (1.0, 2.0)), centre=(1.0, 1.0), radius=2.0)
    in_metres = from_matrix(km @ S @ km, Pose.from_angle(0.3, (1e3, 2e3)), centre=(1e3, 1e3), radius=2e3)
    np.testing.assert_allclose(in_metres.deviations, 1e3 * spread.deviations, rtol=1e-6)
    moved = exp([0.01, 0.02, 0.0]).compose(spread.mean)
    assert in_metres.distance(Pose(moved.R, 1e3 * moved.t)) == pytest.approx(spread.distance(moved), rel=1e-6)


def test_draws_lie_in_the_region_as_often_as_it_says():
    spread = random_covariance(6)
    for region in (spread, spread.to("source")):
        inside = region.covers(region.sample(20_000, seed=1), 0.8)
        assert inside.mean() == pytest.approx(0.8, abs=4.0 * np.sqrt(0.16 / 20_000))


def test_the_ellipse_holds_the_share_of_the_places_where_a_point_lands():
    cov = from_matrix(np.diag([0.02, 0.05, 0.01]) ** 2, Pose.from_angle(0.4, (1.0, 0.5)), centre=(0.0, 1.0), radius=2.0)
    landings = cov.sample(20_000, seed=2).apply([[2.0, 0.0]])[:, 0]
    curve = cov.ellipse(0.7, (2.0, 0.0))
    assert np.allclose(curve[0], curve[-1])
    inside = np.array([_within(curve, p) for p in landings[:4000]])
    assert inside.mean() == pytest.approx(0.7, abs=0.03)
    centre = cov.mean.apply([[2.0, 0.0]])[0]
    root = np.linalg.cholesky(cov.point_covariance((2.0, 0.0)))
    radii = np.linalg.norm(np.linalg.solve(root, (curve - centre).T), axis=0)
    np.testing.assert_allclose(radii, np.sqrt(quantile(0.7, 2)), rtol=0.05)


def _within(curve, p):
    turn = np.unwrap(np.arctan2(curve[:, 1] - p[1], curve[:, 0] - p[0]))
    return abs(turn[-1] - turn[0]) > np.pi


def test_a_spread_of_angles_bends_the_ellipse():
    spread = from_matrix(np.diag([0.5, 1e-4, 1e-4]) ** 2, Pose.from_angle(0.0, (4.0, 0.0)), radius=3.0)
    curve = spread.ellipse()
    np.testing.assert_allclose(np.linalg.norm(curve, axis=1), 4.0, atol=0.01)  # an arc about the origin
    assert np.ptp(np.arctan2(curve[:, 1], curve[:, 0])) > 2.0


def slid() -> Covariance:
    wall = single_wall(noise=0.0)
    result = register(wall.source, wall.target, "point-to-plane", start=wall.start)
    return covariance(result, "hessian", sigma=0.02)


def test_a_free_direction_is_infinite_and_named_and_never_nan():
    spread = slid()
    assert spread.free.tolist() == [True, False, False]
    assert np.isinf(spread.deviations[0])
    assert spread.words() == "the slide along (0.94, 0.33) is free"
    for array in (spread.matrix, spread.information, spread.directions, spread.deviations[1:]):
        assert np.isfinite(array).all()
    along = np.array([0.0, 8.0, 2.8])
    assert along @ spread.information @ along == pytest.approx(0.0, abs=1e-6)
    pose = exp(along).compose(spread.mean)
    assert spread.distance(pose) == pytest.approx(0.0, abs=1e-6)
    assert spread.covers(pose)
    assert not spread.covers(exp([0.0, -0.28, 0.8]).compose(spread.mean))


def test_an_infinite_region_is_drawn_only_as_far_as_is_said():
    spread = slid()
    with pytest.raises(ValueError, match=r"reach.*the slide along \(0.94, 0.33\) is free"):
        spread.ellipse()
    with pytest.raises(ValueError, match="reach"):
        spread.sample(3)
    curve = spread.ellipse(reach=1.0)
    assert np.isfinite(curve).all()
    longest = np.linalg.norm(curve - curve.mean(axis=0), axis=1).max()
    assert longest == pytest.approx(np.sqrt(quantile(0.95, 2)), rel=0.05)


def test_certainty_has_no_information_matrix():
    spread = from_matrix(np.zeros((3, 3)), Pose.identity())
    assert spread.covers(Pose.identity())
    assert not spread.covers(Pose.from_angle(1e-6))
    with pytest.raises(ValueError, match="information"):
        _ = spread.information


@pytest.mark.parametrize(("matrix", "words"), [
    (np.eye(2), "matrix"), (np.full((3, 3), np.nan), "matrix"), (-np.eye(3), "semidefinite"),
    (np.stack([np.eye(3)] * 2), "matrix: expected a shape that fits"),
    (np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), "symmetric"),
])  # fmt: skip
def test_what_is_no_covariance_is_refused(matrix, words):
    with pytest.raises(ValueError, match=words):
        from_matrix(matrix, Pose.identity())


def test_a_large_covariance_hides_no_wrong_one_beside_it():
    for wrong in (np.array([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.diag([1.0, 1.0, -1.0])):
        for matrices in ([wrong, 1e12 * np.eye(3)], [1e12 * np.eye(3), wrong]):
            with pytest.raises(ValueError, match=r"^matrix: it is not"):
                from_matrix(np.stack(matrices), Pose.identity(batch=(2,)))


def test_what_else_is_refused():
    spread = random_covariance(7)
    for wrong in (0.0, 1.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="level"):
            spread.covers(spread.mean, wrong)
    for call in (spread.distance, spread.along, spread.covers):
        with pytest.raises(ValueError, match=r"^pose: expected a Pose, got ndarray"):
            call(np.eye(3))
        with pytest.raises(ValueError, match=r"^pose: moves points in 3 dimensions"):
            call(Pose.identity(3))
    for frame in ("target", "source"):
        batch = from_matrix(np.stack([np.eye(3)] * 2), Pose.identity(batch=(2,))).to(frame)
        for call in (batch.covers, batch.distance, batch.along):
            with pytest.raises(ValueError, match=r"^pose, mean: leading axes .*: pose \(3,\), mean \(2,\)$"):
                call(Pose.identity(batch=(3,)))
    with pytest.raises(ValueError, match=r"^radius: must be positive, but the smallest is -2$"):
        from_matrix(np.eye(3), Pose.identity(), radius=-2.0)
    with pytest.raises(ValueError, match=r"^mean: expected a Pose, got ndarray"):
        from_matrix(np.eye(3), np.eye(3))
    with pytest.raises(ValueError, match=r"^poses: expected a Pose, got ndarray"):
        spread_of(np.eye(3)[None], centre=(0.0, 0.0), radius=1.0)
    with pytest.raises(ValueError, match="frame"):
        spread.to("world")
    with pytest.raises(ValueError, match="freedom"):
        quantile(0.5, 4)
    with pytest.raises(ValueError, match="rigid"):
        from_matrix(np.eye(3), Pose.from_angle(0.0, scale=2.0))
    for name, wrong in (
        *[("radius", 0.0), ("radius", -1.0), ("radius", np.nan), ("radius", [1.0, 2.0])],
        *[("centre", (0.0, np.nan)), ("centre", (0.0, 0.0, 0.0))],
    ):
        with pytest.raises(ValueError, match=f"^{name}: "):
            from_matrix(np.eye(3), Pose.identity(), **{name: wrong})
    for wrong in ((0.0, np.nan), (0.0, 0.0, 0.0), "here"):
        for tell in (spread.ellipse, spread.point_covariance):
            with pytest.raises(ValueError, match=r"^point: "):
                tell(point=wrong)
    for wrong in (3.5, 0, -1, True):
        with pytest.raises(ValueError, match=r"^count: "):
            spread.ellipse(count=wrong)
    for wrong in ("a", [[1.0, 2.0]], [1.0, 2.0, 3.0], [[1.0, 2.0, np.nan]]):
        with pytest.raises(ValueError, match=r"^along: "):
            spread.poses(wrong)
    with pytest.raises(ValueError, match=r"^pose.scale: "):
        spread.covers(Pose.from_angle(0.0, scale=5.0))


def test_a_batch_is_its_single_covariances():
    rng = np.random.default_rng(8)
    p = rng.uniform(-3.0, 3.0, (4, 9, 2))
    q = fit_planar(p[0], p[1]).pose.apply(p) + 0.05 * rng.standard_normal(p.shape)
    estimate = covariance(register(p, q, "kabsch"))
    pose = Pose.identity(batch=(4,))
    for i in range(4):
        single = covariance(register(p[i], q[i], "kabsch"))
        np.testing.assert_allclose(estimate[i].matrix, single.matrix, rtol=1e-9)
        assert estimate.distance(pose)[i] == pytest.approx(single.distance(pose[i]), rel=1e-9)
    with pytest.raises(ValueError, match="ellipse"):
        estimate.ellipse()


def test_an_index_reaches_into_the_batch_alone():
    """There are three covariances, so an index meant for the matrices' own axes would fit as well."""
    matrices = np.stack([np.diag([9.0, 4.0, 1.0]) * k for k in (1.0, 100.0, 10000.0)])
    batch = from_matrix(matrices, Pose.identity(batch=(3,)))
    for k in range(3):
        for entry in (batch[..., k], batch[k, ...], batch[(k,)]):
            assert np.array_equal(entry.matrix, batch[k].matrix)
            assert entry.mean.batch == entry.radius.shape == ()
    assert np.array_equal(batch[...].matrix, batch.matrix)
    assert batch[..., None].matrix.shape == (3, 1, 3, 3)
    with pytest.raises(IndexError):
        batch[0, 0]


@pytest.mark.parametrize("frame", ["target", "source"])
def test_an_edge_s_information_is_that_of_its_residual(frame):
    """With poses drawn from the spread as true ones, and the mean as an edge's measurement, the residuals' covariance
    is the inverse of the edge's information, and χ² is 3 on average."""
    half = 1e-3 * np.random.default_rng(9).standard_normal((3, 3))
    spread = from_matrix(half @ half.T, Pose.from_angle(1.9, (4.0, -2.0)), centre=(1.0, 2.0), radius=2.5, frame=frame)
    count = 20_000
    poses = spread.sample(count, seed=1)
    nodes = Pose.trusted(np.concatenate([np.eye(2)[None], poses.R]), np.concatenate([np.zeros((1, 2)), poses.t]))
    relative = Pose.trusted(np.tile(spread.mean.R, (count, 1, 1)), np.tile(spread.mean.t, (count, 1)))
    edges = Edges(np.zeros(count, dtype=int), np.arange(1, count + 1), relative, spread.edge_information())
    errors = residuals(nodes, edges)
    white = np.linalg.cholesky(spread.edge_information()).T @ errors.T
    np.testing.assert_allclose(white @ white.T / count, np.eye(3), atol=0.05)
    assert chi_squared(nodes, edges).mean() == pytest.approx(3.0, abs=0.1)


def test_an_edge_s_information_of_a_batch_is_that_of_its_poses():
    batch = from_matrix(np.stack([np.diag([0.01, 0.04, 0.02]) ** 2] * 2), Pose.from_angle([0.3, 2.0], [[1, 0], [0, 5]]))
    for i in (0, 1):
        np.testing.assert_allclose(batch.edge_information()[i], batch[i].edge_information(), rtol=1e-9)
    with pytest.raises(ValueError, match=r"information: the matrix of edge 0 is not positive definite; if a dir"):
        Edges([0], [1], Pose.identity(batch=(1,)), slid().edge_information())


def test_an_edge_whose_origin_is_too_far_away_says_so():
    """About the origin of a national grid in millimetres, a turn and its shifts are one motion up to rounding."""
    near = from_matrix(np.diag([1e-4, 0.2, 0.2]) ** 2, Pose.identity(), radius=2000.0)
    far = replace(near, centre=np.array([4.5e8, 5.4e9]))
    with pytest.raises(ValueError, match=r"; if the origin is far away, shift the clouds$"):
        Edges([0], [1], Pose.identity(batch=(1,)), far.edge_information())


@pytest.mark.parametrize("centre", [(0.0, 0.0), (1.3, 2.7), (5e5, -5e6)])
def test_a_pose_without_spread_covers_itself_and_nothing_else(centre):
    """Rounding does not give spread to directions without a deviation, however far the origin is."""
    mean = Pose.from_angle(0.7, (3.3, -1.7))
    sure = from_matrix(np.diag([0.05, 0.0, 0.0]) ** 2, mean, centre=centre, radius=1.7)
    assert sure.covers(mean)
    assert sure.distance(mean) < 1e-6


def test_a_deviation_of_zero_stays_zero():
    flat = from_matrix(np.diag([0.05, 0.2, 0.0]) ** 2, Pose.from_angle(0.7, (3.3, -1.7)), centre=(1.3, 2.7), radius=1.7)
    assert flat.deviations[-1] == 0.0
    with pytest.raises(ValueError, match="a deviation is zero"):
        assert flat.information is None


def test_small_quantiles_are_those_of_the_distributions_beginnings():
    """For a probability p near zero, the quantiles are π p² / 2 and 2 p, for one and two degrees of freedom."""
    p = 1e-17
    assert quantile(p, 1) == pytest.approx(0.5 * np.pi * p * p, rel=1e-6)
    assert quantile(p, 2) == pytest.approx(2.0 * p, rel=1e-12)
