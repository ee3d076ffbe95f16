"""A robot's outlines: ahead is along x, and both sides are alike."""

from __future__ import annotations

import numpy as np
import pytest

from widgets.drawing.picture import Array
from widgets.parts.robot import ARROW, disc


@pytest.mark.parametrize("outline", [ARROW, disc(0.42, 0.25), disc(0.34, 0.2, 0.6, 24)])
def test_the_nose_is_ahead_and_the_sides_are_mirrored(outline: Array) -> None:
    np.testing.assert_array_equal(outline[0], [outline[:, 0].max(), 0.0])
    np.testing.assert_allclose(outline[1:] * [1.0, -1.0], outline[:0:-1], atol=1e-15)


def test_a_discs_rim_is_round_and_open_ahead() -> None:
    x, y = disc(0.42, 0.25, 0.7, 25)[1:].T
    np.testing.assert_allclose(np.hypot(x, y), 0.25)
    assert len(x) == 25
    assert np.abs(np.arctan2(y, x)).min() == pytest.approx(0.7)
