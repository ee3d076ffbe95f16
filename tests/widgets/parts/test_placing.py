"""Placing a cloud by hand: where its two handles are, and what a drag of either does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers import Pose
from widgets.drawing.picture import View
from widgets.engine.contract import Action
from widgets.parts.placing import Placing, place, written

VIEW = View(-3.0, 9.0, -2.0, 6.0)  # not about the origin
PLACING = Placing(VIEW, limit=(2.5, 1.5), reach=2.6, least=1.2)
ANCHOR = np.array([0.4, -0.3])


@given(st.floats(-2.4, 2.4), st.floats(-1.4, 1.4), st.floats(-3.1, 3.1))
def test_the_turning_handle_is_along_the_heading_and_in_the_window(x: float, y: float, heading: float) -> None:
    """At its full reach where there is room, else a quarter of a unit from the border, but never closer than its
    least."""
    rotation = Pose.from_angle(heading)
    pose = Pose(rotation.R, np.array([x, y]) - rotation.R @ ANCHOR)
    move, turn = PLACING.handles(pose, ANCHOR)
    np.testing.assert_allclose(move.xy, [x, y], atol=1e-12)
    arm = np.array(turn.xy) - move.xy
    distance = float(np.hypot(*arm))
    np.testing.assert_allclose(arm, distance * np.array([np.cos(heading), np.sin(heading)]), atol=1e-9)
    u, v = turn.xy
    gaps = np.array([u - VIEW.x0, VIEW.x1 - u, v - VIEW.y0, VIEW.y1 - v]) - 0.25
    assert PLACING.least - 1e-9 <= distance <= PLACING.reach + 1e-9
    if distance > PLACING.least + 1e-9:
        assert gaps.min() > -1e-9
    if distance < PLACING.reach - 1e-9:
        assert gaps.min() < 1e-9
    assert turn.angle == pytest.approx(np.degrees(heading))


@pytest.mark.parametrize(("x", "y"), [(1.0, -0.5), (9.0, -7.0)])
def test_a_drag_moves_the_anchor_within_its_limits_or_turns_about_it(x: float, y: float) -> None:
    pose = Pose.from_angle(0.7, (0.2, 0.1))
    moved = PLACING.act(pose, ANCHOR, Action("drag", "source", x, y))
    centre, heading = place(moved, ANCHOR)
    np.testing.assert_allclose(centre, np.clip([x, y], [-2.5, -1.5], [2.5, 1.5]))
    assert heading == pytest.approx(0.7)
    turned = PLACING.act(pose, ANCHOR, Action("drag", "turn", x, y))
    before, (after, heading) = place(pose, ANCHOR)[0], place(turned, ANCHOR)
    np.testing.assert_allclose(after, before)
    assert heading == pytest.approx(np.arctan2(y - before[1], x - before[0]))


def test_a_written_pose_is_the_pose() -> None:
    pose = Pose.from_angle(-2.1, (1.25, -0.75))
    found = eval(written(pose), {"Pose": Pose, "np": np})
    np.testing.assert_allclose(found.matrix, pose.matrix, atol=1e-9)
