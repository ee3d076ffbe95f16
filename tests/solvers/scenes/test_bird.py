"""The sparse bird: one draw, whose counts, noise, clutter and start are as stated."""

import numpy as np
import pytest

from solvers.metrics import rre
from solvers.scenes.bird import AREA, COUNTS, FIELD, MOST, SHAPE, TRUTH, bird, bird_start


def test_a_bird_has_the_stated_counts_noise_and_start():
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
def test_what_is_out_of_range_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"^{name}: "):
        bird(**{name: value})
