"""The pairwise shares of the soft methods, and the weight of clutter."""

import numpy as np
import pytest

from solvers import METHODS, Pose
from solvers.core.method import Problem
from solvers.core.stepper import begin
from solvers.methods.soft.filterreg import FilterRegOptions
from solvers.methods.soft.gmmreg import GmmRegOptions
from solvers.methods.soft.shares import clutter_weight, filterreg_shares, gmmreg_overlaps
from solvers.scenes.bird import bird


def first_state(method, options):
    s = bird()
    start = Pose(s.start.R[None], s.start.t[None])
    return begin(METHODS[method], Problem(s.source[None], s.target[None], np.ones((1, len(s.source))), start,
                                          np.array([40])), options).state()


@pytest.mark.parametrize("volume", [None, 64.0])
def test_filterreg_s_shares_sum_to_its_weights_and_targets(volume):
    """Row sums are the weights W, and row means the soft targets, of the exact method, in both conventions."""
    state = first_state("filterreg", FilterRegOptions(filter="exact", first=0.6, clutter=0.2, volume=volume))
    P = filterreg_shares(state)
    np.testing.assert_allclose(P.sum(axis=1), state.weights[0], rtol=1e-10)
    np.testing.assert_allclose(P @ state.problem.target[0] / P.sum(axis=1)[:, None], state.targets[0], atol=1e-9)


def test_gmmreg_s_overlaps_average_to_its_own():
    """Their row means are what the method sums."""
    state = first_state("gmmreg", GmmRegOptions(first=0.6))
    np.testing.assert_allclose(gmmreg_overlaps(state).mean(axis=1), state.overlap[0], rtol=1e-12)


def test_clutter_weight_is_the_inverse_of_the_clutter_term():
    """It inverts (2πσ²)^{d/2} w N / ((1 − w) V)."""
    for w, sigma, count, volume, d in ((0.1, 0.5, 30, 64.0, 2), (0.7, 2.0, 300, 5.0, 3)):
        offset = (2 * np.pi * sigma**2) ** (d / 2) * w * count / ((1 - w) * volume)
        assert clutter_weight(offset, sigma, count, volume, d) == pytest.approx(w, rel=1e-12)
    for bad in ((0.0, 1.0, 1, 1.0), (1.0, 0.0, 1, 1.0), (1.0, 1.0, 0, 1.0), (1.0, 1.0, 1, -1.0)):
        with pytest.raises(ValueError, match="expected"):
            clutter_weight(*bad)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((1e300, 1e-100, 1, 1e300), 1.0),
        ((1e-300, 1e100, 1, 1e-300), 0.0),
        ((1.0, 1e-200, 1, 1.0), 1.0),
        ((1.0, 1e200, 1, 1.0), 0.0),
        ((1e200, 1e200, 1, 1e200), 1.0 / (1.0 + 2.0 * np.pi)),
        ((1.0, 1e-200, 1, 1e-200, 1), 1.0 / (1.0 + np.sqrt(2.0 * np.pi))),
    ],
)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_clutter_weight_of_any_size_is_a_weight(arguments, expected):
    """This holds even if the product or the power in it over- or underflows."""
    assert clutter_weight(*arguments) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("dim", [0, -3, 1.5])
def test_clutter_weight_has_a_dimension(dim):
    with pytest.raises(ValueError, match=r"^dim: "):
        clutter_weight(1.0, 0.1, 100, 64.0, dim)
