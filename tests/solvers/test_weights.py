"""Weights of source points: only their ratios matter to a pose, and a zero leaves its point out."""

import numpy as np
import pytest

from solvers import METHODS, register, scenes

WEIGHTED = [name for name, method in METHODS.items() if method.weighted]
SCENE = scenes.room("combo")
COUNT = min(len(SCENE.source), len(SCENE.target))
WEIGHTS = np.random.default_rng(1).uniform(0.2, 1.0, COUNT)


def run(name, weights, source=SCENE.source[:COUNT]):
    return register(source, SCENE.target[:COUNT], name, weights=weights)


@pytest.mark.parametrize("factor", [2.0**-40, 2.0**40])
@pytest.mark.parametrize("name", WEIGHTED)
def test_a_common_factor_changes_the_objective_alone(name, factor):
    """By that factor, whether the largest weight is below one or above; a power of two changes no rounding."""
    result, scaled = run(name, WEIGHTS), run(name, factor * WEIGHTS)
    assert scaled.pose == result.pose
    assert (scaled.steps, scaled.status, scaled.reason) == (result.steps, result.status, result.reason)
    assert scaled.objective == factor * result.objective


# GICP's surfaces are those of all source points, whatever their weights.
@pytest.mark.parametrize("name", sorted({*WEIGHTED} - {"gicp"}))
def test_weights_matter_and_a_zero_leaves_its_point_out(name):
    """Where that point lies changes no pose, but that it is left out does."""
    weights, source = WEIGHTS.copy(), SCENE.source[:COUNT].copy()
    weights[7] = 0.0
    near, source[7] = run(name, weights, source.copy()), source[7] + [0.6, -0.4]
    far = run(name, weights, source)
    assert np.allclose(far.pose.matrix, near.pose.matrix, rtol=0.0, atol=1e-12)
    assert not np.allclose(run(name, np.ones(COUNT)).pose.matrix, near.pose.matrix, rtol=0.0, atol=1e-9)
