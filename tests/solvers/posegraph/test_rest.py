"""When a step of a pose graph is at rest: each limit from both sides."""

from typing import Any

import numpy as np
import pytest

from solvers.posegraph.rest import at_rest

STIFFNESS = np.stack([np.diag([1e3, 0.0, 1e9]), np.diag([0.0, 2e3, 1e9])])  # of two edges
PULLS = np.array([[3.0, 0.0, 1e3], [0.0, 4.0, 1e3]])


def rest(step: list[float], **changes: Any) -> bool:
    """Near the origin, for a tolerance of 1e-5, a longest translation of 10 u, and a step with a gain."""
    usual: dict[str, Any] = {
        "gain": 1.0, "objective": 1.0, "pulls": PULLS, "stiffness": STIFFNESS, "tolerance": 1e-5, "far": 1.0,
        "reach": 10.0,
    }  # fmt: skip
    return at_rest(np.array([[0.0, 0.0, 0.0], step]), **usual | changes)


@pytest.mark.parametrize(("axis", "limit"), [(0, 1e-4), (1, 1e-4), (2, 1e-5)])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_shift_counts_by_the_longest_translation_and_a_turn_in_radians(axis: int, limit: float, sign: float) -> None:
    step = sign * np.eye(3)[axis] * limit
    assert rest((0.99 * step).tolist())
    assert not rest((1.01 * step).tolist())


def test_a_gain_that_rounding_hides_widens_a_tighter_tolerance() -> None:
    """To 1e-6, if it is at most 1e-14 of the objective."""
    for turn, gain, expected in ((0.99e-6, 0.9e-14, True), (1.01e-6, 0.9e-14, False), (0.99e-6, 1.1e-14, False)):
        assert rest([0.0, 0.0, turn], gain=gain, tolerance=1e-9) == expected


def test_far_away_a_step_is_known_to_a_few_units_in_the_last_place() -> None:
    """At 10¹² u a unit u is 1.2e-4 u. Gains up to 5 u + 3000 u² are hidden by pulls of 3 and 4 and a stiffness of 1000
    and 2000; then a step of 4 u √n is at rest."""
    unit = float(np.spacing(1e12))
    hidden = 5.0 * unit + 3e3 * unit**2
    limit = 4.0 * unit * np.sqrt(2.0)
    for shift, gain, expected in ((0.99, 0.99, True), (1.01, 0.99, False), (0.99, 1.01, False)):
        changes = {"gain": gain * hidden, "tolerance": 1e-9, "far": 1e12, "reach": 1.0}
        assert rest([0.0, shift * limit, 0.0], **changes) == expected
    assert not rest([0.0, 0.99 * limit, 0.0], gain=0.99 * hidden, tolerance=1e-9, far=0.9e6, reach=1.0)
