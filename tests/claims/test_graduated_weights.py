"""The claims about graduated non-convexity, the method in 'Correspondences corrupted' that draws no samples."""

from dataclasses import replace

import numpy as np

from solvers import Pose, Status, register
from solvers.methods.pairs.graduated import GRADUATED, GraduatedOptions, tls_weights
from solvers.metrics import rre, rte
from solvers.scenes.facade import FACADE, FACADE_TRUTH, PERIOD, facade_scene
from solvers.stepper import Problem
from solvers.studies.race import SEEDS

FALSE_POSE = FACADE_TRUTH.compose(Pose.from_angle(0.0, (PERIOD, 0.0)))


def fit_graduated(scene, target=None):
    """Graduated non-convexity on a scene, with the figure's threshold."""
    return register(scene.source, scene.target if target is None else target, "graduated-nonconvexity", inlier=0.25)


def consensus(scene):
    """RANSAC on a scene, as the figure runs it."""
    options = {"inlier": 0.25, "separation": 0.7, "most": 300, "per_step": 300, "max_steps": 400}
    return register(scene.source, scene.target, method="ransac", seed=scene.seed, **options)


def near_truth(pose, scene):
    """Whether a pose is within 3° and 0.15 u of the truth."""
    return bool(rte(pose, scene.truth) < 0.15 and np.degrees(rre(pose, scene.truth)) < 3.0)


def scatter(scene):
    """The target with every wrong partner turned about its right place by a random angle of its own."""
    home = FACADE_TRUTH.apply(FACADE)
    turn = Pose.from_angle(np.random.default_rng(scene.seed).uniform(-np.pi, np.pi, len(home)))
    way = (turn.R @ (scene.target - home)[..., None])[..., 0]
    return np.where(scene.target_outlier[:, None], home + way, scene.target)


def test_graduated_weights_end_where_ransac_does():
    """18 of 40 wrong, 25 draws: after 15 to 26 fits the pose is near the truth, and equals RANSAC's refitted pose up to
    rounding."""
    for seed in SEEDS:
        scene = facade_scene(seed=seed)
        result, ransac = fit_graduated(scene), consensus(scene)
        np.testing.assert_allclose(result.matrix, ransac.matrix, atol=1e-10)
        assert near_truth(result.pose, scene)
        assert 15 <= result.steps <= 26


def test_graduated_weights_break_down_before_ransac():
    """Of 25 draws, all end within 3° and 0.15 u with 20 of 40 wrong, 14 with 28 and two with 32, while RANSAC does in
    all of them. The eleven misses with 28 wrong all report that they converged."""
    right = {}
    for wrong in (20, 28, 32):
        scenes = [facade_scene(seed=seed, outliers=wrong / 40) for seed in SEEDS]
        results = [fit_graduated(scene) for scene in scenes]
        hits = [near_truth(result.pose, scene) for result, scene in zip(results, scenes, strict=True)]
        right[wrong] = sum(hits)
        assert all(near_truth(consensus(scene).pose, scene) for scene in scenes)
        if wrong == 28:
            statuses = [result.status for result, hit in zip(results, hits, strict=True) if not hit]
            assert statuses == [Status.CONVERGED] * 11
    assert right == {20: 25, 28: 14, 32: 2}


def test_partners_that_lean_mislead_graduated_weights(why):
    """32 of 40 wrong, 25 draws: two find the truth if all wrong partners lie to the right, and 23 if each lies as far
    off in a random direction of its own."""
    scenes = [facade_scene(seed=seed, outliers=0.8) for seed in SEEDS]
    leaning = sum(near_truth(fit_graduated(scene).pose, scene) for scene in scenes)
    spread = sum(near_truth(fit_graduated(scene, scatter(scene)).pose, scene) for scene in scenes)
    why(
        "in which directions the 32 wrong partners lie",
        {"to the right": f"{leaning} of 25 are right", "each its own": f"{spread} of 25"},
    )
    assert leaning == 2
    assert spread == 23


def test_graduated_weights_begin_at_a_fit_pulled_aside(why):
    """28 of 40 wrong, 25 draws: the least-squares fit lies more than 1.5 u off in each, and fewer than 18 runs from it
    end near the truth. With the first weights taken at the truth instead, for the same μ, all 25 do. With 32 wrong it
    is fewer than 5, and all 25."""
    right = {}
    for wrong in (28, 32):
        scenes = [facade_scene(seed=seed, outliers=wrong / 40) for seed in SEEDS]
        source, target = (np.stack([getattr(scene, name) for scene in scenes]) for name in ("source", "target"))
        problem = Problem(source, target, np.ones(source.shape[:2]), Pose.identity(2, (25,)), np.array(SEEDS))
        fitted = GRADUATED.step(GRADUATED.start(problem, GraduatedOptions(inlier=0.25)))
        assert rte(fitted.pose, FACADE_TRUTH).min() > 1.5
        ratio = np.linalg.norm(FACADE_TRUTH.apply(source) - target, axis=2) / 0.25
        for begin, state in (
            ("the least-squares fit", fitted),
            ("the truth", replace(fitted, shares=tls_weights(ratio, fitted.mu))),
        ):
            while (state.status == Status.RUNNING).any():
                state = GRADUATED.step(state)
            hits = [near_truth(pose, scene) for pose, scene in zip(state.pose, scenes, strict=True)]
            right[begin, wrong] = sum(hits)
    why("where it begins, with 28 of 40 wrong", {
        begin: f"{right[begin, 28]} of 25 are right" for begin in ("the least-squares fit", "the truth")
    })  # fmt: skip
    assert right["the least-squares fit", 28] < 18
    assert right["the least-squares fit", 32] < 5
    assert [right["the truth", wrong] for wrong in (28, 32)] == [25, 25]


def test_graduated_weights_follow_a_false_majority():
    """With 24 of 40 wrong alike, each of 25 draws ends at the pose that is one window off."""
    for seed in SEEDS:
        scene = facade_scene("repeated", seed=seed, outliers=0.6)
        assert rte(fit_graduated(scene).pose, FALSE_POSE) < 0.2
