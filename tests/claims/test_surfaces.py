"""The claims of the chapter 'A point meets a wall', checked against the solvers."""

import functools

import numpy as np
import pytest

from solvers import Pose, Status, register
from solvers.geometry import nearest
from solvers.geometry.normals import normals
from solvers.methods.icp.gicp import surface_covariances
from solvers.metrics import rre, rte
from solvers.numerics import gauss_newton, robust
from solvers.scenes.rooms import room, room_start
from solvers.scenes.walls import corridor, sampled, single_wall
from solvers.studies.race import SEEDS

NEAR, MIDWAY, FARTHER = (15.0, 0.5), (45.0, 1.43), (75.0, 1.43)
CORNER = np.array([(0.0, 0.0), (8.0, 0.0), (8.0, 2.0)])  # a long wall and a short one at its end


@functools.cache
def runs(setting, method, start, **options):
    """25 draws of the room from one start: the result, rotation errors in degrees, translation errors."""
    scenes = [room(setting, seed=seed) for seed in SEEDS]
    clouds = [np.stack([getattr(scene, name) for scene in scenes]) for name in ("source", "target")]
    result = register(*clouds, method, start=room_start(*start), max_steps=70, **options)
    return result, np.degrees(rre(result.pose, Pose.identity())), rte(result.pose, Pose.identity())


def successes(setting, method, start, **options):
    """In how many of the 25 draws the pose ends within 5° and 0.2 u of the truth."""
    _, degrees, units = runs(setting, method, start, **options)
    return int(((degrees < 5.0) & (units < 0.2)).sum())


def gaps(method, steps=1, **options):
    """The distance left to the end wall after each step, u: a scan of the corner, pushed 0.6 u along its long wall."""
    cloud = sampled(CORNER, 0.1)
    result = register(cloud - [0.6, 0.0], cloud, method, max_steps=steps, **options)
    return 0.6 - result.history.poses.t[:, 0]


# Point pairs at a wall


def test_a_wall_answers_with_its_nearest_sample():
    """However far a scan has slid along a wall sampled every 0.15 u, no inner pair is more than 0.075 u apart along it:
    a pair cannot tell how far the slide was."""
    wall = sampled(np.array([(-6.0, 0.0), (6.0, 0.0)]), 0.15)
    scan = sampled(np.array([(-2.0, 0.3), (2.0, 0.3)]), 0.16)
    for slide in (0.0, 0.07, 0.5, 1.3, 3.1):
        points = scan + np.array([slide, 0.0])
        rows = nearest.build(wall[None]).nearest(points[None])[0][0]
        along = np.abs((points - wall[rows])[:, 0])
        assert along.max() <= 0.075 + 1e-12


def test_point_pairs_crab_along_a_wall():
    """With a fifth of the points facing the end wall, each of the first five point-to-point steps closes one to three
    tenths of the gap, and the pairs along the long wall stop the run with 0.16 u still open. Point to plane closes the
    gap in one step."""
    point, plane = gaps("icp", 40), gaps("point-to-plane", 1)
    ratio = point[1:6] / point[:5]
    assert ((ratio > 0.7) & (ratio < 0.9)).all()
    assert point[-1] == pytest.approx(0.164, abs=0.005)
    assert abs(plane[1]) < 0.03


def test_in_the_clean_room_planes_and_covariances_take_fewer_steps():
    """From the near start all three find all 25 clean rooms, but point pairs take at least three times as many steps in
    the median."""
    steps = {}
    for method in ("icp", "point-to-plane", "gicp"):
        assert successes("clean", method, NEAR) == 25
        steps[method] = np.median(runs("clean", method, NEAR)[0].steps)
    assert steps["icp"] >= 3 * max(steps["point-to-plane"], steps["gicp"])


# Point to plane


def test_sliding_along_the_line_costs_nothing():
    """A scan placed anywhere along a wall, even far beyond its end, has the same plane objective, the sum of its
    squared distances from the wall's line, and no force along it; the point objective grows with the distance beyond
    the end."""
    rng, along, n = np.random.default_rng(3), np.array([-0.8, 0.6]), np.array([0.6, 0.8])
    wall = sampled(np.array([4.0 * along, -4.0 * along]), 0.15)
    heights = rng.uniform(0.1, 0.5, 12)
    scan = np.outer(rng.uniform(-1.0, 1.0, 12), along) + np.outer(heights, n)
    for slide in (0.0, 0.1, 3.0, -50.0, 1e4):
        plane, point = (
            register(scan + slide * along, wall, method, max_steps=0) for method in ("point-to-plane", "icp")
        )
        assert plane.objective == pytest.approx(np.square(heights).sum(), rel=1e-7)
        assert plane.states[0].system.gradient[0, :2] @ along == pytest.approx(0.0, abs=1e-9)
        assert point.objective > np.square(heights).sum() + 12 * np.square(max(abs(slide) - 5.0, 0.0))


def raw_condition(moved, n, centre, unit):
    """The condition number of Σ a aᵀ, a = (n, n·J(x − centre)/unit)."""
    arm = (moved - centre) / unit
    rows = np.column_stack([n, n[:, 1] * arm[:, 0] - n[:, 0] * arm[:, 1]])
    return np.linalg.cond(rows.T @ rows)


@pytest.mark.parametrize("start", [NEAR, MIDWAY, FARTHER])
def test_in_the_plane_the_fit_is_the_root_of_a_quartic(start):
    """With (cos, sin) = v the sum of squares is quadratic in t and v. Eliminating t leaves vᵀGv − 2hᵀv, whose minimum
    on |v| = 1 satisfies (G + λ) v = h and |adj(G + λ) h|² = det(G + λ)². One of the real λ gives the lowest cost, no
    higher than that of any of 36,000 angles."""
    for seed in SEEDS[:5]:
        scene, pose = room("clean", seed=seed), room_start(*start)
        index = nearest.build(scene.target[None])
        rows = index.nearest(pose.apply(scene.source)[None])[0][0]
        n, p, q = normals(index).vectors[0, rows], scene.source, scene.target[rows]
        quarter = np.stack([-p[:, 1], p[:, 0]], axis=1)
        free = np.eye(len(n)) - n @ np.linalg.pinv(n)  # projects out what t can explain
        A = free @ np.stack([np.vecdot(n, p), np.vecdot(n, quarter)], axis=1)
        b = free @ np.vecdot(n, q)
        G, h = A.T @ A, A.T @ b
        adjugate = np.trace(G) * np.eye(2) - G
        determinant = np.poly1d([1.0, np.trace(G), np.linalg.det(G)])
        length = np.poly1d([h @ h, 2.0 * h @ adjugate @ h, np.square(adjugate @ h).sum()])
        roots = (determinant**2 - length).roots
        real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots).max()].real
        fits = [np.linalg.solve(G + root * np.eye(2), h) for root in real]
        best = min(fits, key=lambda v: np.square(A @ v - b).sum())
        assert np.linalg.norm(best) == pytest.approx(1.0, abs=1e-9)
        angles = np.linspace(-np.pi, np.pi, 36_000)
        costs = np.square(A @ np.stack([np.cos(angles), np.sin(angles)]) - b[:, None]).sum(axis=0)
        assert np.square(A @ best - b).sum() <= costs.min()
        assert np.arctan2(best[1], best[0]) == pytest.approx(angles[costs.argmin()], abs=2e-4)


def test_condition_before_and_after_centring():
    """The room's system has condition 2.7 about its centre with the angle scaled by the RMS radius, 13 about the origin
    in plain units, and more than eight million if the same room lies 100 u away in any of twelve directions, or is
    measured in millimetres."""
    scene = room("clean")
    index = nearest.build(scene.target[None])
    n = normals(index).vectors[0, index.nearest(scene.source[None])[0][0]]
    x, middle = scene.source, scene.source.mean(axis=0)
    radius = np.sqrt(((x - middle) ** 2).sum(axis=1).mean())
    own = register(x, scene.target, "point-to-plane", max_steps=0).states[0].system.condition[0]
    assert raw_condition(x, n, middle, radius) == pytest.approx(own, rel=1e-6)
    assert own == pytest.approx(2.7, abs=0.05)
    assert raw_condition(x + 100.0, n, middle + 100.0, radius) == pytest.approx(own, rel=1e-6)
    assert raw_condition(x, n, 0.0, 1.0) == pytest.approx(13.1, abs=0.1)
    for way in np.radians(np.arange(0.0, 360.0, 30.0)):
        assert raw_condition(x + 100.0 * np.array([np.cos(way), np.sin(way)]), n, 0.0, 1.0) > 8e6
    assert raw_condition(1000.0 * x, n, 0.0, 1.0) > 8e6


@pytest.mark.parametrize("scene", [single_wall, corridor])
def test_walls_leave_the_slide(scene):
    """On one wall and in a corridor, point to plane finds the turn and the position across; along the walls it stays
    where it was, and reports that this slide is free."""
    for seed in SEEDS[:8]:
        case = scene(seed=seed)
        result = register(case.source, case.target, "point-to-plane", start=case.start, free_below=0.05)
        along = np.array([8.0, 2.8]) / np.hypot(8.0, 2.8)
        before, after = ((pose.apply(case.source) - case.source).mean(axis=0) for pose in (case.start, result.pose))
        assert result.status is Status.DEGENERATE
        assert "slide along" in result.reason
        assert np.degrees(rre(result.pose, case.truth)) < 1.0
        assert abs(after[1] * along[0] - after[0] * along[1]) < 0.05
        assert along @ after == pytest.approx(along @ before, abs=0.01)
        assert abs(along @ after) > 0.4


def test_point_pairs_call_a_wall_well_conditioned():
    """On the single wall the point system has a condition near 1, yet its end is more than 1 u from the truth along the
    wall, as its start was, and within 0.1 u of point to plane's end."""
    along = np.array([8.0, 2.8]) / np.hypot(8.0, 2.8)
    for seed in SEEDS[:8]:
        scene = single_wall(seed=seed)
        result = register(scene.source, scene.target, "icp", start=scene.start)
        plane = register(scene.source, scene.target, "point-to-plane", start=scene.start, free_below=0.05)
        point_off, plane_off = (
            along @ (pose.apply(scene.source) - scene.source).mean(axis=0) for pose in (result.pose, plane.pose)
        )
        pairing = result.states[0].pairing
        eye = np.broadcast_to(np.eye(2), (*pairing.moved.shape, 2))
        centre = pairing.moved.mean(axis=1)
        system = gauss_newton.system(
            pairing.moved, scene.target[pairing.rows], eye, pairing.weights, centre, result.states[0].radius
        )
        assert result.status is Status.CONVERGED
        assert system.condition[0] < 1.1
        assert point_off > 1.0
        assert point_off == pytest.approx(plane_off, abs=0.1)


# GICP


def test_gicp_holds_a_wall_by_a_hundredth():
    """On a noise-free wall, the covariances hold the slide exactly 1/100 as strongly as the rest: weak, not free."""
    scene = single_wall(noise=0.0)
    result = register(scene.source, scene.target, "gicp", start=Pose.from_angle(0.1, (0.3, 0.1)))
    system = result.states[0].system
    assert system.condition[0] == pytest.approx(100.0)
    assert not system.free.any()
    assert result.status is Status.CONVERGED
    assert rte(result.pose, scene.truth) > 0.2


def slides(method, **options):
    """How far a run moves along the noisy wall, u, in each of 25 draws from one start 0.4 u along from the truth."""
    along, moved = np.array([8.0, 2.8]) / np.hypot(8.0, 2.8), []
    for seed in SEEDS:
        scene = single_wall(seed=seed, noise=0.1)
        start = room_start(*NEAR)
        result = register(scene.source, scene.target, method, start=start, max_steps=40, **options)
        moved.append(along @ (result.pose.apply(scene.source) - start.apply(scene.source)).mean(axis=0))
    return np.array(moved)


def test_on_a_noisy_wall_gicp_wanders():
    """On one wall with noise of 0.1 u, in 25 draws, GICP slides along it by 0.6 to 0.7 u, in either direction; point
    to plane with weak directions left alone stays within 0.03 u of its start along the wall."""
    drifts = slides("gicp")
    assert -0.7 < drifts.min() < -0.6
    assert 0.6 < drifts.max() < 0.7
    assert np.abs(slides("point-to-plane", free_below=0.05)).max() < 0.03


def test_a_bad_normal_does_not_widen_its_covariance():
    """At the room's corners normals are off by up to 45°, but their covariances are as narrow as on a bare wall."""
    surface = normals(nearest.build(room("clean", noise=0.0).target[None]))
    n = surface.vectors[0]
    angles = np.degrees(np.arctan2(np.abs(n).min(axis=1), np.abs(n).max(axis=1)))
    assert (angles > 20.0).sum() == 18
    assert angles.max() == pytest.approx(45.0)
    widths = np.linalg.eigvalsh(surface_covariances(surface, 1.0, 0.01)[0])
    np.testing.assert_allclose(widths, np.tile([0.01, 1.0], (len(n), 1)), atol=1e-12)


# None is best


def test_no_residual_has_the_widest_basin():
    """From 45°, of 25 draws: with noise, point pairs find all, while point to plane and GICP miss one to three; where
    the sampling thins out, point to plane finds at least five fewer than point pairs; where it is striped, point pairs
    find none and the others all."""
    results = {
        setting: [successes(setting, method, MIDWAY) for method in ("icp", "point-to-plane", "gicp")]
        for setting in ("noise", "gradient", "striped")
    }
    assert results["noise"][0] == 25
    assert all(22 <= count < 25 for count in results["noise"][1:])
    assert results["gradient"][1] <= results["gradient"][0] - 5
    assert results["striped"] == [0, 25, 25]


def test_fewer_steps_are_no_rule():
    """In two or more draws of the noisy room, point to plane takes more steps than point pairs, and both find the
    room."""
    point, plane = runs("noise", "icp", MIDWAY), runs("noise", "point-to-plane", MIDWAY)
    valid = (point[1] < 5.0) & (plane[1] < 5.0)
    assert (valid & (plane[0].steps > point[0].steps)).sum() >= 2


def test_fewer_steps_are_no_better_pose():
    """In the noisy room, from the near start, point to plane takes fewer steps in 24 of 25 draws, but in about half of
    the draws it ends farther from the true rotation than point pairs."""
    point, plane = runs("noise", "icp", NEAR), runs("noise", "point-to-plane", NEAR)
    assert (plane[0].steps < point[0].steps).sum() == 24
    assert 8 <= (plane[1] > point[1]).sum() <= 17


def test_a_convex_residual_does_not_make_a_convex_objective():
    """For fixed pairs the plane objective is a parabola along a line of translations; with points paired anew at each
    place it has at least three minima along one."""
    scene = room("clean")
    index = nearest.build(scene.target[None])
    n = normals(index).vectors[0]
    x = np.linspace(-3.0, 3.0, 241)
    start_rows = index.nearest(scene.source[None])[0][0]

    def cost(shift, rows):
        residuals = scene.source + np.array([shift, 0.0]) - scene.target[rows]
        return ((residuals * n[rows]).sum(axis=1) ** 2).mean()

    fixed = np.array([cost(shift, start_rows) for shift in x])
    np.testing.assert_allclose(np.diff(fixed, 3), 0.0, atol=1e-10)
    places = [scene.source + np.array([shift, 0.0]) for shift in x]
    free = np.array([cost(shift, index.nearest(p[None])[0][0]) for shift, p in zip(x, places, strict=True)])
    assert ((free[1:-1] < free[:-2]) & (free[1:-1] < free[2:])).sum() >= 3


# Weights


def test_equal_residuals_get_unequal_weights():
    """Pairs of equal length have residuals that differ more than fivefold, in plane and in GICP mode, and pairs of
    equal residual have different weights: the weight is not a function of the squared residual."""
    scene = room("outliers")
    for method in ("point-to-plane", "gicp"):
        state = register(scene.source, scene.target, method, start=room_start(*NEAR), max_steps=0, weight="tukey")
        pairing, precision = state.states[0].pairing, state.states[0].precision
        gap = pairing.moved - scene.target[pairing.rows]
        residual = np.sqrt(np.maximum(np.einsum("mi,mij,mj->m", *_single(gap, precision, gap)), 0.0))
        r, w = pairing.distances.reshape(-1), pairing.weights.reshape(-1)
        distance = np.abs(np.subtract.outer(np.log(residual + 1e-9), np.log(residual + 1e-9)))
        alike = np.abs(np.subtract.outer(r, r)) < 0.01 * r[:, None]
        assert distance[alike].max() > np.log(5.0)
        same = distance < 0.05
        assert (
            np.abs(np.subtract.outer(w, w))[same].max() > 0.15
        )  # over 5 % of a residual, no kernel falls by even half as much


def _single(*arrays):
    return [np.asarray(a).reshape(-1, *np.shape(a)[-k:]) for a, k in zip(arrays, (1, 2, 1), strict=True)]


def test_a_scale_of_distances_is_not_that_of_plane_residuals():
    """At the truth of the clean room the median distance is more than twice the median plane residual: the rest is the
    gap between the two samplings. Most pairs that Huber down-weights by distance have ordinary plane residuals."""
    scene = room("clean")
    state = register(scene.source, scene.target, "point-to-plane", max_steps=0).states[0]
    r = np.ravel(state.pairing.distances)
    rows = np.ravel(state.pairing.rows)
    gap = scene.source - scene.target[rows]
    n = np.reshape(state.normals.vectors, (-1, 2))[rows]
    across = np.abs((gap * n).sum(axis=1))
    assert np.median(r) > 2.0 * np.median(across)
    down = robust.weights("huber", r[None], robust.threshold("huber", r[None]))[0] < 1.0
    usual = across < 1.345 * 1.4826 * np.median(across)
    assert (down & usual).sum() > 0.5 * down.sum() > 0


def test_from_near_robust_weights_halve_the_error(why):
    """With a fifth of each cloud junk, from the near start, each of the three weights lowers each residual's median
    rotation error, and Welsch more than halves it."""
    errors = {
        weight: np.median(runs("outliers", "icp", NEAR, weight=weight)[1])
        for weight in ("none", "huber", "tukey", "welsch")
    }
    why("the weight, of point pairs", {w.capitalize(): f"{e:.2f}° off in the median" for w, e in errors.items()})
    for method in ("icp", "point-to-plane", "gicp"):
        plain = np.median(runs("outliers", method, NEAR)[1])
        for weight in ("huber", "tukey", "welsch"):
            assert np.median(runs("outliers", method, NEAR, weight=weight)[1]) < plain
        assert np.median(runs("outliers", method, NEAR, weight="welsch")[1]) < 0.5 * plain


def test_from_midway_robust_weights_find_no_more_rooms():
    """With the same junk from 45°, no weight finds the room in more draws than using none does, and with point to plane
    Tukey finds it in four fewer."""
    plain = {method: successes("outliers", method, MIDWAY) for method in ("icp", "point-to-plane", "gicp")}
    for method, result in plain.items():
        for weight in ("huber", "tukey", "welsch"):
            assert 0 < successes("outliers", method, MIDWAY, weight=weight) <= result
    assert successes("outliers", "point-to-plane", MIDWAY, weight="tukey") == plain["point-to-plane"] - 4


def test_tukey_throws_away_the_wall_that_matters(why):
    """The long wall fits, so the scale is small, and the end wall, 0.6 u off, lies beyond Tukey's threshold: the slide
    is never corrected. Huber bounds the end wall's pull but keeps it, and closes the gap."""
    open_gaps = {name: abs(gaps("point-to-plane", 40, weight=name)[-1]) for name in ("tukey", "huber")}
    why("the weight", {name.capitalize(): f"{gap:.2f} u left open" for name, gap in open_gaps.items()})
    assert open_gaps["huber"] < 0.03
    assert open_gaps["tukey"] > 0.55


def test_about_the_median_itself_the_scale_is_smaller():
    """The clean room, 25 draws from −110°, 45°, 75° and 180°: the median absolute deviation about the median itself is
    0.2 to 0.6 times that about zero. With it Tukey rejects 15 to 20 % of the pairs on average from 180°, and at most
    2 % from the other three; with the scale about zero it rejects none from any of the four."""
    scenes = [room("clean", seed=seed) for seed in SEEDS]
    source, target = (np.stack([getattr(scene, name) for scene in scenes]) for name in ("source", "target"))
    for degrees, low, high in ((-110.0, 0.0, 0.02), (45.0, 0.0, 0.02), (75.0, 0.0, 0.02), (180.0, 0.15, 0.2)):
        moved = room_start(degrees, 1.43).apply(source)
        r = np.linalg.norm(moved[:, :, None] - target[:, None], axis=-1).min(axis=-1)
        median = np.median(r, axis=1, keepdims=True)
        about_median = 1.4826 * np.median(np.abs(r - median), axis=1)
        about_zero = robust.mad_scale(r)
        assert 0.2 < np.median(about_median / about_zero) < 0.6
        assert low <= (robust.weights("tukey", r, 4.685 * about_median) == 0.0).mean() <= high
        assert (robust.weights("tukey", r, robust.threshold("tukey", r)) > 0.0).all()


def test_trimming_pure_noise_costs_accuracy(why):
    """The noisy room has no wrong points. Dropping the farthest 30 % of the pairs there multiplies the RMS rotation
    error over 25 draws by more than two for point pairs, and by more than 1.5 for point to plane and GICP."""
    results = {
        method: [np.sqrt((runs("noise", method, NEAR, trim=t)[1] ** 2).mean()) for t in (0.0, 0.3)]
        for method in ("icp", "point-to-plane", "gicp")
    }
    messages = [" · ".join(f"{errors[k]:.2f}°" for errors in results.values()) for k in (1, 0)]
    why("how many pairs are dropped (point · plane · GICP)", {"30 %": messages[0], "none": messages[1]})
    for method, factor in (("icp", 2.0), ("point-to-plane", 1.5), ("gicp", 1.5)):
        whole, cut = results[method]
        assert cut > factor * whole
