"""Point to plane and generalised ICP: limits in closed form, what scenes leave free, and behaviour in a batch."""

import numpy as np
import pytest

from solvers import Pose, Status, fit_rigid, register
from solvers.geometry import nearest
from solvers.geometry.normals import normals
from solvers.methods.icp import gicp, surface_icp
from solvers.metrics import rre, rte
from solvers.numerics import gauss_newton
from solvers.scenes.rooms import room, room_start
from solvers.studies.race import SEEDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
BOTH = pytest.mark.parametrize("method", ["point-to-plane", "gicp"])


# ---- the step, and its limits ----


def pairs_with(rng, d, b=3, m=25):
    moved, partners = rng.standard_normal((2, b, m, d)) * 2.0 + 5.0
    weights = rng.uniform(0.1, 2.0, (b, m))
    centre = moved.mean(axis=1)
    radius = np.sqrt(((moved - centre[:, None]) ** 2).sum(axis=(1, 2)) / m)
    return moved, partners, weights, centre, radius


def unit_vectors(rng, shape):
    v = rng.standard_normal(shape)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def by_stacked_rows(moved, partners, roots, weights, centre, radius):
    """The same step from the stacked linear system √w L (J ξ + x − q) = 0, by least squares, with J by finite
    differences."""
    b, _, d = moved.shape
    steps = []
    for i in range(b):
        columns = []
        for k in range(d * (d + 1) // 2):
            def go(h, k=k, i=i):
                v, a = np.zeros(d), np.zeros(d * (d - 1) // 2)
                (v if k < d else a)[k if k < d else k - d] = h
                R = gauss_newton.rotation(a / radius[i])
                return centre[i] + (moved[i] - centre[i]) @ R.T + v
            columns.append((go(1e-5) - go(-1e-5)) / 2e-5)
        J = np.stack(columns, axis=-1)
        L = np.sqrt(weights[i])[:, None, None] * roots[i]
        rows, residual = (L @ J).reshape(-1, J.shape[-1]), (L @ (moved[i] - partners[i])[..., None]).ravel()
        steps.append(-np.linalg.lstsq(rows, residual, rcond=None)[0])
    return np.array(steps)


@pytest.mark.parametrize("d", [2, 3])
def test_equal_isotropic_covariances_give_the_point_to_point_step(rng, d, random_pose):
    """With Σ_p = a I and Σ_q = b I and no active cap, GICP's step is point to point's Gauss-Newton step. The closed
    form differs, but they share the fixed point."""
    moved, partners, weights, centre, radius = pairs_with(rng, d)
    R = random_pose(rng, d, (3,)).R
    iso = np.broadcast_to(np.eye(d), (3, 25, d, d))
    M = surface_icp.precisions(0.3 * iso, 1.9 * iso, R)
    np.testing.assert_allclose(M, iso / 2.2, rtol=1e-14, atol=1e-14)
    result = gauss_newton.solve(gauss_newton.system(moved, partners, M, weights, centre, radius))
    expected = by_stacked_rows(moved, partners, iso, weights, centre, radius)
    np.testing.assert_allclose(result, expected, rtol=1e-8, atol=1e-8)
    # The least-squares pose is a fixed point: after the closed form the step is zero.
    fit = fit_rigid(moved, partners, weights).pose
    points = fit.apply(moved)
    w = weights / weights.sum(axis=1, keepdims=True)
    system = gauss_newton.system(points, partners, M, weights, (w[..., None] * points).sum(axis=1), radius)
    np.testing.assert_allclose(gauss_newton.solve(system), 0.0, atol=1e-13)


@pytest.mark.parametrize("d", [2, 3])
def test_a_sharp_target_covariance_tends_to_point_to_plane(rng, d):
    """With Σ_p = 0 and Σ_q = ε n nᵀ + τ (I − n nᵀ) the step tends to point to plane's as τ grows, as 1/τ."""
    moved, partners, weights, centre, radius = pairs_with(rng, d)
    n = unit_vectors(rng, moved.shape)
    nn = n[..., :, None] * n[..., None, :]
    plane = gauss_newton.solve(gauss_newton.system(moved, partners, nn, weights, centre, radius))
    np.testing.assert_allclose(
        plane, by_stacked_rows(moved, partners, n[..., None, :], weights, centre, radius), rtol=1e-8, atol=1e-8
    )
    errors = []
    for tau in (1e2, 1e4, 1e6):
        cov = 0.01 * nn + tau * (np.eye(d) - nn)
        M = surface_icp.precisions(np.zeros_like(cov), cov, np.broadcast_to(np.eye(d), (3, d, d)))
        step = gauss_newton.solve(gauss_newton.system(moved, partners, M, weights, centre, radius))
        errors.append(np.abs(step - plane).max())
    assert errors[0] > 50.0 * errors[1] > 2000.0 * errors[2]
    assert errors[2] < 1e-6


def test_canonical_covariances_do_not_tend_to_point_to_plane(rng):
    """With ε → 0 on both sides, the precision keeps a tangential part wherever the two normals differ."""
    moved, partners, weights, centre, radius = pairs_with(rng, 2)
    n, own = unit_vectors(rng, (2, *moved.shape))
    plane = gauss_newton.solve(
        gauss_newton.system(moved, partners, n[..., :, None] * n[..., None, :], weights, centre, radius)
    )
    cov = [np.eye(2) + (1e-9 - 1.0) * (x[..., :, None] * x[..., None, :]) for x in (own, n)]
    M = surface_icp.precisions(cov[0], cov[1], np.broadcast_to(np.eye(2), (3, 2, 2)))
    step = gauss_newton.solve(gauss_newton.system(moved, partners, M, weights, centre, radius))
    assert np.abs(step - plane).max() > 0.1


@pytest.mark.parametrize("d", [2, 3])
def test_the_gradient_is_that_of_the_cost(rng, d):
    """2 Σw g is the derivative of Σ w eᵀMe along each unknown, by central differences of the exact motion."""
    moved, partners, weights, centre, radius = pairs_with(rng, d)
    root = rng.standard_normal((*moved.shape, d))
    M = root @ root.swapaxes(-1, -2)
    system = gauss_newton.system(moved, partners, M, weights, centre, radius)
    identity = Pose.identity(d, (3,))
    p = system.gradient.shape[1]

    def cost(xi):
        e = gauss_newton.apply(xi, system, identity).apply(moved) - partners
        return (weights * np.einsum("bmi,bmij,bmj->bm", e, M, e)).sum(axis=1)

    h = 1e-6
    slope = np.stack([(cost(h * np.eye(p)[[k] * 3]) - cost(-h * np.eye(p)[[k] * 3])) / (2 * h) for k in range(p)], -1)
    expected = 2.0 * weights.sum(axis=1)[:, None] * system.gradient
    np.testing.assert_allclose(slope, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_the_condition_depends_neither_on_units_nor_on_the_origin():
    """A room moved by 100 u, or measured in other units, has the same condition number and the same weak direction."""
    scene = room("noise")
    results = [
        register(s * scene.source + at, s * scene.target + at, "point-to-plane", max_steps=0).states[0].system
        for s, at in ((1.0, 0.0), (1.0, 100.0), (0.001, 0.0))
    ]
    assert 1.0 < results[0].condition[0] < 100.0
    for result in results[1:]:
        np.testing.assert_allclose(result.condition, results[0].condition, rtol=1e-9)
        np.testing.assert_allclose(result.directions[0], results[0].directions[0], atol=1e-9)


def test_one_common_factor_caps_a_step():
    """A capped step keeps the direction of the uncapped one, and meets the tighter of the two caps exactly."""
    rng = np.random.default_rng(4)
    moved, partners, weights, centre, radius = pairs_with(rng, 2, b=6)
    system = gauss_newton.system(
        moved, partners + rng.standard_normal((6, 1, 2)), np.broadcast_to(np.eye(2), (6, 25, 2, 2)), weights, centre,
        radius,
    )  # fmt: skip
    free = gauss_newton.solve(system)
    capped = gauss_newton.solve(system, max_shift=0.2, max_turn=0.05)
    factor = capped / free
    np.testing.assert_allclose(factor, factor[:, :1] * np.ones(3), rtol=1e-12)
    shift, angle = np.linalg.norm(capped[:, :2], axis=1) / 0.2, np.abs(capped[:, 2]) / radius / 0.05
    np.testing.assert_allclose(np.maximum(shift, angle), 1.0, rtol=1e-12)


# ---- weights, gate, trim, batch ----


@BOTH
@pytest.mark.parametrize("weight", ["none", "huber", "tukey", "welsch"])
def test_every_weight_runs_and_is_reported(method, weight):
    """With 20 % outliers each robust weight gives a proper answer near the truth, and the reported weights are its
    own."""
    scene = room("outliers", seed=53)
    result = register(scene.source, scene.target, method, start=room_start(10.0, 0.4), weight=weight, gate=2.6)
    assert rre(result.pose, scene.truth) < np.radians(3.0)
    pairing = result.states[0].pairing
    used = pairing.used[0]
    assert ((pairing.weights[0] > 0.0) == used).all()
    assert (len(np.unique(pairing.weights[0][used])) == 1) == (weight == "none")


def test_redescending_weights_help_where_outliers_pull():
    """Over 25 seeds with outliers, from a near start, Tukey's median error is less than half of that without a
    weight."""
    errors = {}
    scenes = [room("outliers", seed=seed) for seed in SEEDS]
    for weight in ("none", "tukey"):
        result = register(
            np.stack([s.source for s in scenes]), np.stack([s.target for s in scenes]), "point-to-plane",
            start=room_start(8.0, 0.3), weight=weight, gate=2.6,
        )  # fmt: skip
        errors[weight] = np.median(rte(result.pose, Pose.identity()))
    assert errors["tukey"] < 0.5 * errors["none"]


def test_rows_without_weight_count_for_nothing():
    scene = room("noise")
    extra = np.vstack([scene.source, [[1e140, -3.0], [2.0, 9.0]]])
    w = np.r_[np.ones(len(scene.source)), 0.0, 0.0]
    # The radius and the centre are the cloud's; the steps they scale are the same.
    source = np.vstack([scene.source, [[1.0, -3.0], [2.0, 9.0]]])
    a = register(source, scene.target, "point-to-plane", weights=w, tolerance=1e-10, rms_tolerance=0.0)
    b = register(scene.source, scene.target, "point-to-plane", tolerance=1e-10, rms_tolerance=0.0)
    np.testing.assert_allclose(a.pose.matrix, b.pose.matrix, atol=1e-8)
    assert np.isfinite(register(extra, scene.target, "point-to-plane", weights=w).pose.matrix).all()


@BOTH
def test_a_batch_is_its_single_runs(method):
    scenes = [room("combo", seed=seed) for seed in SEEDS[:4]]
    source, target = (np.stack([getattr(s, x) for s in scenes]) for x in ("source", "target"))
    options = {"start": room_start(), "gate": 2.6, "max_shift": 1.5, "weight": "huber"}
    batch = register(source, target, method, **options)
    for i in range(4):
        alone = register(source[i], target[i], method, **options)
        assert alone.steps == batch.steps[i]
        assert alone.status == batch.status[i]
        np.testing.assert_allclose(alone.pose.matrix, batch.pose.matrix[i], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(alone.objective, batch.objective[i], rtol=1e-11)


@BOTH
def test_the_state_shows_what_a_figure_draws(method):
    """A state's pairs, normals and precisions belong to its pose, and the objective is their sum."""
    scene = room("noise")
    result = register(scene.source, scene.target, method, start=room_start(20.0, 0.5), max_steps=3, trim=0.2)
    pairing, M = result.states[0].pairing, result.states[0].precision[0]
    np.testing.assert_allclose(pairing.moved[0], result.transform(scene.source), atol=1e-12)
    e = pairing.moved[0] - scene.target[pairing.rows[0]]
    r2 = np.einsum("mi,mij,mj->m", e, M, e)
    assert result.objective == pytest.approx((pairing.weights[0] * r2).sum())
    n = result.states[0].normals.vectors[0][pairing.rows[0]]
    if method == "point-to-plane":
        np.testing.assert_allclose(r2, (e * n).sum(axis=1) ** 2, atol=1e-12)
    else:
        cov_p, cov_q = (c[0] for c in result.states[0].covariances)
        R = result.pose.R
        np.testing.assert_allclose(M @ (cov_q[pairing.rows[0]] + R @ cov_p @ R.T), np.eye(2) + 0 * M, atol=1e-10)
        np.testing.assert_allclose(np.linalg.eigvalsh(cov_q), [[0.01, 1.0]] * len(cov_q), rtol=1e-12)


@pytest.mark.parametrize(
    ("method", "options", "name"),
    [
        ("point-to-plane", {"neighbours": 0}, "neighbours"),
        ("point-to-plane", {"max_turn": 0.0}, "max_turn"),
        ("point-to-plane", {"free_below": 2.0}, "free_below"),
        ("gicp", {"normal": 0.0}, "normal"),
        ("gicp", {"tangent": -1.0}, "tangent"),
        ("gicp", {"weight": "hubert"}, "weight"),
        ("gicp", {"gate": 0.0}, "gate"),
    ],
)
def test_refusals_name_the_option(method, options, name):
    with pytest.raises(ValueError, match=rf"^{name}"):
        register(np.eye(2), np.eye(2), method, **options)


def test_a_point_without_a_normal_is_as_wide_as_a_surface():
    surface = normals(nearest.build(np.full((1, 4, 2), 0.3)))
    np.testing.assert_allclose(gicp.surface_covariances(surface, 2.0, 0.01), np.broadcast_to(2.0 * np.eye(2), (1, 4, 2,
    2)))


def test_the_problem_is_untouched():
    """A run writes to none of the arrays it is given."""
    scene = room("noise")
    source, target = scene.source.copy(), scene.target.copy()
    register(source, target, "gicp", start=room_start(20.0, 0.4))
    assert (source == scene.source).all()
    assert (target == scene.target).all()


def test_a_run_that_goes_round_is_stalled_not_capped():
    """On some seeds of the sparse room a few sets of pairs lead to each other forever. This is reported before the cap,
    and correctly: continuing returns to the same pose."""
    scenes = [room("striped", seed=seed) for seed in SEEDS]
    options = {"gate": 2.6, "max_shift": 1.5}
    many = [register(s.source, s.target, "point-to-plane", start=room_start(), **options) for s in scenes]
    stalls = [(s, r) for s, r in zip(scenes, many, strict=True) if r.status is Status.STALLED]
    assert len(stalls) > 0
    for scene, result in stalls:
        poses = []
        on = register(
            scene.source, scene.target, "point-to-plane", start=result.pose, max_steps=40, rms_tolerance=0.0,
            tolerance=0.0, callback=lambda k, s, poses=poses: poses.append(s.pose.matrix[0]) and None, **options,
        )  # fmt: skip
        assert on.status in (Status.CAPPED, Status.STALLED)
        assert min(np.abs(m - result.matrix).max() for m in poses[1:]) < 1e-4
        assert np.abs(poses[0] - result.matrix).max() > 1e-6


@BOTH
def test_pairs_whose_weights_are_all_zero_are_degenerate(method):
    """Tukey's weight with a scale far below every distance rejects all pairs: this is reported, and the pose stays."""
    scene = room("clean")
    start = Pose.from_angle(0.3, (30.0, 0.0))
    result = register(scene.source, scene.target, method, start=start, weight="tukey", scale=0.1)
    assert result.status is Status.DEGENERATE
    assert "no pair can be used" in result.reason
    np.testing.assert_allclose(result.pose.t, (30.0, 0.0))


def test_an_rms_is_a_number_where_all_residuals_are_tangents():
    """Points of a line, moved along it: every residual is zero up to rounding of either sign, and no square may come
    out negative. The directions are a batch."""
    angles = np.linspace(0.0, np.pi, 64, endpoint=False)
    line = np.arange(24.0)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, None]
    result = register(line * (22.7 / 23.0), line, "point-to-plane")
    pairing = result.detail("pairing")
    assert np.isfinite(pairing.rms).all()
    assert (pairing.objective >= 0.0).all()
    assert pairing.rms.max() < 1e-7
