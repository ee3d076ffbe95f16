"""Coherent point drift against its definition: likelihood, variance, both clutter conventions, large motions."""

import numpy as np
import pytest

from solvers import METHODS, Pose, Status, metrics, register
from solvers.core.method import Problem
from solvers.core.stepper import advance, begin
from solvers.methods.soft.cpd import FLOOR, STAGES, CpdOptions, responsibilities, stages
from solvers.scenes.rooms import room
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

BOTH = ["cpd-rigid", "cpd-similarity"]


def fish(count, phase=0.0):
    """A closed curve without symmetry."""
    f = 2.0 * np.pi * (np.arange(count) + phase) / count
    return np.column_stack([2.0 * np.cos(f) + 0.5 * np.cos(3.0 * f), 1.2 * np.sin(f) + 0.3 * np.sin(2.0 * f)])


def problem(source, target, start=None):
    source, target = np.atleast_3d(source.T).T, np.atleast_3d(target.T).T
    b, m, d = source.shape
    pose = start or Pose.identity(d, (b,))
    return Problem(source, target, np.ones((b, m)), pose, np.zeros(b, dtype=np.int64))


def scene(rng, random_pose, d, m=30, n=40):
    source = rng.standard_normal((1, m, d)) * np.arange(1.0, d + 1.0)
    target = np.concatenate([source[:, : n - 15] + 0.1 * rng.standard_normal((1, min(m, n - 15), d))], axis=1)
    target = np.concatenate([target, 2.0 * rng.standard_normal((1, n - target.shape[1], d))], axis=1)
    return problem(source, random_pose(rng, d, (1,)).apply(target))


def square_or_cube(x):
    """The area or volume that evenly spread points with the RMS radius of the points (n, d) would fill."""
    d = x.shape[1]
    return (np.sqrt(12.0 / d) * np.sqrt(np.square(x - x.mean(axis=0)).sum(axis=1).mean())) ** d


def naive(x, z, sigma, w, volume):
    """From the definition, one problem: responsibilities (m, n), −log p of the fixed points, and squared distances."""
    d, m = x.shape[1], len(z)
    squares = np.square(x[None] - z[:, None]).sum(axis=2)
    K = np.exp(-squares / (2.0 * sigma**2))
    c = (2.0 * np.pi * sigma**2) ** (d / 2) * w * m / ((1.0 - w) * volume)
    density = w / volume + (1.0 - w) / m * (K / (2.0 * np.pi * sigma**2) ** (d / 2)).sum(axis=0)
    return K / (K.sum(axis=0) + c), -np.log(density).sum(), squares


@pytest.mark.parametrize("method", BOTH)
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("volume", [None, 7.0])
def test_every_state_is_what_the_definition_says(rng, random_pose, method, d, volume):
    """Responsibilities, their sums and the likelihood along a run agree with sums over the whole matrix."""
    p = scene(rng, random_pose, d)
    batch = begin(METHODS[method], p, CpdOptions(clutter=0.2, volume=volume))
    for _ in range(8):
        state, pose = batch.state(), batch.pose()
        P, objective, _ = naive(
            p.target[0], pose.apply(p.source)[0], state.sigma[0], 0.2, volume or square_or_cube(p.target[0])
        )
        np.testing.assert_allclose(responsibilities(state), P, rtol=1e-9, atol=1e-13)
        np.testing.assert_allclose(state.column[0], P.sum(axis=1), rtol=1e-9, atol=1e-13)
        np.testing.assert_allclose(state.row[0], P.sum(axis=0), rtol=1e-9, atol=1e-13)
        np.testing.assert_allclose(state.mass[0], P.sum(), rtol=1e-9)
        np.testing.assert_allclose(state.objective[0], objective, rtol=1e-9)
        after = advance(batch)
        # The step's variance comes from the weighted residuals at the new pose, whatever the scale.
        moved = after.pose().apply(p.source)[0]
        residual = (P * np.square(p.target[0][None] - moved[:, None]).sum(axis=2)).sum()
        np.testing.assert_allclose(after.state().sigma[0] ** 2, residual / (P.sum() * d), rtol=1e-9)
        batch = after


def test_the_first_sigma_is_that_of_all_pairs(rng, random_pose):
    p = scene(rng, random_pose, 3)
    state = begin(METHODS["cpd-rigid"], p).state()
    _, _, squares = naive(p.target[0], p.source[0], 1.0, 0.1, 1.0)
    np.testing.assert_allclose(state.sigma[0] ** 2, squares.mean() / 3.0, rtol=1e-12)


@pytest.mark.parametrize("method", BOTH)
def test_a_step_is_the_papers(rng, random_pose, method):
    """One M-step against figure 2 of the paper, in its letters and traces, in 2-D and 3-D, from a large motion: the
    rotation is neither transposed nor composed the wrong way round."""
    for d in (2, 3):
        p = scene(rng, random_pose, d)
        batch = begin(METHODS[method], p, CpdOptions(volume=float(p.target.shape[1])))
        X, Y, sigma = p.target[0], p.source[0], batch.state().sigma[0]
        P, _, _ = naive(X, Y, sigma, 0.1, len(X))
        NP, one_n, one_m = P.sum(), np.ones(len(X)), np.ones(len(Y))
        mx, my = X.T @ P.T @ one_m / NP, Y.T @ P @ one_n / NP
        Xh, Yh = X - mx, Y - my
        A = Xh.T @ P.T @ Yh
        U, _, Vt = np.linalg.svd(A)
        C = np.diag([1.0] * (d - 1) + [np.linalg.det(U @ Vt)])
        R = U @ C @ Vt
        yy, xx = np.trace(Yh.T @ np.diag(P @ one_n) @ Yh), np.trace(Xh.T @ np.diag(P.T @ one_m) @ Xh)
        s = np.trace(A.T @ R) / yy if method == "cpd-similarity" else 1.0
        variance = (xx - 2.0 * s * np.trace(A.T @ R) + s * s * yy) / (NP * d)
        state = advance(batch).state()
        np.testing.assert_allclose(state.pose.R[0], R, atol=1e-11)
        np.testing.assert_allclose(state.pose.scale[0], s, rtol=1e-11)
        np.testing.assert_allclose(state.pose.t[0], mx - s * R @ my, atol=1e-10)
        np.testing.assert_allclose(state.sigma[0] ** 2, variance, rtol=1e-10)
        if method == "cpd-similarity":
            np.testing.assert_allclose(variance, (xx - s * np.trace(A.T @ R)) / (NP * d), rtol=1e-10)
        else:
            # Well-known packages get this wrong: for a fixed scale the trace counts twice.
            assert abs((xx - np.trace(A.T @ R)) / (NP * d) / variance - 1.0) > 0.1


@pytest.mark.parametrize("method", BOTH)
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("options", [{"clutter": 0.0}, {"clutter": 0.3}, {"clutter": 0.3, "volume": 12.0}])
def test_the_likelihood_never_falls(rng, random_pose, method, d, options):
    """Each step is an exact EM step, so the negative log-likelihood never rises: 40 random scenes, far starts, both
    clutter conventions and no clutter."""
    source = rng.standard_normal((40, 15, d)) * np.arange(1.0, d + 1.0)
    target = random_pose(rng, d, (40,)).apply(source[:, :12]) + 0.2 * rng.standard_normal((40, 12, d))
    target[:, :3] = 4.0 * rng.standard_normal((40, 3, d))
    result = register(source, target, method, start=random_pose(rng, d, (40,)), max_steps=60, **options)
    E = result.history.objective
    assert np.all(np.diff(E, axis=0) <= 1e-9 * (1.0 + np.abs(E[1:])))
    assert np.all(E[-1] < E[0] - 1.0)


def test_sigma_need_not_fall():
    """σ is estimated, not scheduled: if it is too small at the start, it grows first."""
    result = register(fish(60), fish(60) + 1.0, "cpd-rigid", sigma=0.1, max_steps=3)
    widths = []
    register(fish(60), fish(60) + 1.0, "cpd-rigid", sigma=0.1, callback=lambda k, state: widths.append(state.sigma[0]))
    assert widths[0] > 0.15
    assert widths[-1] < 0.1
    assert np.all(np.diff(result.history.objective) <= 0.0)


def test_both_clutter_conventions_agree_at_v_equal_n():
    """A clutter density of 1/V with V = N is the paper's w/N; another V, such as the default one from the cloud's
    radius, gives another answer."""
    source, target = room("outliers").source, room("outliers").target
    n, square = float(len(target)), float(square_or_cube(target))
    state = begin(METHODS["cpd-rigid"], problem(source, target), CpdOptions(clutter=0.2, volume=n)).state()
    K = np.exp(-np.square(target[None] - source[:, None]).sum(axis=2) / (2.0 * state.sigma[0] ** 2))
    clutter = 2.0 * np.pi * state.sigma[0] ** 2 * 0.2 / 0.8 * len(source) / n  # fig. 2 of the paper
    np.testing.assert_allclose(responsibilities(state), K / (K.sum(axis=0) + clutter), rtol=1e-9)
    paper = register(source, target, "cpd-rigid", clutter=0.2, volume=n)
    own = register(source, target, "cpd-rigid", clutter=0.2)
    result = register(source, target, "cpd-rigid", clutter=0.2, volume=square)
    np.testing.assert_allclose(own.matrix, result.matrix, atol=1e-9)
    assert np.abs(own.matrix - paper.matrix).max() > 1e-6


@pytest.mark.parametrize("method", BOTH)
def test_clean_data_keep_a_positive_variance(method):
    """On equal clouds the variance falls to its floor and stays there."""
    points = fish(80) + 50.0
    result = register(points, points, method, clutter=0.0, max_steps=200)
    radius = np.sqrt(np.square(points - points.mean(axis=0)).sum(axis=1).mean())
    assert result.detail("sigma") == pytest.approx(FLOOR * radius, rel=1e-9)
    assert result.status == Status.CONVERGED
    assert "floor" in result.reason
    np.testing.assert_allclose(result.matrix, np.eye(3), atol=1e-9)


def test_the_trace_form_of_the_variance_falls_below_zero(rng):
    """Why the variance is summed from residuals: on exact data the difference of traces is rounding of either sign."""
    values = []
    for _ in range(50):
        Y = rng.standard_normal((30, 2))
        X = Pose.from_angle(1.0, (0.5, -2.0)).apply(Y)
        Xh, Yh = X - X.mean(axis=0), Y - Y.mean(axis=0)
        U, _, Vt = np.linalg.svd(Xh.T @ Yh)
        values.append(np.square(Xh).sum() - 2.0 * np.trace((Xh.T @ Yh).T @ (U @ Vt)) + np.square(Yh).sum())
    assert -1e-12 < min(values) < 0.0 < max(values) < 1e-12
    result = register(Y, X, "cpd-rigid", start=Pose.from_angle(0.95, (0.5, -2.0)), sigma=0.1, clutter=0.0)
    assert result.detail("sigma") > 0.0
    np.testing.assert_allclose(result.transform(Y), X, atol=1e-6)


@pytest.mark.parametrize("degrees", [-170.0, -100.0, 60.0, 150.0])
def test_large_motions_are_found_from_near_them(degrees):
    """Rotation, translation and scale of a large motion, from a start 20° off: exact if the clouds match exactly."""
    truth = Pose.from_angle(np.radians(degrees), (3.0, -2.0), 0.85)
    start = Pose.from_angle(np.radians(degrees + 20.0), (2.6, -1.8))
    target = truth.apply(fish(100))
    result = register(fish(100), target, "cpd-similarity", start=start)
    np.testing.assert_allclose(result.matrix, truth.matrix, atol=1e-6)
    rigid = Pose(truth.R, truth.t)
    result = register(fish(100), rigid.apply(fish(100)), "cpd-rigid", start=start)
    np.testing.assert_allclose(result.matrix, rigid.matrix, atol=1e-6)
    np.testing.assert_allclose(result.inverse().apply(rigid.apply(fish(100))), fish(100), atol=1e-5)


def test_a_large_motion_and_scale_are_found_in_space(rng, random_pose):
    """A large motion in 3-D with a scale is found from a start near it."""
    source = rng.standard_normal((60, 3)) * [3.0, 2.0, 1.0]
    truth = random_pose(rng, 3, scaled=True)
    rotation = Pose.from_angle(0.3)
    turn = np.eye(3)
    turn[:2, :2] = rotation.R
    start = Pose(truth.R @ turn, truth.t, truth.scale)
    result = register(source, truth.apply(source), "cpd-similarity", start=start, sigma=0.5 * float(truth.scale))
    np.testing.assert_allclose(result.matrix, truth.matrix, atol=1e-6)


def test_the_scale_switch():
    """With the moving cloud 15 % smaller, similarity CPD finds 1/0.85 and rigid CPD stays at 1."""
    target = fish(150)
    source = 0.85 * Pose.from_angle(np.radians(-20.0), (0.3, 0.2)).apply(fish(150, 0.5))
    similarity = register(source, target, "cpd-similarity", clutter=0.12)
    assert similarity.pose.scale == pytest.approx(1.0 / 0.85, rel=0.01)
    assert register(source, target, "cpd-rigid", clutter=0.12).pose.scale == 1.0


def test_similarity_can_collapse():
    """From a bad start with a small σ, the similarity shrinks its cloud onto part of the other, which the rigid method
    cannot; near the truth neither does. The likelihood at the collapse is far below that near the truth."""
    scene = room("striped")
    options = {"sigma": 0.3, "clutter": 0.12, "volume": 36.0, "max_steps": 200}
    result = register(
        scene.source, scene.target, "cpd-similarity", start=Pose.from_angle(0.0, (-6.0, -4.0)), **options
    )
    local = register(scene.source, scene.target, "cpd-similarity", **options)
    assert result.pose.scale < 0.5
    assert local.pose.scale == pytest.approx(1.0, abs=0.01)
    assert result.objective > local.objective + 50.0


@pytest.mark.parametrize("method", BOTH)
def test_a_batch_is_its_single_runs(method):
    """5 problems batched, with finished ones leaving early, and one by one agree to 1e-12 relative."""
    scenes = [room("outliers", seed=seed) for seed in SEEDS[:5]]
    source, target = np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes])
    start = Pose.from_angle(np.radians([10.0, 45.0, 170.0, -30.0, 0.0]), 0.5 * np.ones((5, 2)))
    batch = register(source, target, method, start=start, max_steps=30)
    for k in range(5):
        alone = register(source[k], target[k], method, start=start[k], max_steps=30)
        assert alone.steps == batch.steps[k]
        np.testing.assert_allclose(batch.matrix[k], alone.matrix, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(batch.objective[k], alone.objective, rtol=1e-12)


def test_units_and_origin_do_not_matter():
    """If the volume is in the clouds' unit, whether given or default, clouds in millimetres and far from the origin
    give the same motion; if it is the number of points, they do not."""
    s = room("outliers")
    shift = np.array([300.0, -200.0])
    for volumes, same in (((36.0, 36e6), True), ((None, None), True), ((160.0, 160.0), False)):
        plain = register(s.source, s.target, "cpd-rigid", volume=volumes[0], max_steps=40)
        big = register(1e3 * s.source + shift, 1e3 * s.target + shift, "cpd-rigid", volume=volumes[1], max_steps=40)
        assert np.allclose(big.pose.R, plain.pose.R, atol=1e-9) == same
        moved = 1e3 * plain.transform(s.source) + shift
        assert np.allclose(big.transform(1e3 * s.source + shift), moved, rtol=1e-8) == same


def test_stages_are_those_of_the_step(rng, random_pose):
    """The stages shown in a walkthrough (centred clouds, correlation, rotation, translation, σ) are those of a step."""
    p = scene(rng, random_pose, 2)
    batch = advance(begin(METHODS["cpd-similarity"], p))
    parts, after = stages(batch.state()), advance(batch).state()
    P = parts.responsibilities
    np.testing.assert_allclose(P, responsibilities(batch.state()))
    np.testing.assert_allclose(P.sum(axis=1) @ parts.centred_moving, 0.0, atol=1e-10)
    np.testing.assert_allclose(P.sum(axis=0) @ parts.centred_fixed, 0.0, atol=1e-10)
    np.testing.assert_allclose(parts.correlation, parts.centred_moving.T @ P @ parts.centred_fixed, atol=1e-10)
    np.testing.assert_allclose(parts.rotation, after.pose.R[0])
    np.testing.assert_allclose(parts.translation, after.pose.t[0])
    assert (parts.scale, parts.sigma) == pytest.approx((after.pose.scale[0], after.sigma[0]))
    assert len(STAGES) == 5


TWO = np.array([[0.0, 0.0], [1.0, 0.0]])


@pytest.mark.parametrize("method", BOTH)
def test_what_does_not_determine_a_rotation_is_said(method):
    result = register([[1.0, 2.0]], fish(20), method)
    assert result.status == Status.DEGENERATE
    assert "all source points are equal" in result.reason
    np.testing.assert_array_equal(result.pose.R, np.eye(2))
    coincident = register(fish(20), np.full((7, 2), 0.1), method)
    assert coincident.status == Status.DEGENERATE
    assert "all target points are equal" in coincident.reason
    two = register(TWO, Pose.from_angle(0.6, (2.0, 1.0)).apply(TWO), method, clutter=0.0)
    assert two.status == Status.CONVERGED
    np.testing.assert_allclose(two.transform(TWO), Pose.from_angle(0.6, (2.0, 1.0)).apply(TWO), atol=1e-5)


@pytest.mark.parametrize("distance", [0.0, 1e3, 1e7])
def test_a_rotation_that_rounding_alone_decides_is_undefined(rng, distance):
    """Two points across two others are equally near to both; far from the origin only their rounded digits differ."""
    for turn, x, y in rng.uniform(0.1, 1.5, (20, 3)):
        along = np.array([np.cos(turn), np.sin(turn)])
        across = np.array([-along[1], along[0]])
        corner = distance * np.array([x, y])
        result = register(corner + np.outer([x, -x], along), corner + np.outer([y, -y], across), "cpd-rigid")
        assert result.status == Status.DEGENERATE
        assert "several rotations" in result.reason


@pytest.mark.parametrize("copies", [1, 40])
@pytest.mark.parametrize("clutter", [0.0, 1.0 - 1e-10])
def test_how_much_mass_is_left_does_not_decide_whether_a_rotation_is_defined(copies, clutter):
    """A ten-billionth of the mass still turns the source; of two points across two others, many copies do not."""

    def after_a_step(source, target, start):
        clouds = (np.tile(cloud, (copies, 1)) for cloud in (source, target))
        batch = begin(METHODS["cpd-rigid"], problem(*clouds, Pose(start.R[None], start.t[None])), CpdOptions(clutter))
        return advance(batch)

    turned = after_a_step(fish(12), fish(12), Pose.from_angle(0.3)).pose()
    assert abs(float(turned.angle[0])) < 0.29
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    cross = after_a_step(np.outer([1.0, -1.0], along), np.outer([2.0, -2.0], across), Pose.identity())
    assert "several rotations" in cross.state().reason[0]


def test_a_pose_at_rest_does_not_end_a_run_whose_width_still_shrinks():
    """A grid registered to itself is in place from the first step on, by symmetry, whatever the width."""
    cloud = np.stack(np.meshgrid(np.linspace(-1.0, 1.0, 6), np.linspace(-1.0, 1.0, 6)), axis=-1).reshape(-1, 2)
    states = []
    result = register(cloud, cloud, "cpd-rigid", callback=lambda k, state: states.append(state))
    first, last = states[0], states[-1]
    assert result.status == Status.CONVERGED
    np.testing.assert_allclose(first.pose.matrix, last.pose.matrix, atol=1e-9)
    assert last.sigma < 0.01 * first.sigma


def test_in_space_a_line_leaves_its_own_turn_free(rng, random_pose):
    line = np.linspace(-1.0, 2.0, 9)[:, None] * [1.0, 2.0, -0.5]
    result = register(line, random_pose(rng, 3).apply(line), "cpd-rigid", max_steps=300)
    assert result.status in (Status.DEGENERATE, Status.CAPPED)
    assert np.isfinite(result.matrix).all()
    equal = register(line, line, "cpd-rigid", max_steps=300)
    assert equal.status == Status.DEGENERATE
    assert "collinear" in equal.reason


def test_a_clutter_that_explains_all_is_said():
    """Far apart, with a small σ and dense clutter, no responsibility is left: degenerate, not a pose of NaN."""
    result = register(fish(20), fish(20) + 1000.0, "cpd-rigid", sigma=0.1, clutter=0.5, volume=1.0)
    assert result.status == Status.DEGENERATE
    assert "clutter explains every fixed point" in result.reason
    assert result.steps == 0


def test_a_circle_and_a_wall_stop_truthfully():
    """The scene does not determine the rotation about a circle or the slide along a wall; only the value converges. The
    status says converged, not right, and the error against the truth remains."""
    f = 2.0 * np.pi * np.arange(60) / 60.0
    circle = np.column_stack([np.cos(f), np.sin(f)])
    circle_result = register(circle, Pose.from_angle(2.0).apply(circle), "cpd-rigid", max_steps=300)
    assert circle_result.status in (Status.CONVERGED, Status.CAPPED)
    assert metrics.rre(circle_result.pose, Pose.from_angle(2.0)) > np.radians(30.0)
    wall = np.column_stack([np.linspace(-3.0, 3.0, 60), np.zeros(60)])
    slid = register(wall[5:40], wall, "cpd-rigid", start=Pose.from_angle(0.1, (0.4, 0.3)), max_steps=300)
    assert abs(slid.pose.t[1]) < 0.01
    assert abs(slid.pose.angle) < 0.01


def test_unrelated_clouds_end_with_a_status_and_a_wide_sigma(rng):
    """For two unrelated clouds it stops with a status, and does not claim success."""
    source, target = rng.uniform(-5.0, 5.0, (2, 60, 2))
    result = register(source, target, "cpd-rigid", max_steps=100)
    assert result.status in (Status.CONVERGED, Status.CAPPED)
    assert result.detail("sigma") > 0.3


@pytest.mark.parametrize(
    ("name", "value"),
    [("clutter", 1.0), ("clutter", -0.1), ("volume", 0.0), ("sigma", -1.0), ("tolerance", -1.0), ("clutter", "much")],
)
def test_options_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"^{name}: "):
        register(TWO, TWO, "cpd-rigid", **{name: value})
