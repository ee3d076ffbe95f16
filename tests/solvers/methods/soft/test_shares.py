"""The sparse bird, and the pairwise shares of the soft methods."""

import numpy as np
import pytest

from solvers import METHODS, Pose
from solvers.core.method import Problem
from solvers.core.stepper import begin
from solvers.methods.soft.filterreg import FilterRegOptions
from solvers.methods.soft.gmmreg import GmmRegOptions
from solvers.methods.soft.shares import clutter_weight, filterreg_shares, gmmreg_overlaps
from solvers.metrics import rre
from solvers.scenes.bird import AREA, COUNTS, FIELD, MOST, SHAPE, TRUTH, bird, bird_start


def first_state(method, options):
    s = bird()
    start = Pose(s.start.R[None], s.start.t[None])
    return begin(METHODS[method], Problem(s.source[None], s.target[None], np.ones((1, len(s.source))), start,
                                          np.array([40])), options).state()


@pytest.mark.parametrize("volume", [None, 64.0])
def test_filterreg_shares(volume):
    """Row sums are the weights W, and row means the soft targets, of the exact method, in both conventions."""
    state = first_state("filterreg", FilterRegOptions(filter="exact", first=0.6, clutter=0.2, volume=volume))
    P = filterreg_shares(state)
    np.testing.assert_allclose(P.sum(axis=1), state.weights[0], rtol=1e-10)
    np.testing.assert_allclose(P @ state.problem.target[0] / P.sum(axis=1)[:, None], state.targets[0], atol=1e-9)


def test_gmmreg_overlaps():
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


def test_the_bird():
    """Counts, masks, clutter within its field, noise that scales a single draw, and a start as far off as stated."""
    assert pytest.approx(FIELD[0] * FIELD[1]) == AREA
    a, b, c = bird(noise=0.1, clutter=3), bird(noise=0.2, clutter=3), bird(noise=0.0, clutter=4)
    assert (len(a.source), len(a.target)) == (COUNTS[0] + 3, COUNTS[1] + 3)
    assert a.source_outlier.sum() == a.target_outlier.sum() == 3
    for side in ("source", "target"):
        p, q, clean = getattr(a, side)[:26], getattr(b, side)[:26], getattr(c, side)[:26]
        np.testing.assert_allclose(q - clean, 2.0 * (p - clean), atol=1e-12)
        np.testing.assert_allclose(getattr(a, side)[-3:], getattr(c, side)[-4:-1], atol=1e-12)
    assert (np.abs(bird(clutter=MOST).target[-MOST:]) <= 0.5 * np.array(FIELD)).all()
    start = bird_start(-30.0, 2.0)
    assert np.degrees(rre(start, TRUTH)) == pytest.approx(30.0)
    centre = SHAPE.mean(axis=0)[None]
    assert np.linalg.norm(start.apply(centre) - TRUTH.apply(centre)) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("name", "value"), [("noise", -1.0), ("clutter", 11), ("clutter", -1), ("clutter", 1.5), ("seed", -1)]
)
def test_what_is_refused(name, value):
    with pytest.raises(ValueError, match=f"^{name}: "):
        bird(**{name: value})


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
