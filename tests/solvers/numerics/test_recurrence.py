"""Cycles of poses of any length, after any lead-in, are found, and soon."""

import numpy as np
import pytest

from solvers.numerics.fits import rms_motion
from solvers.numerics.recurrence import anchor


@pytest.mark.parametrize("way", [0, 1, 5, 20])
@pytest.mark.parametrize("length", [1, 2, 3, 7])
def test_a_round_is_found_once_gone_round(way, length):
    """Places are distinct throughout the lead-in, then `length` of them repeat. The first to equal the anchor comes
    after the lead-in and one round, and no later than twice the longer of the two plus one round."""
    positions = np.arange(float(way + length))[:, None, None] * np.ones((1, 4, 2))

    def position(step):
        return positions[step if step < way else way + (step - way) % length][None]

    before = position(0)
    for step in range(1, 200):
        if rms_motion(position(step) - before)[0] == 0.0:
            break
        before = anchor(np.array([step]), position(step), before)
    assert way + length <= step <= 2 * max(way, length) + length
