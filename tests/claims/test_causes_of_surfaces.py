"""The causes that the chapter 'A point meets a wall' names: each test changes that one factor."""

import numpy as np
import pytest

from solvers import register
from solvers.numerics import gauss_newton
from solvers.scenes.rooms import room_start
from solvers.scenes.walls import sampled, single_wall
from solvers.studies.race import SEEDS

CORNER = np.array([(0.0, 0.0), (8.0, 0.0), (8.0, 2.0)])  # a long wall and a short one at its end
ALONG = np.array([8.0, 2.8]) / np.hypot(8.0, 2.8)  # the one wall


def last_gap(method, spacing=0.1, **options):
    """The distance left to the end wall when a run stops, u: a scan of the corner, pushed 0.6 u along its long wall."""
    cloud = sampled(CORNER, spacing)
    result = register(cloud - [0.6, 0.0], cloud, method, max_steps=200, **options)
    return float(0.6 - result.pose.t[0])


def test_the_sampling_holds_a_crab(why):
    """Point pairs stop with 0.32 u left open when the walls are sampled every 0.2 u, and with half, a quarter and an
    eighth of that at 0.1, 0.05 and 0.025 u."""
    gaps = {spacing: last_gap("icp", spacing) for spacing in (0.1, 0.2, 0.05, 0.025)}
    why("how densely the walls are sampled", {f"every {h:g} u": f"{gap:.2f} u left open" for h, gap in gaps.items()})
    assert gaps[0.2] == pytest.approx(0.32, abs=0.01)
    for spacing in (0.1, 0.05, 0.025):
        assert gaps[spacing] / gaps[2 * spacing] == pytest.approx(0.5, abs=0.02)


def test_a_small_scale_makes_tukey_let_go(why):
    """With its scale taken from the median, Tukey leaves the gap open at 0.6 u; with a fixed scale of 0.3 u it closes
    the gap."""
    usual, report = last_gap("point-to-plane", weight="tukey"), last_gap("point-to-plane", weight="tukey", scale=0.3)
    why(
        "Tukey's scale",
        {"from the median distance": f"{usual:.2f} u left open", "0.3 u": f"{abs(report):.2f} u left open"},
    )
    assert usual > 0.55
    assert abs(report) < 0.03


def slides(method, **options):
    """How far a run moves along the noisy wall, u, in each of 25 draws from one start."""
    start, moved = room_start(15.0, 0.5), []
    for seed in SEEDS:
        scene = single_wall(seed=seed, noise=0.1)
        result = register(scene.source, scene.target, method, start=start, max_steps=40, **options)
        moved.append(ALONG @ (result.pose.apply(scene.source) - start.apply(scene.source)).mean(axis=0))
    return np.array(moved)


def test_leaving_the_free_slide_alone_keeps_point_to_plane_still(why):
    """On the noisy wall, in 25 draws, point to plane stays within 0.03 u of its start along the wall. If it follows
    every direction it slides by more than 0.6 u, in either direction, as GICP does."""
    alone, full = slides("point-to-plane", free_below=0.05), slides("point-to-plane", free_below=0.0)
    why(
        "what point to plane does with a direction that is hardly held",
        {
            "leaves it out": f"at most {np.abs(alone).max():.2f} u along the wall",
            "follows it": f"from {full.min():.2f} to {full.max():.2f} u along the wall".replace("-", "−"),
        },
    )
    assert np.abs(alone).max() < 0.03
    assert full.min() < -0.6
    assert full.max() > 0.6


def test_tilted_normals_lower_the_condition_number(why):
    """On the wall with noise of 0.1 u, at the end of a run: with its measured normals the system's condition number is
    below 100; with the wall's own normal for every pair the slide is free, as it is without noise."""
    scene = single_wall(noise=0.1)
    state = register(scene.source, scene.target, "point-to-plane", start=scene.start, free_below=0.05).states[0]
    pairing = state.pairing
    vectors = np.reshape(state.normals.vectors, (-1, 2))[np.ravel(pairing.rows)]
    own = np.broadcast_to([-ALONG[1], ALONG[0]], vectors.shape)
    numbers = [
        float(
            gauss_newton.system(
                pairing.moved, scene.target[pairing.rows], (n[:, :, None] * n[:, None, :])[None], pairing.weights,
                pairing.moved.mean(axis=1), state.system.radius,
            ).condition[0]
        )
        for n in (vectors, own)
    ]  # fmt: skip
    why(
        "the normals, with noise of 0.1 u",
        {
            "measured on the noisy points": f"a condition number of {numbers[0]:.0f}",
            "the wall's own": "the slide is free" if numbers[1] > 1e12 else f"a condition number of {numbers[1]:.0f}",
        },
    )
    assert 20.0 < numbers[0] < 100.0
    assert numbers[1] > 1e12


def test_gicp_wanders_because_of_the_noise(why):
    """On the wall without noise, GICP stays within 0.01 u of its start along the wall, as does point to plane told to
    follow every direction; with noise of 0.1 u, in 25 draws, GICP slides by more than 0.6 u, in either direction."""
    noisy, start, scene = slides("gicp"), room_start(15.0, 0.5), single_wall(noise=0.0)
    drift, plane_drift = (
        float(ALONG @ (result.pose.apply(scene.source) - start.apply(scene.source)).mean(axis=0))
        for result in (
            register(scene.source, scene.target, method, start=start, max_steps=40, **options)
            for method, options in (("gicp", {}), ("point-to-plane", {"free_below": 0.0}))
        )
    )
    why(
        "the noise",
        {
            "0.1 u": f"from {noisy.min():.2f} to {noisy.max():.2f} u along the wall".replace("-", "−"),
            "none": f"{abs(drift):.3f} u along the wall",
        },
    )
    assert max(abs(drift), abs(plane_drift)) < 0.01
    assert noisy.min() < -0.6
    assert noisy.max() > 0.6
