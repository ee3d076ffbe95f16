"""The scenes of proposed pairs: one draw, a known truth, and wrong pairs that agree on nothing or on one false pose."""

import numpy as np
import pytest

from solvers import Pose, Status, fit_rigid
from solvers.scenes.facade import FACADE, FACADE_TRUTH, MATCH_SCENES, PERIOD, facade_scene


@pytest.mark.parametrize("name", MATCH_SCENES)
def test_a_seed_is_a_scene_and_noise_stretches_it(name):
    """The same seed draws the same scene, another seed another one, and twice the noise doubles every displacement."""
    a, b, c = facade_scene(name, seed=7), facade_scene(name, seed=7), facade_scene(name, seed=8)
    assert np.array_equal(a.target, b.target)
    assert not np.array_equal(a.target, c.target)
    clean, noisy, double = (facade_scene(name, noise=s) for s in (0.0, 0.1, 0.2))
    assert np.allclose(double.target - clean.target, 2.0 * (noisy.target - clean.target), atol=1e-14)
    assert np.array_equal(clean.target_outlier, double.target_outlier)


@pytest.mark.parametrize("name", MATCH_SCENES)
def test_one_wrong_pair_more_leaves_the_others(name):
    """Each fortieth adds one wrong pair and keeps the rest; without noise, only the wrong ones are off."""
    for k in range(32):
        fewer, more = (facade_scene(name, noise=0.0, outliers=i / 40) for i in (k, k + 1))
        assert fewer.target_outlier.sum() == k
        assert np.all(more.target_outlier[fewer.target_outlier])
        assert np.any(fewer.target != more.target, axis=1).sum() == 1
        errors = np.linalg.norm(FACADE_TRUTH.apply(FACADE) - more.target, axis=1)
        assert np.array_equal(errors > 0.1, more.target_outlier)
        assert np.allclose(errors[~more.target_outlier], 0.0)


def test_repeated_pairs_agree_on_a_pose_one_window_off():
    """The wrong pairs of the repeated scene are fitted exactly by the truth shifted by one window."""
    scene = facade_scene("repeated", noise=0.0, outliers=0.8)
    wrong = scene.target_outlier
    fit = fit_rigid(scene.source[wrong], scene.target[wrong])
    assert fit.status == Status.CONVERGED
    np.testing.assert_allclose(fit.pose.apply(scene.source[wrong]), scene.target[wrong], atol=1e-12)
    shift = FACADE_TRUTH.compose(Pose.from_angle(0.0, (PERIOD, 0.0)))
    np.testing.assert_allclose(fit.pose.matrix, shift.matrix, atol=1e-12)


def test_what_is_refused():
    """Unknown names, negative noise and fractions out of range are refused by name."""
    with pytest.raises(ValueError, match=r"^name: "):
        facade_scene("reapeated")
    with pytest.raises(ValueError, match=r"^noise: "):
        facade_scene(noise=-1.0)
    with pytest.raises(ValueError, match=r"^outliers: "):
        facade_scene(outliers=0.9)
